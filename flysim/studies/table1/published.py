"""What the paper published: the 48 cells of its Table 1."""

from __future__ import annotations

from typing import NamedTuple

from flysim.studies.table1.grid import Cell


class Published(NamedTuple):
    """A cell of the paper's Table 1: generations until the stop criterion, and milliseconds."""

    iterations: int
    ms: int


# The paper's rows: population, stop criterion [%]; iterations with 2 and 4 regions; milliseconds with 2 and 4 regions.
_ROWS: dict[str, tuple[tuple[int, int, int, int, int, int], ...]] = {
    "A": (
        (500, 90, 37, 26, 1096, 787),
        (500, 95, 37, 30, 1096, 906),
        (1500, 90, 26, 21, 1674, 1368),
        (1500, 95, 26, 22, 1693, 1449),
        (3000, 90, 25, 20, 2896, 2294),
        (3000, 95, 26, 22, 2996, 2490),
        (5000, 90, 27, 23, 4743, 4180),
        (5000, 95, 27, 24, 4783, 4409),
    ),
    "B": (
        (500, 90, 27, 25, 813, 768),
        (500, 95, 28, 28, 818, 834),
        (1500, 90, 22, 19, 1427, 1259),
        (1500, 95, 23, 22, 1455, 1412),
        (3000, 90, 22, 20, 2584, 2309),
        (3000, 95, 23, 22, 2674, 2566),
        (5000, 90, 26, 24, 4796, 4262),
        (5000, 95, 27, 25, 4868, 4578),
    ),
    "C": (
        (500, 90, 21, 21, 653, 665),
        (500, 95, 23, 23, 709, 696),
        (1500, 90, 19, 18, 1231, 1193),
        (1500, 95, 20, 19, 1293, 1249),
        (3000, 90, 21, 19, 2424, 2124),
        (3000, 95, 21, 20, 2437, 2336),
        (5000, 90, 21, 21, 3793, 3818),
        (5000, 95, 22, 22, 4048, 3827),
    ),
}

PUBLISHED: dict[Cell, Published] = {
    Cell(operators, population, regions, stop): Published(iterations, ms)
    for operators, rows in _ROWS.items()
    for population, stop, iterations_2, iterations_4, ms_2, ms_4 in rows
    for regions, iterations, ms in ((2, iterations_2, ms_2), (4, iterations_4, ms_4))
}
