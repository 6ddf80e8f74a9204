"""Every command and snippet of README and docs, literally, in an empty folder; `make accuracy` runs the slow ones."""

import re

import pytest
import reader

# Seconds each: they run with every `make test`.
QUICK = {
    "flysim list",
    "flysim preview yard --out yard.png",
    "flysim world random --seed 7 --difficulty hard",
    'python -c "import flysim.nav.env as e; help(e.FlyNavEnv)"',
}
# What a command needs of those before it on its page, so short as it may be.
SHORT = "flysim run paper_c --set flies.population=300 --set flies.max_iterations=4"
EXPORTED = "flysim export paper_a --set 'stops=[{x = 0.9, y = 0}]' --format"
BEFORE = {
    "flysim run --data yard_euroc": f"{EXPORTED} euroc --out yard_euroc",
    "flysim score yard_euroc --points results": (
        f"{EXPORTED} euroc --out yard_euroc && mkdir results && echo '0 0 1' > results/0.txt"
    ),
    "flysim run --data yard_euroc --out seen": f"{EXPORTED} euroc --out yard_euroc",
    "flysim run --data yard_euroc --engine sgbm --every 3 --set flies.max_depth=5": (
        f"{EXPORTED} euroc --out yard_euroc"
    ),
    "flysim score yard_middlebury --disparity results --name mine": (
        f"{EXPORTED} middlebury --out yard_middlebury && mkdir results && cp yard_middlebury/000000/disp0.pfm results"
    ),
    "flysim score yard_middlebury --obstacles found.json --json": (
        f"{EXPORTED} middlebury --out yard_middlebury && echo '[]' > found.json"
    ),
    "flysim show latest": SHORT,
    "flysim preview random-hard-7/world.sdf": "flysim world random --seed 7 --difficulty hard",
    "flysim nav runs/out/mine/policy.npz --worlds random-medium --episodes 50": (
        "flysim train ppo --worlds random-medium --minutes 1 --out runs/out/mine"
    ),
    "flysim sensors yard --width 160 --out docs/sensors.png": "mkdir docs",
    "flysim nav straight warning vfh dwa ppo --worlds random-medium --episodes 50 --picture docs/nav_scores.png": (
        "mkdir docs"
    ),
}
# What no empty folder of one machine has, and what holds it instead.
ELSEWHERE = {
    r"^(?:make|pip) ": "they install: tests/test_wheel.py, tests/test_pythons.py, and whoever runs the tests",
    r"^flysim view ": "a window that stays: tests/record has the recording in a browser",
    r"onnx:": "a network that a user brings: tests/engines/test_network.py makes some",
    r"^flysim see |suite photographs": "pictures that somebody's camera took: tests/runs/test_see_photographs.py",
    r"barn": "BARN's worlds, which are not flysim's to give: tests/studies",
    r"^\w+\$ ": "two machines: tests/common/test_runner.py",
    r"^flysim calibrate 'shots": "photographs that a reader has: tests/cli/test_calibrate.py",
    r"^python tests/": "a checkout's own, which `make bench` and CONTRIBUTING tell of",
}
OF_ITS_OWN = "docs/tutorial.md"  # test_docs.py runs it in one folder, step by step
ALL = [(page, line) for page in reader.PAGES if page != OF_ITS_OWN for line in reader.commands(page)]
LITERAL = [(page, line) for page, line in ALL if not any(re.search(pattern, line) for pattern in ELSEWHERE)]


def cases():
    slow = (pytest.mark.accuracy, pytest.mark.timeout(4 * 3600))
    once = {line: page for page, line in reversed(LITERAL)}
    return [
        pytest.param(page, line, marks=() if line in QUICK else slow, id=f"{page}: {line}")
        for line, page in sorted(once.items(), key=lambda item: item[::-1])
    ]


@pytest.mark.parametrize(("page", "line"), cases())
def test_a_command_does_what_it_says(page, line, tmp_path):
    folder = tmp_path / "empty"
    folder.mkdir()
    reader.saved(page, folder)
    if line in BEFORE:
        reader.shell(BEFORE[line], folder, tmp_path / "bin")
    assert reader.shell(line, folder, tmp_path / "bin")


def test_the_lists_above_name_what_is_there():
    lines = {line for _, line in ALL}
    assert lines >= QUICK
    assert lines >= set(BEFORE)
    for pattern in ELSEWHERE:
        assert any(re.search(pattern, line) for line in lines), pattern
    assert len(LITERAL) > 40


@pytest.mark.accuracy
@pytest.mark.parametrize("page", ["docs/architecture.md", "docs/nav.md"])
def test_a_snippet_runs(page, tmp_path):
    (tmp_path / "empty").mkdir()
    (program,) = reader.blocks(reader.text_of(page), "python")
    (tmp_path / "empty" / "snippet.py").write_text(program, encoding="utf-8")
    reader.shell("python -P -W error snippet.py", tmp_path / "empty", tmp_path / "bin")


def test_every_page_with_snippets_has_a_test():
    pages = {page for page in reader.PAGES if reader.blocks(reader.text_of(page), "python")}
    tested = {
        "README.md",
        "docs/architecture.md",
        "docs/nav.md",
        "docs/extending.md",
        "docs/data.md",
        "docs/photographs.md",
    }
    tested.add(OF_ITS_OWN)
    # README: test_readme.py; docs/extending.md: test_extending.py; docs/photographs.md: tests/runs; docs/data.md: below
    assert pages == tested


@pytest.mark.accuracy
def test_the_snippet_that_sees_a_data_set(tmp_path):
    (tmp_path / "empty").mkdir()
    program = next(one for one in reader.blocks(reader.text_of("docs/data.md"), "python") if "read_data_set" in one)
    (tmp_path / "empty" / "snippet.py").write_text(program, encoding="utf-8")
    reader.shell(f"{EXPORTED} euroc --out yard_euroc", tmp_path / "empty", tmp_path / "bin")
    said = reader.shell("python -P -W error snippet.py", tmp_path / "empty", tmp_path / "bin")
    assert " obstacles in 1 frames" in said
