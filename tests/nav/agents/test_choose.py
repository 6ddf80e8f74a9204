"""Agents are found by name, by file, or as module:object, and their parameters are set by name."""

import re
import sys
from dataclasses import fields

import numpy as np
import pytest

from flysim.errors import FlysimError
from flysim.nav.agents.agent import RobotLimits
from flysim.nav.agents.chart_params import ChartParams
from flysim.nav.agents.choose import AGENTS, make_agent
from flysim.nav.agents.dwa import DwaParams
from flysim.nav.agents.surroundings import RANGE, SECTORS, SurroundingsParams
from flysim.nav.agents.vfh import VfhAgent, VfhParams, free_run
from flysim.nav.agents.warning import WarningParams
from flysim.nav.trial import tasks_for

LIMITS = RobotLimits(radius=0.2, v_max=0.5, w_max=1.5, period=0.1)


def seen(*blocked, goal=(3.0, 0.0)):
    """An observation with things at `(sector, distance)`, the robot standing."""
    obstacles = np.full(SECTORS, RANGE, np.float32)
    for sector, distance in blocked:
        obstacles[sector] = distance
    return {"obstacles": obstacles, "goal": np.array(goal, np.float32), "velocity": np.zeros(2, np.float32)}


AHEAD = [(sector, 0.8) for sector in range(33, 39)]


@pytest.mark.parametrize("name", ["straight", "warning", "vfh", "dwa"])
def test_with_nothing_in_the_way_it_drives_to_the_goal(name):
    agent = make_agent(name, LIMITS)

    def first_act(bearing):
        agent.begin(np.random.default_rng(0))
        return agent.act(seen(goal=(3.0, bearing)))

    v, w = first_act(0.0)
    assert v > 0.1 and abs(w) < 0.2
    assert first_act(1.2)[1] > 0.25  # left is positive
    assert first_act(-1.2)[1] < -0.25


@pytest.mark.parametrize("name", ["warning", "vfh", "dwa"])
def test_what_stands_in_the_way_is_driven_round(name):
    agent = make_agent(name, LIMITS)
    agent.begin(np.random.default_rng(0))
    for _ in range(6):
        v, w = agent.act(seen(*AHEAD))
    assert abs(w) > 0.2 or v < 0.2
    straight = make_agent("straight", LIMITS).act(seen(*AHEAD))
    assert straight[0] > 0.9 and abs(straight[1]) < 1e-6  # who sees nothing does not care


def test_a_parameter_changes_what_an_agent_does():
    acts = []
    for params in ({"turn": 2.0}, {"turn": 1.0}):
        agent = make_agent("vfh", LIMITS, params)
        agent.begin(np.random.default_rng(0))
        acts.append(agent.act(seen(goal=(3.0, 0.3))))
    assert acts[1][1] == pytest.approx(acts[0][1] / 2.0, rel=1e-4)  # it turns by half of the rate
    np.testing.assert_allclose(VfhAgent(LIMITS, VfhParams(turn=1.0)).act(seen(goal=(3.0, 0.3))), acts[1])


@pytest.mark.parametrize("record", [VfhParams, DwaParams, WarningParams, ChartParams, SurroundingsParams])
def test_nonsense_is_refused_at_birth(record):
    name = record.__slots__[0]
    for value in (-1.0, float("nan"), float("inf"), "far", True, None):
        with pytest.raises(ValueError, match=f"^{name} must be a (whole )?number in "):
            record(**{name: value})


@pytest.mark.parametrize(
    ("record", "name"),
    [(VfhParams, "directions"), (VfhParams, "replan"), (DwaParams, "speeds"), (DwaParams, "moments")],
)
def test_what_counts_is_a_whole_number(record, name):
    with pytest.raises(ValueError, match=rf"^{name} must be a whole number in \[.*\], got 9\.5$"):
        record(**{name: 9.5})
    assert getattr(record(**{name: 9}), name) == 9


