"""`preview.png` of a data set: both eyes of its first frame, and what truly was there, its depth and its bodies."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flysim.datasets.layout import save_picture
from flysim.products.frame import Frame
from flysim.truth.stop import Stop

PREVIEW = "preview.png"
GAP = 4  # [px] of white between the four
WIDEST = 640  # [px] of each; larger ones are thinned
NEAR, MIDDLE, FAR = (178, 24, 43), (253, 219, 120), (33, 68, 140)  # near red, far blue
NOTHING = (60, 60, 60)


def write_preview(folder: Path, frame: Frame, stop: Stop, max_depth: float) -> None:
    """Write `preview.png`: left and right above, true depth up to `max_depth` [m] and bodies of the left eye below.

    Raises:
        OSError: the disk is full or refuses.
    """
    view = stop.views[0]
    every = -(-view.camera.width // WIDEST)
    panels = [
        image[::every, ::every]
        for image in (frame.pair.left, frame.pair.right, depth_colours(view.depth, max_depth), body_colours(view.link))
    ]
    height = max(len(image) for image in panels)
    width = max(image.shape[1] for image in panels)
    sheet = np.full((2 * height + GAP, 2 * width + GAP, 3), 255, np.uint8)
    for k, image in enumerate(panels):
        v, u = (k // 2) * (height + GAP), (k % 2) * (width + GAP)
        sheet[v : v + len(image), u : u + image.shape[1]] = image
    save_picture(folder / PREVIEW, sheet)


def depth_colours(depth: NDArray[np.float32], max_depth: float) -> NDArray[np.uint8]:
    """`[H, W, 3]` from red, near, over yellow to blue at `max_depth` [m]; grey where nothing is."""
    share = np.clip(np.where(np.isfinite(depth), depth, 0.0) / max_depth, 0.0, 1.0)[..., None]
    near, middle, far = (np.array(colour, float) for colour in (NEAR, MIDDLE, FAR))
    nearer, farther = near + (middle - near) * 2.0 * share, middle + (far - middle) * (2.0 * share - 1.0)
    colours = np.where(share < 0.5, nearer, farther)
    colours[~np.isfinite(depth)] = NOTHING
    return colours.astype(np.uint8)


def body_colours(link: NDArray[np.int32]) -> NDArray[np.uint8]:
    """`[H, W, 3]` a colour a body; grey where there is none."""
    # Hues a golden turn apart: neighbours in number are far from each other in colour.
    hue = (np.arange(link.max(initial=0) + 2) * 0.618034)[:, None] + np.array([0.0, 1.0 / 3.0, 2.0 / 3.0])
    colours = (140.0 + 110.0 * np.cos(2.0 * np.pi * hue)).astype(np.uint8)
    colours[-1] = NOTHING
    return colours[link]
