"""The figures of README and docs are those of the code that is here, and tools/readme.py renews them."""

import importlib.util
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

ROOT = Path(__file__).resolve().parents[2]


def load(name):
    spec = importlib.util.spec_from_file_location(name, ROOT / f"tools/{name}.py")
    assert spec is not None and spec.loader is not None
    sys.modules[name] = module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


figures = load("figures")
readme = load("readme")
FIGURES = figures.FIGURES


@pytest.fixture(scope="module")
def why():
    return dict(readme.stale())


@pytest.mark.parametrize("name", FIGURES)
def test_no_figure_is_stale(why, name):
    assert name not in why, f"figure '{name}' of README and docs: {why[name]}. Renew it: make readme FIGURES={name}"


@pytest.mark.parametrize("name", [name for name, figure in FIGURES.items() if figure.cheap])
def test_a_fresh_run_says_what_the_texts_say(name, tmp_path):
    said = readme.regions()
    for region, fresh in readme.texts_of(FIGURES[name], tmp_path).items():
        for text in said[region]:
            assert readme.alike(fresh, text), f"region {region}: make readme FIGURES={name}"


def test_every_region_and_every_picture_has_its_figure():
    owners = [region for figure in FIGURES.values() for region in figure.regions]
    assert len(owners) == len(set(owners))
    assert set(readme.regions()) == set(owners)
    shown = set()
    for page in readme.pages():
        text = page.read_text(encoding="utf-8")
        assert text.count("<!-- flysim:") == text.count("<!-- /flysim -->") == len(readme.REGION.findall(text)), page
        shown |= {
            (page.parent / link).relative_to(ROOT).as_posix() for link in re.findall(r"!\[[^]]*\]\(([^)]+)\)", text)
        }
    assert shown == {picture for figure in FIGURES.values() for picture in figure.pictures}


@pytest.fixture
def page(tmp_path, monkeypatch):
    """A root with one text, one source, and one figure that was just drawn."""
    (tmp_path / "docs").mkdir()
    (tmp_path / "engine.py").write_text('"""Engine."""\nX = 1  # one\n')
    text = "It takes <!-- flysim:ms -->3<!-- /flysim --> ms.\n\n<!-- flysim:all -->\n\n| a |\n\n<!-- /flysim -->\n"
    (tmp_path / "README.md").write_text(text)
    figure = figures.Figure(commands=("flysim list",), regions=("ms", "all"), sources=("*.py",))
    monkeypatch.setattr(readme, "FIGURES", {"it": figure})
    assert list(readme.stale(tmp_path)) == [("it", "it was never drawn")]
    readme.keep("it", root=tmp_path)
    return tmp_path


def test_what_was_drawn_is_stale_once_its_sources_change(page):
    assert not list(readme.stale(page))
    (page / "engine.py").write_text('"""The engine."""\nX = 1\n\n\n# another comment\n')
    assert not list(readme.stale(page))
    (page / "engine.py").write_text('"""Engine."""\nX = 2  # one\n')
    assert list(readme.stale(page)) == [("it", "what draws it has changed since")]


def test_what_was_changed_by_hand_is_stale(page):
    path = page / "README.md"
    path.write_text(path.read_text().replace("-->3<", "-->2<"))
    assert list(readme.stale(page)) == [("it", "what it says was changed by hand")]


def test_texts_are_put_where_they_stood(page):
    readme.put({"ms": "4", "all": "| b |"}, page)
    text = (page / "README.md").read_text()
    assert "takes <!-- flysim:ms -->4<!-- /flysim --> ms" in text
    assert "<!-- flysim:all -->\n\n| b |\n\n<!-- /flysim -->" in text
    assert readme.regions(page) == {"ms": {"4"}, "all": {"| b |"}}


@pytest.mark.parametrize(
    ("fresh", "said", "alike"),
    [
        ("1 of 1 | 0.2 / 0.2", "1 of 1 | 0.2 / 0.3", True),
        ("1 of 1 | 0.2 / 0.2", "1 of 1 | 0.2 / 0.4", False),
        ("1 of 1", "2 of 2", False),
        ("0.07", "0.08", True),
        ("0.2 cm", "0.2 m", False),
    ],
)
def test_decimals_may_round_otherwise_and_counts_may_not(fresh, said, alike):
    assert readme.alike(fresh, said) is alike


def test_pictures_have_few_colours_unless_shades_would_become_steps():
    fades = np.zeros((256, 256, 3), np.uint8)
    fades[..., 0], fades[..., 1] = np.arange(256), np.arange(256)[:, None]
    assert readme.small(Image.fromarray(fades)).mode == "RGB"
    chart = np.full((64, 64, 3), 255, np.uint8)
    chart[20:40, 20:40] = (200, 90, 10)
    few = readme.small(Image.fromarray(chart))
    assert few.mode == "P" and (np.asarray(few.convert("RGB")) == chart).all()
