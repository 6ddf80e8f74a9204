"""Renews the figures, tables and pictures of README and docs from runs: `python tools/readme.py [NAME ...]`.

Without names it takes all that are stale. A figure is stale when what drew it has changed since (its sources, its
commands), or when what it says was changed by hand. Each is put in place as soon as its runs are done: whoever is
stopped goes on with the same command. Times are those of this machine: renew them with nothing else to do.
"""

from __future__ import annotations

import argparse
import ast
import hashlib
import json
import os
import re
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from PIL import Image, ImageChops, ImageStat

sys.path.insert(0, str(Path(__file__).resolve().parent))
from figures import FIGURES, Figure, Texts

ROOT = Path(__file__).resolve().parents[1]
KEPT = "docs/figures.json"  # relative to the root: what each figure was drawn with
REGION = re.compile(r"(<!-- flysim:(\w+) -->)(.*?)(<!-- /flysim -->)", re.S)
COARSE = 1.5  # [grey levels] that a colour may be off, on average
NUMBER = re.compile(r"\d+(?:\.\d+)?")


def pages(root: Path = ROOT) -> list[Path]:
    """The texts that may hold figures."""
    return [root / "README.md", *sorted((root / "docs").glob("*.md"))]


def regions(root: Path = ROOT) -> dict[str, set[str]]:
    """What the texts say in each region, without the white space round it; one region may stand in several places."""
    found: dict[str, set[str]] = {}
    for page in pages(root):
        for hit in REGION.finditer(page.read_text(encoding="utf-8")):
            found.setdefault(hit[2], set()).add(hit[3].strip())
    return found


def put(texts: Texts, root: Path = ROOT) -> None:
    """Writes regions of all texts. One whose marks stand alone on their lines keeps blank lines round what it says."""

    def say(hit: re.Match[str]) -> str:
        if hit[2] not in texts:
            return hit[0]
        margin = "\n\n" if hit[3].startswith("\n") else ""
        return f"{hit[1]}{margin}{texts[hit[2]]}{margin}{hit[4]}"

    for page in pages(root):
        before = page.read_text(encoding="utf-8")
        after = REGION.sub(say, before)
        if after != before:
            page.write_text(after, encoding="utf-8")


def sources_digest(figure: Figure, root: Path = ROOT) -> str:
    """Of all that a figure hangs on: its commands and its sources, comments and docstrings left out."""
    digest = hashlib.sha256("\n".join(figure.commands).encode())
    for path in sorted({path for pattern in figure.sources for path in root.glob(pattern) if path.is_file()}):
        content = path.read_bytes()
        digest.update(path.relative_to(root).as_posix().encode())
        digest.update(_bare(content) if path.suffix == ".py" else content)
    return digest.hexdigest()[:16]


@cache
def _bare(source: bytes) -> bytes:
    tree = ast.parse(source)
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list) and body and isinstance(body[0], ast.Expr):
            value = body[0].value
            if isinstance(value, ast.Constant) and isinstance(value.value, str):
                del body[0]
    return ast.dump(tree).encode()


def said_digest(figure: Figure, root: Path = ROOT) -> str:
    """Of what the texts say and the pictures show."""
    said = regions(root)
    digest = hashlib.sha256()
    for name in figure.regions:
        digest.update(f"{name}: {sorted(said.get(name, ()))}\n".encode())
    for picture in figure.pictures:
        path = root / picture
        digest.update(path.read_bytes() if path.is_file() else b"none")
    return digest.hexdigest()[:16]


def kept(root: Path = ROOT) -> dict[str, dict[str, str]]:
    """By figure: `sources` and `said` as they were when it was drawn; `kept` says why, where it was not drawn anew."""
    path = root / KEPT
    return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}


def keep(name: str, reason: str = "", root: Path = ROOT) -> None:
    """Notes that a figure is of what is there now."""
    figure = FIGURES[name]
    entry = {"sources": sources_digest(figure, root), "said": said_digest(figure, root)}
    found = {**kept(root), name: {**entry, **({"kept": reason} if reason else {})}}
    text = json.dumps({key: found[key] for key in FIGURES if key in found}, indent=1) + "\n"
    path = root / KEPT
    path.with_suffix(".part").write_text(text, encoding="utf-8")
    path.with_suffix(".part").replace(path)


