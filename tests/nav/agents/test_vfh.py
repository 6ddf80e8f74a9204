"""VFH: directions that are open, and those that only seem so."""

import numpy as np
import pytest

from flysim.nav.agents.agent import RobotLimits
from flysim.nav.agents.surroundings import RANGE, SECTORS
from flysim.nav.agents.vfh import VfhAgent, VfhParams

LIMITS = RobotLimits(radius=0.19, v_max=0.5, w_max=1.5, period=0.1)


@pytest.fixture
def act(monkeypatch):
    """The action of an agent that sees nothing, towards a goal ahead, with hidden floor at `[n, 2]` points."""

    def one(hidden, **params):
        agent = VfhAgent(LIMITS, VfhParams(**params))
        agent.begin(np.random.default_rng(0))
        monkeypatch.setattr(agent._chart, "hidden", lambda reach, beside: np.asarray(hidden, np.float64).reshape(-1, 2))
        return agent.act({"obstacles": np.full(SECTORS, RANGE), "velocity": np.zeros(2), "goal": np.array([3.0, 0.0])})

    return one


def test_it_goes_round_what_is_hidden(act):
    aside = [(0.6, y) for y in np.arange(-0.5, 0.06, 0.05)]  # the rest of a thing to the right
    assert act([])[1] == pytest.approx(0.0, abs=0.1)
    assert act(aside)[1] > 0.3


def test_hidden_floor_shuts_no_way(act):
    about = [(0.3 * np.cos(angle), 0.3 * np.sin(angle)) for angle in np.linspace(-np.pi, np.pi, 60)]
    assert act(about) == pytest.approx(act([]))
