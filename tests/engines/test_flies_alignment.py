"""The flies' engine on a rig that is not what it is believed to be: rows are found to lie apart, and made to meet."""

import math

import cv2
import numpy as np
import pytest

import flysim as fs
from flysim.engines.flies import SCOUTS, Flies
from flysim.flies.evolution import evolve
from flysim.flies.parameters import FlyParams
from flysim.geometry.rig import ImagePair
from flysim.products.frame import Frame
from flysim.stereo.alignment import WORTH_PX, Misalignment

PARAMS = FlyParams(population=1500)


def off(pair, roll_deg, rows_px):
    """The pair with its right picture turned clockwise about the principal point, and lower."""
    camera = pair.rig.right
    c, s = math.cos(math.radians(roll_deg)), math.sin(math.radians(roll_deg))
    cx, cy = camera.cx, camera.cy
    there = np.array([[c, -s, cx - c * cx + s * cy], [s, c, cy - s * cx - c * cy + rows_px]])
    right = cv2.warpAffine(
        pair.right, there, (camera.width, camera.height), flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE
    )
    return ImagePair(left=pair.left, right=np.asarray(right, np.uint8), rig=pair.rig)


def seen(pairs, params=PARAMS):
    """What a new engine says of one pair after the other."""
    flies = Flies()
    flies.begin(pairs[0].rig, params)
    frames = [Frame.alone(pair, index=k, time=float(k)) for k, pair in enumerate(pairs)]
    return [flies.see(frame, rng=np.random.default_rng(5)) for frame in frames]


def errors(scene, swarm):
    """[px] by which points are misplaced in the left and a level right picture, where both eyes see the pixel."""
    u, v = np.rint(swarm.uv).astype(int).T
    level = scene.pair.rig.project(swarm.points.astype(float))[1]
    wrong = np.abs(swarm.uv[:, 0] - level[:, 0] - scene.disparity[v, u])
    return wrong[np.isfinite(wrong) & scene.seen[v, u]]


@pytest.mark.parametrize(("roll", "rows"), [(0.0, 1.0), (0.0, -2.0), (0.3, 0.0), (-0.5, 0.7)])
def test_rows_and_roll_are_found_taken_away_and_said(scene, roll, rows):
    pair = off(scene.pair, roll, rows)
    swarm = seen([pair])[0]
    assert swarm.rows_px == pytest.approx(rows, abs=0.1)
    assert swarm.roll_deg == pytest.approx(roll, abs=0.05)
    clean = seen([scene.pair])[0]
    assert len(swarm.points) > 0.75 * len(clean.points)
    assert np.mean(errors(scene, swarm) < 1.0) > np.mean(errors(scene, clean) < 1.0) - 0.02
    # `uv_right` is where the picture shows the point that was handed in, not where a level one would.
    level = scene.pair.rig.project(swarm.points.astype(float))[1]
    camera = pair.rig.right
    down = math.sin(math.radians(roll)) * (level[:, 0] - camera.cx) + rows
    assert np.abs(swarm.uv_right[:, 1] - level[:, 1] - down).max() < 0.15


def test_without_it_flies_are_lost(scene):
    """If they were not, there would be nothing to correct."""
    pair, blind = off(scene.pair, 0.5, 2.0), FlyParams(population=1500, align=False)
    swarm = seen([pair], blind)[0]
    assert swarm.rows_px is None and swarm.roll_deg is None
    right = (errors(scene, swarm) < 1.0).sum()
    assert right < 0.6 * (errors(scene, seen([pair])[0]) < 1.0).sum()


def test_a_rig_that_is_what_it_is_believed_to_be_costs_nothing(scene):
    swarm = seen([scene.pair])[0]
    assert swarm.rows_px == swarm.roll_deg == 0.0
    plain = evolve(scene.pair, PARAMS, rng=np.random.default_rng(5))
    assert np.array_equal(swarm.points, plain.points) and np.array_equal(swarm.uv_right, plain.uv_right)


def test_all_flies_evolve_once_after_a_few_have_told_where_rows_lie(scene, monkeypatch):
    sent = []

    def counted(pair, params, **rest):
        sent.append(params.population)
        return evolve(pair, params, **rest)

    monkeypatch.setattr("flysim.engines.flies.evolve", counted)
    many = FlyParams(population=6000)
    # A fifth of a pixel is told well enough at once; of more, matches were wrong, and they are asked again.
    for pair, scouts in ((scene.pair, 1), (off(scene.pair, 0.0, 0.2), 1), (off(scene.pair, 0.2, 1.0), 2)):
        sent.clear()
        seen([pair], many)
        assert sent == [SCOUTS] * scouts + [6000]


@pytest.mark.parametrize(
    ("told", "sent"),
    [((0.2,), [SCOUTS, 6000]), ((1.0, 0.05), [SCOUTS, SCOUTS, 6000]), ((1.0, 0.2, 0.05), [SCOUTS, SCOUTS, 6000])],
)
def test_what_a_large_shift_leaves_is_asked_about_until_it_is_small(scene, monkeypatch, told, sent):
    populations, answers = [], iter(told)

    def counted(pair, params, **rest):
        populations.append(params.population)
        return evolve(pair, params, **rest)

    monkeypatch.setattr("flysim.engines.flies.evolve", counted)
    monkeypatch.setattr("flysim.engines.flies.misalignment", lambda *_: Misalignment(rows_px=next(answers)))
    swarm = seen([scene.pair], FlyParams(population=6000))[0]
    assert populations == sent and next(answers, None) is None
    assert swarm.rows_px == pytest.approx(sum(one for one in told if one > WORTH_PX))


def test_a_small_shift_of_the_rows_is_told_by_the_first_few(scene):
    swarm = seen([off(scene.pair, 0.0, 0.2)], FlyParams(population=6000))[0]
    assert swarm.rows_px == pytest.approx(0.2, abs=0.06) and swarm.roll_deg == pytest.approx(0.0, abs=0.01)


def test_what_the_first_frame_has_told_holds_for_the_others(scene):
    first, second, third = seen([off(scene.pair, 0.2, 1.5)] * 3)
    for later in (second, third):
        assert later.rows_px == pytest.approx(1.5, abs=0.1) and later.roll_deg == pytest.approx(0.2, abs=0.05)
        assert len(later.points) > 0.8 * len(first.points)


def test_a_new_sequence_knows_nothing_of_the_one_before(scene):
    flies = Flies()
    told = []
    for pair in (off(scene.pair, 0.3, 1.0), scene.pair):
        flies.begin(pair.rig, PARAMS)
        told.append(flies.see(Frame.alone(pair), rng=np.random.default_rng(5)))
    assert told[0].rows_px == pytest.approx(1.0, abs=0.1)
    assert told[1].rows_px == told[1].roll_deg == 0.0


@pytest.mark.parametrize(("roll", "rows"), [(0.0, 1.0), (0.3, 0.0)])
def test_a_report_names_what_was_wrong_as_the_scenario_does(roll, rows):
    overrides = [f"calibration.right_roll_deg={roll}", f"calibration.row_shift_px={rows}", "flies.population=1500"]
    report = fs.run("paper_a", seed=1, renderer="tiny", overrides=[*overrides, "stops=[{x=1.0, y=0.0}]"])
    told = report.to_json()["alignment"]
    assert told["right_roll_deg"] == pytest.approx(roll, abs=0.05)
    assert told["row_shift_px"] == pytest.approx(rows, abs=0.1)