@pytest.mark.parametrize("name", ["vfh", "dwa", "warning"])
def test_an_agent_drives_at_every_end_of_its_ranges(name):
    record = make_agent(name, LIMITS).Params
    own = [(field, lambda key, value: {key: value}) for field in fields(record) if field.name != "chart"]
    inner = [(field, lambda key, value: {"chart": {key: value}}) for field in fields(ChartParams)]
    for field, given in own + (inner if hasattr(record(), "chart") else []):
        refused = pytest.raises(ValueError, match=rf"{field.name} must be")
        with refused as caught:
            record(**given(field.name, 1e9))
        low, high = (float(end) for end in re.search(r"\[(\S+), (\S+)\]", str(caught.value)).groups())
        for end in (low, high):
            value = int(end) if field.type == "int" else end
            agent = make_agent(name, LIMITS, given(field.name, value))
            agent.begin(np.random.default_rng(0))
            for look in (seen(), seen(*AHEAD)):
                assert np.isfinite(agent.act(look)).all(), (field.name, end)


def test_a_circle_runs_until_it_touches():
    points = np.array([[1.0, 0.0], [0.0, 2.0]])
    run = free_run(points, np.array([0.0, np.pi / 2.0, np.pi, 0.3]), 0.2, 1.5)
    aside = np.sin(0.3)
    assert run == pytest.approx([0.8, 1.5, 1.5, 1.5 if aside > 0.2 else 0.8])
    assert free_run(np.zeros((0, 2)), np.zeros(3), 0.2, 1.5).tolist() == [1.5] * 3


@pytest.mark.parametrize(
    ("name", "params", "said"),
    [
        ("vhf", None, r"no agent 'vhf'\. Did you mean 'vfh'\?"),
        ("vfh", {"loook": 1.0}, r"agent 'vfh' has no 'loook'\. Did you mean 'look'\?"),
        ("vfh", {"look": -1.0}, r"agent 'vfh': look must be a number in \[0.1, 20\], got -1.0"),
        ("vfh", {"look": "far"}, "agent 'vfh': look must be a number in .* got 'far'"),
        ("dwa", {"chart": {"berht": 0.1}}, r"agent 'dwa': chart has no 'berht'\. Did you mean 'berth'\?"),
        ("dwa", {"chart": {"cell": 0.0}}, r"agent 'dwa': chart: cell must be a number in \[0.02, 0.5\] m, got 0.0"),
        ("dwa", {"chart": 3}, "agent 'dwa': chart must be a ChartParams or a dict of its fields, got 3"),
        ("straight", {"look": 1.0}, "agent 'straight' has no parameters to set"),
    ],
)
def test_a_mistake_is_one_line(name, params, said):
    with pytest.raises(FlysimError, match=said):
        make_agent(name, LIMITS, params)


def test_parameters_go_to_the_agent_that_is_named():
    tasks = tasks_for(("vfh", "dwa"), "yard", episodes=1, observation="truth", params={"vfh": {"look": 1.0}})
    assert [task.params for task in tasks] == [{"look": 1.0}, {}]
    with pytest.raises(FlysimError, match="parameters of 'warning', which does not drive"):
        tasks_for(("vfh",), "yard", episodes=1, observation="truth", params={"warning": {}})


MINE = """
import numpy as np
from dataclasses import dataclass

@dataclass(frozen=True)
class Params:
    speed: float = 0.5

class Creeps:
    Params = Params

    def __init__(self, limits, params=None):
        self.limits, self.params = limits, params or Params()

    def begin(self, rng):
        pass

    def act(self, observation):
        return np.array([self.params.speed, 0.0], np.float32)

number = 7
"""


def test_an_agent_whose_parameters_are_no_record_is_one_line(tmp_path, monkeypatch):
    (tmp_path / "odd_agents.py").write_text(
        "class Odd:\n    Params = {'speed': 1.0}\n\n    def __init__(self, limits): ...\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    try:
        with pytest.raises(FlysimError, match="agent 'odd_agents:Odd': its Params must be a dataclass"):
            make_agent("odd_agents:Odd", LIMITS, {"speed": 0.5})
    finally:
        sys.modules.pop("odd_agents", None)


def test_an_agent_of_ones_own(tmp_path, monkeypatch):
    (tmp_path / "my_agents.py").write_text(MINE)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    try:
        assert make_agent("my_agents:Creeps", LIMITS).act(seen())[0] == 0.5
        assert make_agent("my_agents:Creeps", LIMITS, {"speed": 0.25}).act(seen())[0] == 0.25
        with pytest.raises(FlysimError, match="agent 'my_agents:number' is no class"):
            make_agent("my_agents:number", LIMITS)
        assert "my_agents:Creeps" not in AGENTS.names
    finally:
        sys.modules.pop("my_agents", None)
