"""One process that reads damaged inputs: `reading.py FOLDER JOBS`. It says a line before each of them and one after.

What loads is also built in the simulator and drawn. Whatever is neither sound nor refused in one line is a fault.
"""

from __future__ import annotations

import json
import os
import resource
import sys
import time
import traceback
from collections.abc import Callable
from contextlib import ExitStack, suppress
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import seed as seeded
from mutate import Edit, edited, edits, flipped, rechecked
from seeds import FILES

from flysim.errors import FlysimError
from flysim.geometry.camera import Camera
from flysim.geometry.frames import Pose2
from flysim.render.choose import gl_works, open_renderer
from flysim.robots.robot import read_robot
from flysim.sim.simulation import Simulation
from flysim.worlds.sdf.reader import read_world

LONGEST_LINE = 300  # [characters]
MOST_MEMORY = 500 * 2**20  # [bytes] more than before
DRAWN = Camera.from_fov(64, 48, 1.2)


def build(world: Path, robot: Path) -> None:
    """Reads, builds, steps and draws."""
    stands, drives = read_world(world), read_robot(robot)
    with ExitStack() as stack:
        simulation = stack.enter_context(Simulation(stands, drives, Pose2(0.0, 0.0, 0.0), textured=not GL))
        for _ in range(24):
            simulation.step(0.2, 0.1)
        eyes = open_renderer("gl" if GL else "tiny", simulation)
        stack.callback(eyes.close)
        eyes.view(DRAWN, simulation.T_world_base() @ drives.T_base_left)


def scenario(folder: Path) -> None:
    """Reads a scenario and whatever it names."""
    from flysim.runs.run import check
    from flysim.runs.scenario import read_scenario

    check(read_scenario(str(folder / FILES["toml"])))


def pair(folder: Path) -> None:
    """Reads two photographs with their calibration."""
    import flysim as fs

    fs.read_pair(folder / "left.png", folder / "right.png", calib=folder / FILES["calibration"])


def policy(folder: Path) -> None:
    """Reads a policy and asks it once."""
    from flysim.nav.agents.policy import FEATURES, load_policy

    load_policy(folder / FILES["policy"])(np.zeros(FEATURES, np.float32))


def report(folder: Path) -> None:
    """What `flysim show` and `flysim show --json` print."""
    from typer.testing import CliRunner

    from flysim.cli.app import app

    for more in ([], ["--json"]):
        done = CliRunner().invoke(app, ["show", str(folder / "run"), *more])
        if done.exit_code == 2:
            raise FlysimError(done.stderr.strip())
        if done.exit_code:
            raise done.exception or AssertionError(done.output)
        if not more and not all(c.isprintable() or c == "\n" for c in done.stdout):
            raise AssertionError("what is not printable reaches the terminal")


def baseline(folder: Path) -> None:
    """Reads a baseline."""
    from flysim.studies.regress.baseline import read_baseline

    read_baseline(folder / FILES["baseline"])


def barn(folder: Path) -> None:
    """Reads the path of a BARN world."""
    from flysim.nav.worlds import barn_worlds

    barn_worlds(folder)


def world(folder: Path) -> None:
    """Builds and draws the world with the robot in it."""
    build(folder / FILES["sdf"], folder / FILES["urdf"])


READ: dict[str, Callable[[Path], None]] = {
    **dict.fromkeys(("sdf", "model", "urdf", "obj", "stl", "texture"), world),
    **dict.fromkeys(("calibration", "png"), pair),
    **{"toml": scenario, "policy": policy, "report": report, "baseline": baseline, "barn": barn},
}


def outcome(kind: str, folder: Path) -> tuple[str, str]:
    """("read" or "refused" or "fault", what was said)"""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    try:
        READ[kind](folder)
        said = "read", ""
    except FlysimError as error:
        text = str(error)
        named = Path(FILES[kind]).name in text or Path(FILES[kind]).parent.name in text
        clear = len(text) <= LONGEST_LINE and text.isprintable() and named
        said = ("refused" if clear else "fault"), text
    except MemoryError:
        said = "fault", "MemoryError"
    except Exception:
        said = "fault", traceback.format_exc()
    if (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024 > MOST_MEMORY:
        said = "fault", f"more than {MOST_MEMORY >> 20} MB; {said}"
    return said


def tell(**what: object) -> None:
    """One line to whoever started this process."""
    ANSWERS.write(json.dumps(what) + "\n")
    ANSWERS.flush()


def main(folder: Path, jobs: list[list[Any]]) -> None:
    """Damages files again and again, and reads them; a job is (kind, how, seed, count)."""
    for number, (kind, how, seed, count) in enumerate(jobs):
        path = folder / FILES[kind]
        sound = path.read_bytes()
        try:
            for_each(kind, how, seed, count, sound, partial(one, folder, kind, number))
        finally:
            with suppress(OSError):
                path.write_bytes(sound)


def one(folder: Path, kind: str, number: int, data: bytes) -> None:
    """Reads one damaged file."""
    (folder / FILES[kind]).write_bytes(data)
    tell(began=number)
    mark = time.process_time()
    word, text = outcome(kind, folder)
    tell(ended=word, text=text[-2000:], seconds=time.process_time() - mark)


def for_each(kind: str, how: str, seed: int, count: int, sound: bytes, act: Callable[[bytes], None]) -> None:
    """Calls `act` with so many damaged forms of a sound file, or with itself."""
    if how == "sound":
        act(sound)
    elif how == "flips":
        rng = np.random.default_rng(seed)
        for k in range(count):
            data = flipped(sound, rng)
            act(rechecked(data) if k % 2 and kind in ("png", "texture") else data)
    else:
        text, quiet = sound.decode(), [*HealthCheck]

        @seeded(seed)
        @settings(max_examples=count, database=None, deadline=None, suppress_health_check=quiet)
        @given(edits)
        def words(changes: list[Edit]) -> None:
            act(edited(text, changes))

        words()


if __name__ == "__main__":
    ANSWERS = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what a library prints does not get between the answers
    GL = gl_works()
    main(Path(sys.argv[1]), json.loads(sys.argv[2]))
