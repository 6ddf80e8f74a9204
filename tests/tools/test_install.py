"""What tools/install.py says before it fetches anything."""

import importlib.util
import sys
import types
from pathlib import Path

import pytest

spec = importlib.util.spec_from_file_location("install", Path(__file__).resolve().parents[2] / "tools/install.py")
assert spec is not None and spec.loader is not None
install = importlib.util.module_from_spec(spec)
spec.loader.exec_module(install)


@pytest.fixture
def machine(monkeypatch):
    """Sets Python's version, system and processor, and whether there is a compiler; fails on any fetching."""

    def set_up(version, system="linux", processor="x86_64", compiler=None):
        monkeypatch.setattr(install, "sys", types.SimpleNamespace(version_info=version, platform=system, exit=sys.exit))
        monkeypatch.setattr(install.platform, "machine", lambda: processor)
        monkeypatch.setattr(install.shutil, "which", lambda name: compiler if name == "g++" else None)
        monkeypatch.delenv("CC", raising=False)
        monkeypatch.delenv("CXX", raising=False)

    def fetched(*_):
        raise LookupError("it goes on to fetch")

    monkeypatch.setattr(install, "works", fetched)
    return set_up


@pytest.mark.parametrize(
    ("version", "others"),
    [
        ((3, 14, 0), {}),
        ((3, 11, 7), {"processor": "aarch64"}),
        ((3, 12, 0), {"system": "darwin", "processor": "arm64"}),
    ],
)
def test_without_wheel_and_compiler_it_says_so_in_one_line(machine, version, others):
    machine(version, **others)
    with pytest.raises(
        SystemExit, match=r"pybullet has no wheel for Python .* no C\+\+ compiler: make PYTHON="
    ) as said:
        install.install()
    assert "\n" not in str(said.value)
    machine(version, **others, compiler="/usr/bin/g++")
    with pytest.raises(LookupError):
        install.install()


@pytest.mark.parametrize("minor", [11, 12, 13])
def test_with_a_wheel_no_compiler_is_asked_for(machine, minor):
    machine((3, minor, 0))
    with pytest.raises(LookupError):
        install.install()
