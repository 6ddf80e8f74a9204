"""Navigation: an environment that agents are trained and judged in, the agents, their scores."""

from gymnasium.envs.registration import register

ENV_ID = "flysim/FlyNav-v0"


def register_envs() -> None:
    """What gymnasium's entry point calls: makes `FlyNav-v0` known; under the name flysim, whoever calls it."""
    from gymnasium.envs.registration import registry

    if ENV_ID not in registry:
        register(id=ENV_ID, entry_point="flysim.nav.env:FlyNavEnv")


register_envs()
