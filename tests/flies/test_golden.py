"""Stored pairs and seeds, exact: a change of a single draw, rule or rounding shows here first.

If it fails after a change that means to alter what evolves, and every other test passes, write the new figures with
`GOLDEN=write python -m pytest tests/flies/test_golden.py` and say in the commit why they moved. If the change was meant
to alter nothing, it did.
"""

import json
import os
from pathlib import Path

import numpy as np
import pytest
from numba import config

from flysim.flies.compared import compare
from flysim.flies.evolution import _Evolution, evolve
from flysim.flies.parameters import FlyParams
from flysim.geometry.camera import Camera
from flysim.geometry.frames import pose6
from flysim.geometry.rig import ImagePair, StereoRig

STORED = Path(__file__).parent / "golden"
CAMERA = Camera(width=96, height=64, fx=100.0, fy=100.0, cx=47.5, cy=31.5)
LEVEL = StereoRig.parallel(CAMERA, 0.12)
TURNED = StereoRig(left=CAMERA, right=CAMERA, T_right_left=pose6(-0.12, 0.004, -0.01, 0.01, -0.01, 0.02))
DEPTHS = {"min_depth": 0.8, "max_depth": 4.0}
# Between them every branch of breeding, measuring and selecting is gone.
BRED = {
    "as it comes": (LEVEL, {"polish": 2}),
    "turned": (TURNED, {"operators": "A", "sharing_strength": 2.0, "fitness": "louchet", "crossover": "interpolate"}),
    "in space": (
        LEVEL,
        {"mutation": "metric", "mutation_m": 0.1, "tails": "heavy", "parents": "tournament", "window": 5, "slant": 0.0},
    ),
    "alike in shape": (LEVEL, {"fitness": "zncc", "operators": "B", "regions": (1, 2), "sharing_cell": 12}),
    "printed": (TURNED, {"fitness": "paper", "operators": "A", "regions": 1, "sharing_strength": 0.0, "polish": 3}),
    "product": (TURNED, {"fitness": "product", "regions": 2, "tails": "heavy", "window": 3}),
}
CHECKED = {
    "as it comes": (LEVEL, {"slant": 1.0}),
    "there and back": (LEVEL, {"left_right": 0.75, "uniqueness": 1.6}),
    "turned there and back": (TURNED, {"left_right": 1.0, "misfit": 0.2}),
    "facing": (TURNED, {"slant": 0.0, "misfit": 0.15, "uniqueness": 2.0}),
}


def golden_pair(rig=LEVEL):
    """Noise of whole grey levels, smoothed and shifted by whole pixels: integer arithmetic, the same everywhere.

    On the left half it is 6 px nearer, on the right half 9 px; the last rows differ by more than noise.
    """
    rng = np.random.default_rng(2024)
    noise = rng.integers(0, 256, (64, 120, 3)).astype(np.int64)
    smooth = sum(np.roll(noise, (dv, du), (0, 1)) for dv in (-1, 0, 1) for du in (-1, 0, 1)) // 9
    left, right = smooth[:, 10:106], smooth[:, 16:112].copy()
    right[:, 50:] = smooth[:, 69:115]
    right[48:] += rng.integers(-12, 13, right[48:].shape)
    return ImagePair(left=left.astype(np.uint8), right=right.clip(0, 255).astype(np.uint8), rig=rig)


def bred(rig, change):
    """The flies of a third generation, slot by slot, and what is told of each generation."""
    params = FlyParams(**{"population": 100, "settled_fitness": 0.3, "prefilter": "none", **DEPTHS, **change})
    evolution = _Evolution(golden_pair(rig), compare(golden_pair(rig), params), params, np.uint64(7))
    history = [evolution.step(number) for number in range(3)]
    flies = evolution.flies
    return {
        "flies": np.stack([flies[name] for name in flies.dtype.names], axis=1),
        "history": np.array([(g.best, g.mean, g.settled, *g.regions) for g in history]),
        "kept": np.array([evolution.regions[name] for name in ("kept", "needed", "best", "total", "settled")]),
    }


def checked(rig, change):
    """The swarm that is left of 150 flies after the tests at the end."""
    params = FlyParams(
        **{"population": 150, "settled_fitness": 0.2, "max_iterations": 2, "prefilter": "none", **DEPTHS, **change}
    )
    swarm = evolve(golden_pair(rig), params, rng=np.random.default_rng(3))
    return {
        "where": np.concatenate([swarm.uv, swarm.uv_right, swarm.points, swarm.spread], axis=1),
        "how": np.concatenate([swarm.normals, swarm.fitness[:, None]], axis=1),
        "of": np.stack([swarm.region, swarm.age], axis=1),
    }


def held(name, found):
    path = STORED / f"{name.replace(' ', '_')}.json"
    if os.environ.get("GOLDEN") == "write":
        rows = {key: [[float(f"{x:.7g}") for x in row] for row in value.tolist()] for key, value in found.items()}
        text = ",\n".join(f'"{key}": [\n' + ",\n".join(map(json.dumps, value)) + "\n]" for key, value in rows.items())
        path.write_text("{" + text + "}\n", encoding="utf-8")
    stored = json.loads(path.read_text(encoding="utf-8"))
    for key, value in found.items():
        # What is summed in another order, or by another library's logarithm, may differ in the last digits.
        np.testing.assert_allclose(value, np.array(stored[key]), rtol=2e-4, atol=1e-6, err_msg=f"{name}: {key}")


@pytest.mark.parametrize("name", BRED)
def test_the_third_generation_of_one_pair_and_seed_is_this(name):
    held(f"bred {name}", bred(*BRED[name]))


@pytest.mark.parametrize("name", CHECKED)
def test_the_swarm_of_one_pair_and_seed_is_this(name):
    held(f"checked {name}", checked(*CHECKED[name]))


@pytest.mark.skipif(bool(config.DISABLE_JIT), reason="3000 flies take a minute uncompiled")
def test_what_the_defaults_evolve_is_this():
    """Whoever changes a default changes everybody's swarms: these figures ask whether it was meant."""
    swarm = evolve(golden_pair(), FlyParams(), rng=np.random.default_rng(4))
    held(
        "defaults",
        {
            "flies": np.concatenate([swarm.uv, swarm.points], axis=1)[::20],
            "counts": np.array([[len(swarm.points), swarm.iterations, swarm.evaluations]]),
            "history": np.array([(g.best, g.mean, g.settled, *g.regions) for g in swarm.history]),
        },
    )
