"""The floor in cells, by hand: where a box stands, how far it is from there, and where there is no floor."""

import math

import numpy as np
import pytest

from flysim.paths.grid import CELL, ROUND, survey
from flysim.worlds.sdf.reader import read_world

HEIGHT = 0.4  # [m] of the robot


@pytest.fixture
def grid(made, tmp_path):
    def one(*models, height=HEIGHT, ground=True, **more):
        return survey(read_world(made.write(tmp_path / "w.sdf", *models, ground=ground)), height, **more)

    return one


def at(array, grid, *xy):
    i, j = grid.cells(np.array([xy]))[0]
    return array[i, j]


def test_clearance_is_the_distance_to_the_nearest_thing(made, grid):
    one = grid(made.body("b", made.box(0.4, 0.6, 0.5), "2 0 0.25 0 0 0"))
    # Beside its faces at x = 1.8 and y = 0.3, and off its corner (1.8, 0.3).
    for (x, y), expected in (((0.8, 0.0), 1.0), ((2.0, 1.3), 1.0), ((1.5, 0.7), 0.5)):
        assert one.clear_of(np.array([[x, y]]))[0] == pytest.approx(expected, abs=CELL)
    assert one.clear_of(np.array([[2.0, 0.0]]))[0] == 0.0


def test_outside_of_it_nothing_is_clear(made, grid):
    one = grid(made.body("b", made.box(0.4, 0.4, 0.5), "2 0 0.25 0 0 0"))
    assert one.clear_of(np.array([[-ROUND - 0.5, 0.0], [50.0, 0.0], [0.0, 9.0]])).tolist() == [0.0, 0.0, 0.0]


def test_points_and_cells_are_each_others_way_back(grid):
    one = grid()
    ij = np.array([[0, 0], [3, 5], [one.shape[0] - 1, one.shape[1] - 1]])
    np.testing.assert_array_equal(one.cells(one.points(ij)), ij)
    assert one.points(np.array([[3, 5]]))[0] == pytest.approx((one.origin[0] + 5 * CELL, one.origin[1] + 3 * CELL))
    np.testing.assert_allclose(one.points(one.cells(np.array([[0.0, 0.0]])))[0], 0.0, atol=1e-9)


def test_there_is_so_much_floor_round_all_that_stands(made, grid):
    model = made.body("b", made.box(0.4, 0.4, 0.5), "2 -1 0.25 0 0 0")
    for around in (ROUND, 1.0):
        one = grid(model, around=around)
        (x0, y0), (x1, y1) = one.origin, one.points(np.array([one.shape]))[0]
        assert (x0, y0) == pytest.approx((-around, -1.2 - around), abs=3 * CELL)
        assert (x1, y1) == pytest.approx((2.2 + around, around), abs=3 * CELL)


def test_what_is_above_the_robot_or_flat_on_the_floor_does_not_block(made, grid):
    board = made.body("board", made.box(0.6, 0.6, 0.1), "2 0 0.6 0 0 0")
    sheet = made.body("sheet", made.box(0.6, 0.6, 0.01), "-1 0 0.005 0 0 0")
    low = grid(board, sheet)
    assert at(low.clearance, low, 2.0, 0.0) > 1.0 and at(low.clearance, low, -1.0, 0.0) > 1.0
    tall = grid(board, sheet, height=0.7)
    assert at(tall.clearance, tall, 2.0, 0.0) == 0.0
    # It is something to look at all the same, at its own height.
    assert at(low.obstacle, low, 2.0, 0.0) >= 0
    assert at(low.top, low, 2.0, 0.0) == pytest.approx(0.65)
    assert at(low.bottom, low, 2.0, 0.0) == pytest.approx(0.55)
    assert at(low.obstacle, low, -1.0, 0.0) == -1


def test_each_link_is_found_where_it_stands(made, grid):
    one = grid(
        made.body("a", made.box(0.4, 0.4, 0.5), "2 0 0.25 0 0 0"),
        made.body("b", "<sphere><radius>0.2</radius></sphere>", "0 2 0.2 0 0 0"),
    )
    first, second = at(one.obstacle, one, 2.0, 0.0), at(one.obstacle, one, 0.0, 2.0)
    assert first != second and min(first, second) >= 0
    assert set(one.of_link) == {first, second}
    assert all(one.obstacle[cell] == link for link, cell in one.of_link.items())
    area = [(one.obstacle == link).sum() * CELL**2 for link in (first, second)]
    # A cell counts when it is touched: half a cell more on each side.
    assert area == pytest.approx([0.4**2, math.pi * 0.2**2], rel=0.2)


def test_a_floor_of_boxes_ends_where_they_end(made, grid):
    one = grid(made.body("floor", made.box(4.0, 2.0, 0.1), "1 0 -0.05 0 0 0"), ground=False)
    assert at(one.clearance, one, 1.0, 0.0) == pytest.approx(1.0, abs=2 * CELL)
    assert at(one.clearance, one, 1.0, 1.2) == 0.0
    sunk = grid(made.body("floor", made.box(4.0, 2.0, 0.1), "1 0 -0.3 0 0 0"), ground=False)
    assert (sunk.clearance == 0.0).all()  # 25 cm below


def test_behind_a_wall_without_end_nobody_stands(made, grid):
    plane = (
        '<model name="wall"><static>1</static><pose>3 0 0 0 0 0</pose><link name="l"><collision name="c"><geometry>'
        "<plane><normal>-1 0 0</normal><size>1 1</size></plane></geometry></collision></link></model>"
    )
    one = grid(plane, made.body("b", made.box(0.4, 0.4, 0.5), "2 0 0.25 0 0 0"))
    assert at(one.clearance, one, 3.3, 1.5) == 0.0
    assert at(one.clearance, one, 2.4, 1.5) == pytest.approx(0.6, abs=2 * CELL)
