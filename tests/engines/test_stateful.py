"""An engine has a state of its own: the flies may outlive a picture, and anybody may bring another engine."""

import sys

import numpy as np
import pytest

from flysim.engines.choose import engine
from flysim.engines.engine import alone
from flysim.engines.standing import standing
from flysim.errors import EngineError
from flysim.flies.evolution import evolve
from flysim.flies.parameters import FlyParams
from flysim.geometry.frames import R_BODY_OPTICAL, se3
from flysim.products.frame import Frame
from flysim.runs.run import run
from flysim.runs.scenario import read_scenario

FEW = FlyParams(population=1000, max_iterations=2, carry_below=0.6)
T_BASE_LEFT = se3(R_BODY_OPTICAL, (0.0, 0.0, 0.45))


def frames(pair, count, step=0.0):
    """The robot stands, or believes to drive `step` metres a frame, before the same picture."""
    for index in range(count):
        T = se3(np.eye(3), (index * step, 0.0, 0.0))
        yield Frame(index=index, time=0.1 * index, pair=pair, T_world_base=T, T_base_left=T_BASE_LEFT)


def seen(scene, params, step=0.0, count=4):
    eyes, rng = engine("flies"), np.random.default_rng(5)
    eyes.begin(scene.pair.rig, params)
    return [eyes.see(frame, rng=rng) for frame in frames(scene.pair, count, step)]


def test_flies_that_are_carried_grow_in_number_from_frame_to_frame(scene):
    numbers = [len(swarm.points) for swarm in seen(scene, FEW)]
    fresh = [len(swarm.points) for swarm in seen(scene, FlyParams(population=1000, max_iterations=2))]
    assert numbers[0] == fresh[0]
    assert min(numbers[1:]) > 1.3 * max(fresh)


def test_what_is_carried_to_the_wrong_place_is_of_no_use(scene):
    right, wrong = (seen(scene, FEW, step)[-1] for step in (0.0, 0.5))
    assert len(wrong.points) < 0.9 * len(right.points)


def test_a_new_sequence_begins_with_nothing(scene):
    eyes = engine("flies")
    swarms = []
    for _ in range(2):
        eyes.begin(scene.pair.rig, FEW)
        rng = np.random.default_rng(5)
        swarms.append([eyes.see(frame, rng=rng) for frame in frames(scene.pair, 2)])
    for one, again in zip(*swarms, strict=True):
        np.testing.assert_array_equal(one.points, again.points)


def test_without_carrying_it_is_evolve_and_nothing_else(scene):
    params = FlyParams(population=800, max_iterations=4)
    by_engine = alone(engine("flies"), scene.pair, params, rng=np.random.default_rng(3))
    by_hand = evolve(scene.pair, params, rng=np.random.default_rng(3))
    np.testing.assert_array_equal(by_engine.points, by_hand.points)


def test_what_stands_is_neither_floor_nor_ceiling():
    base = np.array([[1.0, 0.0, 0.0], [1.0, 0.0, 0.06], [1.0, 0.0, 0.08], [3.0, 0.0, 0.08], [1.0, 0.0, 0.7]])
    assert standing(base, 0.6).tolist() == [False, False, True, False, False]


MINE = '''
import numpy as np
from flysim.flies.parameters import FlyParams
from flysim.engines.chance import chance

class Counting:
    """Sees by chance, and counts what it saw in its reason."""

    def begin(self, rig, params):
        self.params, self.seen = params, 0

    def see(self, frame, *, rng):
        from dataclasses import replace
        self.seen += 1
        return replace(chance(frame.pair, self.params, rng=rng), reason=f"frame {frame.index}, {self.seen} so far")

def plain(pair, params, *, rng):
    return chance(pair, params, rng=rng)

class Blind:
    pass

number = 7
'''


@pytest.fixture
def here(tmp_path, monkeypatch):
    (tmp_path / "my_engines.py").write_text(MINE)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [path for path in sys.path if path])
    yield tmp_path
    sys.modules.pop("my_engines", None)


def test_an_engine_of_ones_own_runs_a_scenario(here, short):
    plan = read_scenario(str(short), ["engine=my_engines:Counting"])
    assert run(plan, renderer="tiny").engine == "my_engines:Counting"
    assert run(str(short), renderer="tiny", overrides=["engine=my_engines:plain"]).engine == "my_engines:plain"


def test_an_engine_keeps_its_state_from_frame_to_frame(here, scene):
    eyes = engine("my_engines:Counting")
    eyes.begin(scene.pair.rig, FlyParams(population=100))
    told = [eyes.see(frame, rng=np.random.default_rng(0)).reason for frame in frames(scene.pair, 3)]
    assert told == ["frame 0, 1 so far", "frame 1, 2 so far", "frame 2, 3 so far"]
    eyes.begin(scene.pair.rig, FlyParams(population=100))
    assert eyes.see(next(frames(scene.pair, 1)), rng=np.random.default_rng(0)).reason == "frame 0, 1 so far"


@pytest.mark.parametrize("name", ["my_engines:Blind", "my_engines:number"])
def test_what_cannot_see_is_no_engine(here, name):
    with pytest.raises(EngineError, match=f"engine '{name}' is neither a class with begin"):
        engine(name)
