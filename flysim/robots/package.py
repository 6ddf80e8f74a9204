"""The folder that a robot's files lie in: nothing outside it is opened for that robot."""

from __future__ import annotations

from pathlib import Path

PACKAGE = "package.xml"  # which a ROS package has in its folder
UP = 3  # folders above a URDF in which its package is looked for
URDF_FOLDERS = ("urdf", "xacro")  # of a package, whose meshes lie beside them


def package_of(folder: Path) -> Path:
    """The nearest folder at or above this one with a `package.xml`; without one the folder, or the one above `urdf`."""
    for place in (folder, *folder.parents[:UP]):
        if (place / PACKAGE).is_file():
            return place
    return folder.parent if folder.name in URDF_FOLDERS else folder
