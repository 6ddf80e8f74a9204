"""Worlds that a package or a module gives by name."""

import sys
from types import ModuleType

import pytest

from flysim.common.catalogue import find_world, world_names
from flysim.errors import WorldError


@pytest.fixture
def mine(monkeypatch):
    module = ModuleType("mine")
    monkeypatch.setitem(sys.modules, "mine", module)
    return module


def test_a_path_or_a_function_that_gives_it(mine, tmp_path):
    file = tmp_path / "a.sdf"
    file.touch()
    mine.path, mine.text, mine.made = file, str(file), lambda: file
    for name in ("mine:path", "mine:text", "mine:made"):
        assert find_world(name) == file


def test_what_is_no_world_is_told_in_a_line(mine, tmp_path):
    def broken():
        raise RuntimeError("no disk")

    mine.number, mine.gone, mine.broken = 3, tmp_path / "gone.sdf", broken
    for name, said in (
        ("mine:number", "must be, or give, the path of an SDF file; got '3'"),
        ("mine:gone", "the path of an SDF file; got "),
        ("mine:broken", "it cannot be made: RuntimeError: no disk"),
        ("mine:nothing", "no 'nothing' in mine"),
        ("no_such_module_:x", "no module 'no_such_module_'"),
    ):
        with pytest.raises(WorldError, match=said):
            find_world(name)


def test_a_file_of_such_a_name_is_the_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "odd:name.sdf").touch()
    assert find_world("odd:name.sdf").name == "odd:name.sdf"
    assert world_names()[:3] == ["corridor", "paper", "yard"]
