"""The published figures against the paper's own text, where that is at hand."""

import re
from itertools import product
from pathlib import Path

import pytest

from flysim.flies.parameters import OPERATOR_SETS, FlyParams
from flysim.studies.table1.grid import FAVOURITES, GRID, POPULATIONS, REGIONS, SETS, STOPS, Cell
from flysim.studies.table1.published import PUBLISHED, Published

PAPER = Path(__file__).resolve().parents[3] / "shared" / "paper.md"


def in_the_paper():
    """{cell: published} as the paper's Table 1 prints it."""
    found, operators, population = {}, None, None
    text = PAPER.read_text(encoding="utf-8").split("**Table 1.**", 1)[1].split("####", 1)[0]
    for line in text.splitlines():
        operators = heading[1] if (heading := re.search(r"Set ([ABC])", line)) else operators
        fields = [field.strip() for field in line.strip("| \n").split("|")]
        row = re.fullmatch(r"\| *(\d*) *\| *(\d+) % *\|(.*)\|", line.strip())
        if row is None:
            continue
        population = int(row[1]) if row[1] else population  # the second row of a pair leaves it blank
        assert len(fields) >= 5
        two, four, ms_two, ms_four = (int(field) for field in row[3].split("|"))
        found[Cell(operators, population, 2, int(row[2]))] = Published(two, ms_two)
        found[Cell(operators, population, 4, int(row[2]))] = Published(four, ms_four)
    return found


def test_the_48_cells_are_the_papers():
    if not PAPER.is_file():
        pytest.skip(f"{PAPER} is not here: the published figures are not compared with the paper's text")
    assert in_the_paper() == PUBLISHED


def test_the_grid_is_whole_and_each_cell_was_published_once():
    assert len(GRID) == len(set(GRID)) == 48
    assert set(GRID) == set(PUBLISHED) == {Cell(*cell) for cell in product(SETS, POPULATIONS, REGIONS, STOPS)}
    assert set(SETS) == set(OPERATOR_SETS)
    assert set(FAVOURITES) == {Cell("C", 3000, 4, 90), Cell("C", 3000, 4, 95)}


def test_the_figure_the_paper_is_known_by():
    assert PUBLISHED[Cell("C", 3000, 4, 90)] == (19, 2124)
    assert PUBLISHED[Cell("A", 5000, 2, 95)] == (27, 4783)


def test_a_cells_parameters_change_what_the_grid_varies_alone():
    base = FlyParams(population=77, max_iterations=3, window=9)
    params = Cell("B", 1500, 2, 95).params(base)
    assert params == FlyParams(population=1500, operators="B", regions=2, stop=0.95, max_iterations=3, window=9)
