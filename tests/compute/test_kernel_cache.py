"""Kernels between processes, in a small package of the same build: new sources are never run by old code."""

import fcntl
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from flysim.compute.kernel_cache import PACKAGE, kernel_sources

OUTER = """
from flysim.compute.compiled import compiled
from flysim.flies import helper
from flysim.flies.step import (
    STEP,
)

@compiled
def walked(x):
    return helper.doubled(x) + STEP
"""
HELPER = "from flysim.compute.compiled import compiled\n\n@compiled\ndef doubled(x):\n    return 2 * x\n"
ASK = """
from flysim.compute import kernel_cache
from flysim.flies.outer import walked
print(walked(10), sum(walked.stats.cache_hits.values()), kernel_cache.folder())
"""


@pytest.fixture
def package(tmp_path):
    root = tmp_path / "flysim"
    shutil.copytree(PACKAGE / "compute", root / "compute", ignore=shutil.ignore_patterns("__pycache__"))
    (root / "__init__.py").touch()
    (root / "flies").mkdir()
    for name, text in {
        "__init__": "",
        "outer": OUTER,
        "helper": HELPER,
        "step": "STEP = 1\n",
        "other": "X = 1\n",
    }.items():
        (root / "flies" / f"{name}.py").write_text(text, encoding="utf-8")
    return root


def started(package, **environment):
    kept = {key: value for key, value in os.environ.items() if not key.startswith(("NUMBA_", "XDG_"))}
    # Its sources change faster than a file's time ticks, which Python's own cache goes by.
    given = {**kept, "PYTHONPATH": str(package.parent), "PYTHONDONTWRITEBYTECODE": "1", **environment}
    return subprocess.Popen(
        [sys.executable, "-c", ASK], cwd=package.parent, env=given, stdout=subprocess.PIPE, text=True
    )


def asked(package, **environment):
    """(what the kernel says, whether its code came from the cache, the folder of kernels)"""
    with started(package, **environment) as process:
        value, hits, folder = process.communicate(timeout=60)[0].split()
    assert process.returncode == 0
    return int(value), int(hits) > 0, Path(folder)


def test_it_is_compiled_once(package):
    value, cached, folder = asked(package)
    assert (value, cached, folder.parent) == (21, False, package / "__pycache__")
    assert asked(package) == (21, True, folder)


def test_a_change_of_any_source_is_seen_and_the_old_code_goes(package):
    *_, before = asked(package)
    changes = (
        ("helper", "2 * x", "3 * x", 31),
        ("step", "STEP = 1", "STEP = 2", 32),
        ("outer", "+ STEP", "- STEP", 28),
    )
    for file, old, new, value in changes:
        path = package / "flies" / f"{file}.py"
        path.write_text(path.read_text(encoding="utf-8").replace(old, new), encoding="utf-8")
        told, cached, after = asked(package)
        assert (told, cached) == (value, False)
        assert list((package / "__pycache__").iterdir()) == [after] != [before]
        before = after


def test_what_no_kernel_is_made_of_does_not_count(package):
    *_, folder = asked(package)
    (package / "flies" / "other.py").write_text("X = 2\n", encoding="utf-8")
    assert asked(package) == (21, True, folder)


def test_all_kernels_of_flysim_are_known_and_what_they_import():
    found = set(kernel_sources())
    assert {
        "flysim.flies.operators",
        "flysim.obstacles.reach",
        "flysim.worlds.surface.noise",
        "flysim.geometry.rig",
    } <= found
    assert not {"flysim.cli.app", "flysim.runs.run", "flysim.sim.simulation"} & found


def test_a_package_that_cannot_be_written_is_compiled_into_the_users_cache_or_the_temporary_folder(package, tmp_path):
    (package / "__pycache__").touch()  # root may write everywhere, but not into a file
    value, _, folder = asked(package, XDG_CACHE_HOME=str(tmp_path / "cache"))
    assert (value, folder.parent) == (21, tmp_path / "cache" / "flysim")
    nowhere = {"HOME": "/dev/null", "TMPDIR": str(tmp_path)}
    value, _, folder = asked(package, **nowhere)
    assert (value, folder.parent) == (21, tmp_path / f"flysim-kernels-{os.geteuid()}")
    assert asked(package, **nowhere)[1]
    folder.parent.chmod(0o777)  # somebody else may have put code there
    assert asked(package, **nowhere) == (21, False, package / "__pycache__" / folder.name)  # and without any it works


def test_what_was_compiled_before_the_package_became_read_only_is_used(package, tmp_path):
    *_, shipped = asked(package)
    _, cached, folder = asked(package, NUMBA_CACHE_DIR=str(tmp_path / "mine"))
    assert (cached, folder.parent) == (True, tmp_path / "mine")
    assert not list(folder.iterdir())
    assert list(shipped.iterdir())


def test_a_damaged_cache_is_compiled_anew(package):
    *_, folder = asked(package)
    for path in folder.iterdir():
        path.write_bytes(path.read_bytes()[:40] if path.suffix == ".nbc" else b"nonsense")
    assert asked(package)[:2] == (21, False)
    assert asked(package)[:2] == (21, True)


def test_two_processes_do_not_number_their_files_at_the_same_time(package):
    *_, folder = asked(package)
    for path in folder.iterdir():
        path.unlink()
    lock = os.open(folder, os.O_RDONLY)
    fcntl.flock(lock, fcntl.LOCK_EX)
    with started(package) as process:
        until = time.monotonic() + 2.5
        while time.monotonic() < until and process.poll() is None:
            assert not list(folder.glob("*.nbi"))
            time.sleep(0.05)
        assert process.poll() is None  # it waits
        os.close(lock)
        assert process.communicate(timeout=60)[0].startswith("21 ")
    assert list(folder.glob("*.nbi"))
