"""STL files, read strictly and in bounded memory."""

from __future__ import annotations

import re
from array import array

import numpy as np
from numpy.typing import NDArray

from flysim.worlds.sdf.elements import Unread
from flysim.worlds.surface.mesh_group import too_many

_RECORD = np.dtype([("normal", "<f4", 3), ("vertices", "<f4", (3, 3)), ("attribute", "<u2")])


def parse_stl(data: bytes, max_faces: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices and triangles of a binary or text STL.

    Raises:
        Unread: it is damaged, or has too many triangles.
    """
    count = int.from_bytes(data[80:84], "little")
    if len(data) >= 84 and len(data) == 84 + count * _RECORD.itemsize:
        if count > max_faces:
            raise too_many(max_faces)
        vertices = np.frombuffer(data, _RECORD, offset=84)["vertices"].astype(np.float64).reshape(-1, 3)
    elif data.lstrip()[:5].lower() == b"solid":
        values = array("d")
        try:
            for match in re.finditer(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", data):
                values.extend(float(word) for word in match.groups())
                if len(values) > 9 * max_faces:
                    raise too_many(max_faces)
        except ValueError:
            raise Unread("mesh", "has a vertex that is no three numbers") from None
        if len(values) % 9:
            raise Unread("mesh", "has a facet without three vertices")
        vertices = np.frombuffer(values, dtype=np.float64).reshape(-1, 3) if values else np.empty((0, 3))
    else:
        raise Unread("mesh", "is no STL: its length is not what its header says, and it has no 'solid' line")
    if not len(vertices):
        raise Unread("mesh", "has no faces")
    merged, inverse = np.unique(vertices, axis=0, return_inverse=True)
    return merged, inverse.reshape(-1, 3)
