"""Names are found where they should be: built in, in an installed package, in a file beside the user."""

import sys

import pytest

from flysim.common import registry
from flysim.common.registry import Registry
from flysim.errors import EngineError

BUILTIN = {"root": "math:sqrt", "join": "os:path.join"}


@pytest.fixture
def made():
    return Registry("engine", "flysim.nobody", BUILTIN, EngineError)


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder to stand in, whose modules are forgotten afterwards."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [path for path in sys.path if path])
    before = set(sys.modules)
    yield tmp_path
    for name in set(sys.modules) - before:
        del sys.modules[name]


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """A package in a folder on the path, with the metadata that an installer writes."""

    def install(name, version, points):
        folder = tmp_path / "site"
        info = folder / f"{name}-{version}.dist-info"
        info.mkdir(parents=True)
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
        (info / "entry_points.txt").write_text(points)
        monkeypatch.syspath_prepend(folder)
        registry._installed.cache_clear()
        return folder

    yield install
    registry._installed.cache_clear()


def test_what_is_built_in_is_found_by_its_name(made):
    assert made.load("root")(9.0) == 3.0
    assert made.load("join")("a", "b") == "a/b"
    assert made.names == made.builtin == ("root", "join")
    assert [entry.origin for entry in made.entries()] == ["flysim", "flysim"]


def test_nothing_is_imported_before_it_is_asked_for(here):
    (here / "costly_module.py").write_text("raise SystemError('imported')\n")
    lazy = Registry("engine", "flysim.nobody", {"costly": "costly_module:see"}, EngineError)
    assert lazy.check("costly") == "costly"
    assert lazy.names == ("costly",)
    assert "costly_module" not in sys.modules


def test_a_typo_is_told_the_nearest_name(made):
    with pytest.raises(EngineError, match=r"^no engine 'rooot'\. Did you mean 'root'\?$"):
        made.load("rooot")
    with pytest.raises(EngineError, match="Did you mean"):
        made.check("joim")


def test_a_file_beside_the_user_is_found_as_it_is_typed(made, here):
    (here / "mine_beside.py").write_text("class Inner:\n    value = 7\n")
    assert made.check("mine_beside:Inner.value") == "mine_beside:Inner.value"
    assert made.load("mine_beside:Inner.value") == 7


@pytest.mark.parametrize(
    ("typed", "said"),
    [
        ("nowhere_at_all:see", r"^engine 'nowhere_at_all:see': no module 'nowhere_at_all'\. Install it, or start"),
        ("math:sqrtt", r"^engine 'math:sqrtt': no 'sqrtt' in math\. Did you mean 'sqrt'\?$"),
        ("math:", r"write module:object"),
        ("a b:c", r"write module:object"),
        ("broken_beside:see", r"broken_beside cannot be imported: ZeroDivisionError: division by zero\.$"),
        ("wanting_beside:see", r"cannot be imported: ModuleNotFoundError: No module named 'absent_library'"),
    ],
)
def test_what_cannot_be_loaded_is_one_line(made, here, typed, said):
    (here / "broken_beside.py").write_text("1 / 0\n")
    (here / "wanting_beside.py").write_text("import absent_library\n")
    with pytest.raises(EngineError, match=said):
        made.load(typed)


def test_an_installed_package_adds_names(installed):
    folder = installed("sees-more", "2.1", "[flysim.nobody]\nmine = sees_more:see\nroot = sees_more:other\n")
    (folder / "sees_more.py").write_text("def see():\n    return 'seen'\n")
    known = Registry("engine", "flysim.nobody", BUILTIN, EngineError)
    assert known.names == ("root", "join", "mine")
    assert known.load("mine")() == "seen"
    assert known.load("root")(4.0) == 2.0  # nobody takes a name of flysim's own
    assert [entry.origin for entry in known.entries()][-1] == "sees-more 2.1"
    with pytest.raises(EngineError, match="Did you mean 'mine'"):
        known.check("mines")
