"""Navigation: an environment that agents are trained and judged in, the agents, their scores."""

from gymnasium.envs.registration import register, registry

ENV_ID = "flysim/FlyNav-v0"


def register_envs() -> None:
    """Makes `FlyNav-v0` known to gymnasium, under the name flysim, whoever calls it and however often."""
    if ENV_ID not in registry:
        register(id=ENV_ID, entry_point="flysim.nav.env:FlyNavEnv")


register_envs()
