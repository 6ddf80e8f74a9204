"""Files in a folder that somebody else made: none of its names, and no link in it, leads out of it."""

from __future__ import annotations

from pathlib import Path

from flysim.errors import FlysimError
from flysim.plain import shown, shown_path


def inside(folder: Path, name: str, error: type[FlysimError] = FlysimError) -> Path:
    """The path of `name` in `folder`, whether it is there or not.

    Raises:
        error: it leads out of the folder: by its dots, as an absolute path, or over a link.
    """
    try:
        path, root = (folder / name).resolve(), folder.resolve()
        leads_out = not path.is_relative_to(root)
    except (OSError, ValueError, RuntimeError):  # a zero byte, a name too long, a loop of links
        leads_out = True
    if leads_out:
        raise error(f"{shown_path(folder)}: {shown(name)} leads out of the folder: nothing there is read.")
    return folder / name


def names_in(folder: Path, endings: tuple[str, ...], limit: int, error: type[FlysimError] = FlysimError) -> list[str]:
    """The sorted names of files in a folder that end so; none where there is no folder.

    Raises:
        error: there are more than `limit`.
    """
    found = []
    try:
        for path in folder.iterdir():
            if path.suffix.lower() in endings and not path.name.startswith("."):
                found.append(path.name)
                if len(found) > limit:
                    raise error(f"{shown_path(folder)}: more than {limit} files; that many are not read.")
    except OSError:
        return []
    return sorted(found)
