"""The documentation: its tutorial, its notebook, its site, its paper."""

import json
import os
import re
import subprocess
import sys

import pytest
import reader

ROOT = reader.ROOT
TUTORIAL = "docs/tutorial.md"


def test_the_tutorial_step_by_step(tmp_path):
    folder = tmp_path / "empty"
    folder.mkdir()
    reader.saved(TUTORIAL, folder)
    assert {path.name for path in folder.iterdir()} == {"mine.toml", "sizes.py", "my_fitness.py"}
    said = {line: reader.shell(line, folder, tmp_path / "bin") for line in reader.commands(TUTORIAL)}
    assert len(said) == 11
    for run in ("first", "fewer", "mine", "stranger", "gentle"):
        report = json.loads((folder / run / "report.json").read_text())
        assert report["recall"] == 1.0, run
        assert (folder / run / "figures" / "planes.png").is_file()
    assert "cm off" in said["python sizes.py"]
    (checked,) = (told for line, told in said.items() if "check_measure" in line)
    assert checked == ""
    assert said["flysim show mine"] != said["flysim show gentle"]


def test_the_notebook_runs_from_top_to_bottom(tmp_path):
    pytest.importorskip("nbclient", reason="make test installs nbclient")
    nbformat = pytest.importorskip("nbformat", reason="make test installs nbformat")
    pytest.importorskip("ipykernel", reason="make test installs ipykernel")
    notebook = nbformat.read(ROOT / "docs" / "first_run.ipynb", as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells), "outputs are not kept: they would grow stale"
    path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
    # In a process of its own: nbclient's event loop, and its warnings, stay out of this one.
    program = (
        "import sys, nbformat, nbclient\n"
        "notebook = nbformat.read(sys.argv[1], as_version=4)\n"
        "nbclient.NotebookClient(notebook, timeout=200, resources={'metadata': {'path': sys.argv[2]}}).execute()\n"
        "nbformat.write(notebook, sys.argv[2] + '/done.ipynb')\n"
    )
    command = [sys.executable, "-c", program, ROOT / "docs" / "first_run.ipynb", tmp_path]
    env = {**os.environ, "PYTHONPATH": path, "IPYTHONDIR": str(tmp_path / "ipython")}
    done = subprocess.run(command, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    cells = [cell for cell in nbformat.read(tmp_path / "done.ipynb", as_version=4).cells if cell.cell_type == "code"]
    assert "found      1 of 1 visible" in cells[0].outputs[0].text
    assert any("image/png" in output.get("data", {}) for cell in cells for output in cell.outputs)


def test_the_gallery_shows_every_picture_with_its_command():
    tools = str(ROOT / "tools")
    program = f"import sys, json; sys.path.insert(0, {tools!r}); import figures as f\n"
    program += "print(json.dumps({p: g.commands for g in f.FIGURES.values() for p in g.pictures}))"
    drawn = json.loads(subprocess.check_output([sys.executable, "-c", program], text=True))
    gallery = reader.text_of("docs/gallery.md")
    for picture, commands in drawn.items():
        _, found, after = gallery.partition(f"]({picture.removeprefix('docs/')})")
        assert found, picture
        first = re.search(r"`([^`]+)`", after)
        assert first is not None and first[1] in commands, picture


def test_every_page_is_in_the_menu_and_every_link_leads_somewhere():
    menu = set(re.findall(r"(\w+\.md)$", (ROOT / "tools" / "mkdocs.yml").read_text(encoding="utf-8"), re.M))
    assert menu == {path.name for path in (ROOT / "docs").glob("*.md")}
    for page, path in reader.PAGES.items():
        for link in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", reader.prose(reader.text_of(page))):
            assert (path.parent / link).exists(), f"{page}: {link}"


def test_every_name_of_the_reference_is_one():
    import importlib

    names = re.findall(r"^::: (\S+)$", reader.text_of("docs/reference.md"), re.M)
    assert len(names) > 15
    for name in names:
        module, _, attribute = name.rpartition(".")
        assert getattr(importlib.import_module(module), attribute).__doc__, name
    import flysim

    assert set(flysim.__all__) <= {name.rpartition(".")[2] for name in names}


def test_the_site_is_built_without_a_warning(tmp_path):
    pytest.importorskip("mkdocs", reason="make docs installs mkdocs, and builds the same")
    command = [
        sys.executable,
        "-m",
        "mkdocs",
        "build",
        "--strict",
        "-q",
        "-f",
        ROOT / "tools/mkdocs.yml",
        "-d",
        tmp_path,
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_the_paper_cites_what_its_bibliography_has():
    paper = (ROOT / "docs/paper/paper.md").read_text(encoding="utf-8")
    head, body = paper.split("---\n", 2)[1:]
    for key in ("title:", "tags:", "authors:", "affiliations:", "date:", "bibliography: paper.bib"):
        assert re.search(f"^{key}", head, re.M), key
    for part in ("# Summary", "# Statement of need", "# References"):
        assert part in body
    known = set(re.findall(r"^@\w+\{(\w+),", (ROOT / "docs/paper/paper.bib").read_text(encoding="utf-8"), re.M))
    assert set(re.findall(r"@(\w+)", body)) == known
