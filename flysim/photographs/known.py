"""The true disparities of a pair, where somebody measured them: PFM, 16-bit PNG, .npy, and Middlebury's 8-bit ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flysim.errors import FlysimError
from flysim.foreign.disparity import read_map
from flysim.foreign.picture import read_picture
from flysim.plain import shown_path

ABSURD = 0.5  # share of a map's values that no disparity has: its bytes are in the wrong order


def read_truth(path: Path, shape: tuple[int, int], scale: float | None = None) -> NDArray[np.float32]:
    """`[H, W]` float32 true disparity [px], NaN where nobody knows.

    Args:
        path: of a PFM, a 16-bit PNG of KITTI, a .npy; or of an 8-bit picture, with its scale.
        shape: height and width of the left picture.
        scale: grey levels a pixel of disparity, of 8-bit pictures (Middlebury 2001: 8 or 16; 2003: 4).

    Raises:
        FlysimError: it cannot be read, is of another size, or its numbers are no disparities.
    """
    where = shown_path(path)
    if scale is None:
        found = read_map(path, "true disparity")
    else:
        if not scale > 0.0:
            raise FlysimError(f"--truth-scale must be > 0 grey levels a pixel, got {scale}.")
        picture = read_picture(path)
        levels = (picture if picture.ndim == 2 else picture[..., 0]).astype(np.float32)
        found = np.where(levels > 0.0, levels / np.float32(scale), np.float32(np.nan))
    if found.shape != shape:
        raise FlysimError(
            f"{where}: the truth has {found.shape[1]}x{found.shape[0]} px, the left picture {shape[1]}x{shape[0]}."
        )
    known = np.isfinite(found)
    if not known.any():
        raise FlysimError(f"{where}: holds no disparity at all.")
    absurd = (found[known] > shape[1]) | (found[known] < 1e-6)
    if absurd.mean() > ABSURD:
        raise FlysimError(
            f"{where}: {100.0 * absurd.mean():.0f} % of its numbers are no disparities of a picture {shape[1]} px "
            "wide: are its bytes in the wrong order?"
        )
    return found


def read_mask(path: Path, shape: tuple[int, int]) -> NDArray[np.bool_]:
    """`[H, W]` which pixels both cameras see, by a picture that is white there.

    Raises:
        FlysimError: it cannot be read or is of another size.
    """
    picture = read_picture(path)
    grey = picture if picture.ndim == 2 else picture[..., 0]
    if grey.shape != shape:
        raise FlysimError(
            f"{shown_path(path)}: the mask has {grey.shape[1]}x{grey.shape[0]} px, the left picture "
            f"{shape[1]}x{shape[0]}."
        )
    return np.asarray(grey >= 255 if grey.max() >= 255 else grey > 0)
