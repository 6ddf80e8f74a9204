"""NUMBA_DISABLE_JIT=1 runs the very engine: what steps through a kernel, or tests one uncompiled, sees no other."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numba import njit

from flysim.compute import uncompiled, vectors

ROOT = Path(__file__).resolve().parents[2]


@njit
def compiled_row(left, right, at, base, x, step, n):
    return vectors.row(left, right, at, base, x, step, n)


@njit
def compiled_sobel(image, at, north, south, west, east):
    return vectors.sobel(image, at, north, south, west, east)


@njit
def compiled_slopes(left, right, at, base, wide, right_wide, u, ui, uj, half, stride):
    return vectors.slopes(left, right, at, base, wide, right_wide, u, ui, uj, half, stride)


@njit
def compiled_differences(left, right, at, start, wide, right_wide, side, n, found):
    vectors.differences(left, right, at, start, wide, right_wide, side, n, found)


@pytest.fixture
def images():
    """Addresses of two images of noise, 40 px wide."""
    both = np.random.default_rng(5).integers(0, 256, (2, 30 * 40 * 3), dtype=np.uint8)
    yield [np.uint64(image.ctypes.data) for image in both]
    assert both.any()  # they live until here


@pytest.mark.parametrize("n", [3, 4, 5, 7, 8, 9, 15])
@pytest.mark.parametrize("step", [65536, 52000, 80001])
def test_rows_are_summed_alike(images, n, step):
    arguments = (*images, 123, 47, 200_123, step, n)
    assert compiled_row(*arguments) == uncompiled.row(*arguments)


@pytest.mark.parametrize("beside", [(-120, 120, -3, 3), (0, 120, -3, 3), (-120, 0, -3, 3), (-120, 120, 0, 3)])
def test_slopes_of_pixels_are_summed_alike(images, beside):
    for at in (1200, 1203, 2001):
        assert compiled_sobel(images[0], at, *beside) == uncompiled.sobel(images[0], at, *beside)


@pytest.mark.parametrize("half", [1, 2, 3, 4, 7])
@pytest.mark.parametrize("stride", [1, 3])
@pytest.mark.parametrize(("ui", "uj"), [(1.0, 0.0), (0.8, -0.3), (1.22, 0.41)])
def test_slopes_of_windows_are_summed_alike(images, half, stride, ui, uj):
    arguments = (*images, 15 * 40 + 20, 15 * 38, 40, 38, 19.37, ui, uj, half, stride)
    assert compiled_slopes(*arguments) == uncompiled.slopes(*arguments)


@pytest.mark.parametrize("n", [1, 15, 16, 17, 30])
def test_curves_are_filled_alike(images, n):
    found = [np.zeros(n + vectors.COLUMNS, np.float32) for _ in range(2)]
    for fill, one in zip((compiled_differences, uncompiled.differences), found, strict=True):
        fill(*images, 50, 90, 40, 41, 5, n, one)
    assert found[0][:n].any() and (found[0][:n] == found[1][:n]).all()


def test_uncompiled_the_golden_swarms_are_the_same():
    pytest = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", "tests/flies/test_golden.py"]
    pytest += ["-k", "comes or space"]
    env = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    found = subprocess.run(pytest, cwd=ROOT, env=env, capture_output=True, text=True, timeout=120, check=False)
    assert found.returncode == 0, found.stdout