def stale(root: Path = ROOT) -> Iterator[tuple[str, str]]:
    """Names of the figures that are stale, and why."""
    before = kept(root)
    for name, figure in FIGURES.items():
        if name not in before:
            yield name, "it was never drawn"
        elif before[name]["sources"] != sources_digest(figure, root):
            yield name, "what draws it has changed since"
        elif before[name]["said"] != said_digest(figure, root):
            yield name, "what it says was changed by hand"


def answers(figure: Figure, folder: Path) -> list[Any]:
    """What the commands of a figure print, run in a folder."""
    path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
    found = []
    for command in figure.commands:
        program, *words = shlex.split(command)
        assert program == "flysim", command
        done = subprocess.run(
            [sys.executable, "-P", "-m", "flysim", *words],
            **{"cwd": folder, "env": {**os.environ, "PYTHONPATH": path}, "stdout": subprocess.PIPE, "text": True},
            check=False,
        )
        if done.returncode != 0:
            sys.exit(f"readme: `{command}` ended with {done.returncode}; nothing was changed.")
        if "--json" in words:
            found.append(json.loads(done.stdout))
    return found


def texts_of(figure: Figure, folder: Path) -> Texts:
    """What a figure's regions have to say, from fresh runs."""
    found = answers(figure, folder)
    return figure.write(found) if figure.write else {}


def renew(name: str) -> None:
    """Runs a figure's commands and puts its texts and pictures in place."""
    figure = FIGURES[name]
    with tempfile.TemporaryDirectory(prefix="flysim-readme-") as folder:
        put(texts_of(figure, Path(folder)))
        for picture, drawn in figure.pictures.items():
            small(Image.open(Path(folder) / drawn).convert("RGB")).save(ROOT / picture, optimize=True)
    keep(name)


def small(picture: Image.Image) -> Image.Image:
    """With 256 colours, a third of the bytes, where nobody would see it: shades that fade must not become steps."""
    few = picture.quantize(256, dither=Image.Dither.NONE)
    off = ImageStat.Stat(ImageChops.difference(picture, few.convert("RGB"))).mean
    return few if max(off) <= COARSE else picture


def alike(fresh: str, said: str) -> bool:
    """Whether two texts say the same, decimals to one unit of their last digit: another machine rounds otherwise."""
    if NUMBER.sub("#", fresh) != NUMBER.sub("#", said):
        return False
    for one, other in zip(NUMBER.findall(fresh), NUMBER.findall(said), strict=True):
        digits = len(one.partition(".")[2])
        if abs(float(one) - float(other)) > (1.01 * 10.0**-digits if digits else 0.0):
            return False
    return True


def main(words: Sequence[str] | None = None) -> None:
    """Renews, lists, or notes figures."""
    ask = argparse.ArgumentParser(prog="make readme", description=__doc__, epilog=f"Figures: {', '.join(FIGURES)}")
    ask.add_argument("names", nargs="*", metavar="NAME", help="figures to renew; all that are stale by default")
    ask.add_argument("--list", action="store_true", help="say how each stands, and run nothing")
    ask.add_argument("--keep", metavar="REASON", help="run nothing: the figures named stand as they are, and why")
    asked = ask.parse_args(words)
    unknown = [name for name in asked.names if name not in FIGURES]
    if unknown:
        ask.error(f"no figure '{unknown[0]}'. Known: {', '.join(FIGURES)}.")
    why = dict(stale())
    if asked.list:
        before = kept()
        for name in FIGURES:
            standing = before.get(name, {}).get("kept")
            print(f"{name:18} {why.get(name) or ('kept: ' + standing if standing else 'as drawn')}")
        return
    for name in asked.names or why:
        print(f"readme: {name}" + (f" ({why[name]})" if name in why else ""), flush=True)
        if asked.keep:
            keep(name, asked.keep)
        else:
            renew(name)


if __name__ == "__main__":
    main()
