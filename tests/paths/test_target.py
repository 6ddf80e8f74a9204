"""Obstacles as places to look at: where their outlines are, which way they face, and what counts as one."""

import numpy as np
import pytest

from flysim.paths.grid import CELL, survey
from flysim.paths.target import OUT, find_targets
from flysim.worlds.sdf.reader import read_world


@pytest.fixture
def targets(made, tmp_path):
    def one(*models, gap=0.05):
        world = read_world(made.write(tmp_path / "w.sdf", *models))
        return find_targets(world, survey(world, 0.4), gap)

    return one


def test_a_box_is_looked_at_on_its_four_sides(made, targets):
    found = targets(made.body("b", made.box(0.6, 0.4, 0.5), "2 1 0.25 0 0 0"))
    assert found.names == ("b",)
    assert found.centers[0] == pytest.approx((2.0, 1.0), abs=CELL)
    off = found.xy - (2.0, 1.0)
    outside = np.maximum(np.abs(off[:, 0]) - 0.3, np.abs(off[:, 1]) - 0.2)
    assert outside == pytest.approx(np.full(len(off), OUT), abs=1.5 * CELL)
    assert np.linalg.norm(found.normal, axis=1) == pytest.approx(np.ones(len(off)))
    assert ((off * found.normal).sum(axis=1) > 0.0).all()  # they point away from it
    assert {0, 2, 4, 6} <= set(found.sector.tolist())
    for sector, way in ((0, (1, 0)), (2, (0, 1)), (4, (-1, 0)), (6, (0, -1))):
        assert (found.normal[found.sector == sector] @ way > 0.9).all()
    assert found.length.sum() == pytest.approx(2.0, rel=0.15)  # its outline


def test_heights_are_foot_middle_and_top(made, targets):
    found = targets(made.body("b", made.box(0.4, 0.4, 0.5), "2 0 0.25 0 0 0"))
    assert found.z == pytest.approx(np.tile((0.01, 0.25, 0.49), (len(found.z), 1)), abs=1e-3)
    board = targets(made.body("board", made.box(0.4, 0.4, 0.1), "2 0 0.25 0 0 0"))
    assert board.z == pytest.approx(np.tile((0.21, 0.25, 0.29), (len(board.z), 1)), abs=1e-3)


@pytest.mark.parametrize(("gap", "count"), [(0.0, 2), (0.1, 2), (0.3, 1)])
def test_bodies_nearer_than_the_gap_are_one(made, targets, gap, count):
    pair = [made.body(name, made.box(0.4, 0.4, 0.5), f"2 {y} 0.25 0 0 0") for name, y in (("a", 0.3), ("b", -0.3))]
    found = targets(*pair, gap=gap)  # 0.2 m apart
    assert len(found.names) == len(found.centers) == count
    assert sorted("+".join(found.names).split("+")) == ["a", "b"]
    assert set(found.obstacle.tolist()) == set(range(count))


def test_a_heap_is_named_by_three_of_its_models(made, targets):
    row = [made.body(f"m{k}", made.box(0.3, 0.3, 0.5), f"2 {0.3 * k} 0.25 0 0 0") for k in range(6)]
    (name,) = targets(*row).names
    assert name.endswith("+3 more") and name.count("+") == 3


def test_nobody_looks_into_a_chink(made, targets):
    # Two boxes 6 cm apart: the sides that face each other have no free room before them.
    pair = [made.body(name, made.box(0.4, 0.6, 0.5), f"2 {y} 0.25 0 0 0") for name, y in (("a", 0.33), ("b", -0.33))]
    found = targets(*pair, gap=0.0)
    in_it = (np.abs(found.xy[:, 1]) < 0.06) & (np.abs(found.xy[:, 0] - 2.0) < 0.12)
    assert not in_it.any()
    assert len(found.names) == 2


def test_an_empty_floor_has_none(targets):
    found = targets()
    assert found.names == ()
    assert len(found.xy) == len(found.z) == len(found.sector) == len(found.length) == 0
