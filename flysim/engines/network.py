"""Somebody's stereo network as an engine: `onnx:model.onnx`, run by onnxruntime (`pip install 'flysim-testbed[onnx]'`).

What goes in: two inputs, left and right, `[1, 3, H, W]` RGB or `[1, 1, H, W]` grey; or one of both eyes' channels,
`[1, 6, H, W]` or `[1, 2, H, W]`. An input whose name has "right" in it is the right one, else the second. Floats go
from 0 to `range`, uint8 to 255. A network of a fixed size gets pictures resized to it; one of any size gets them with
their last row and column repeated, up to a multiple of `multiple`.

What comes out: its first output, squeezed to `[H, W]` of the size that went in, is the disparity u_left - u_right of
each left pixel [px], times `times`. Of two channels, as a flow has, the first counts. Below or at 0 there is none.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from flysim.engines.disparity import check_disparities, disparity_swarm
from flysim.engines.settings import leading
from flysim.errors import EngineError
from flysim.flies.parameters import FlyParams
from flysim.flies.threads import lanes
from flysim.foreign.files import read_bytes
from flysim.geometry.rig import StereoRig
from flysim.plain import shown, shown_path
from flysim.products.frame import Frame
from flysim.products.swarm import Swarm

MAX_BYTES = 2**30
MAX_SIDE = 8192  # [px] of a network's fixed input
SETTINGS = {"range": (255.0, 1e-3, 65535.0), "multiple": (32.0, 1.0, 1024.0), "times": (1.0, -1e3, 1e3)}
KINDS: dict[str, type[np.generic]] = {
    "tensor(float)": np.float32,
    "tensor(float16)": np.float16,
    "tensor(uint8)": np.uint8,
}


class Network:
    """An `Engine` that is a network in an ONNX file."""

    def __init__(self, text: str) -> None:
        """Loads the network.

        Args:
            text: what follows `onnx:`: settings `range=`, `multiple=`, `times=`, and the path of the file.

        Raises:
            EngineError: onnxruntime is not there, the file cannot be read, or its inputs are not those of a pair.
        """
        self._settings, name = leading(text, SETTINGS, "onnx:")
        if not name:
            raise EngineError("engine 'onnx:' names no file. Write onnx:model.onnx.")
        path = Path(name)
        data = read_bytes(path, "network", MAX_BYTES, EngineError)
        self._where = f"network {shown_path(path)}"
        try:
            import onnxruntime
        except ImportError:
            raise EngineError(
                "engine onnx: onnxruntime is not installed. Type: pip install 'flysim-testbed[onnx]'."
            ) from None
        options = onnxruntime.SessionOptions()
        options.log_severity_level = 4  # what it would print is told by its exception
        options.intra_op_num_threads = lanes()
        try:
            # From bytes: a file that keeps its weights elsewhere is refused, and no other path is opened.
            self._session = onnxruntime.InferenceSession(data, options, providers=["CPUExecutionProvider"])
        except Exception as error:  # onnxruntime has many kinds, and no common one
            raise EngineError(f"{self._where} cannot be loaded: {_first_line(error)}.") from None
        self._inputs = _ordered(list(self._session.get_inputs()), self._where)

    def begin(self, rig: StereoRig, params: FlyParams) -> None:
        """A new sequence: remembers its parameters.

        Raises:
            EngineError: the rig is not rectified.
        """
        check_disparities(rig, "onnx")
        self._params = params

    def see(self, frame: Frame, *, rng: np.random.Generator) -> Swarm:
        """What the network makes of the frame's pair; takes nothing from `rng`.

        Raises:
            EngineError: it fails, or gives no disparity map.
        """
        del rng
        pair = frame.pair
        return disparity_swarm(pair, self._params, self._disparity(pair.left, pair.right), name="the network")

    def _disparity(self, left: NDArray[np.uint8], right: NDArray[np.uint8]) -> NDArray[np.float32]:
        height, width = left.shape[:2]
        fixed = _fixed(self._inputs[0])
        eyes: list[Any]
        if fixed is None:
            every = round(self._settings["multiple"])
            more = [(0, -side % every) for side in (height, width)]
            eyes = [np.pad(image, [*more, (0, 0)], mode="edge") for image in (left, right)]
        else:
            eyes = [cv2.resize(image, fixed[::-1], interpolation=cv2.INTER_AREA) for image in (left, right)]
        try:
            found: Any = self._session.run(None, self._fed(eyes))[0]
        except Exception as error:  # as above
            raise EngineError(f"{self._where} fails on a pair of {width}x{height} px: {_first_line(error)}.") from None
        values = np.asarray(found)
        while values.ndim > 2 and values.shape[0] in (1, 2):
            values = values[0]
        if values.shape != eyes[0].shape[:2] or values.dtype.kind not in "fiu":
            got, (high, wide) = "x".join(map(str, np.shape(found))), eyes[0].shape[:2]
            raise EngineError(f"{self._where} gives {got} numbers for a pair of {wide}x{high} px, no disparity map.")
        disparity = values.astype(np.float32) * np.float32(self._settings["times"])
        if fixed is not None:
            scale = np.float32(width / fixed[1])
            disparity = cv2.resize(disparity, (width, height), interpolation=cv2.INTER_NEAREST) * scale
        disparity = disparity[:height, :width]
        with np.errstate(invalid="ignore"):
            return np.where(np.isfinite(disparity) & (disparity > 0.0), disparity, np.float32(np.nan))

    def _fed(self, eyes: list[Any]) -> dict[str, NDArray[Any]]:
        """The network's inputs by their names."""
        channels = self._inputs[0].shape[1]
        both = len(self._inputs) == 1
        grey = channels == (2 if both else 1)
        kind = KINDS[self._inputs[0].type]
        planes = []
        for image in eyes:
            plane = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)[None, None] if grey else image.transpose(2, 0, 1)[None]
            if kind is not np.uint8:
                plane = plane.astype(np.float32) * np.float32(self._settings["range"] / 255.0)
            planes.append(np.ascontiguousarray(plane, kind))
        fed = [np.concatenate(planes, axis=1)] if both else planes
        return {one.name: value for one, value in zip(self._inputs, fed, strict=True)}


def _ordered(inputs: list[Any], where: str) -> list[Any]:
    """Left before right.

    Raises:
        EngineError: they are not those of a pair of pictures.
    """
    said = "; ".join(f"{one.name} {one.shape} {one.type}" for one in inputs[:4])
    right = [one for one in inputs if "right" in one.name.lower()]
    if len(inputs) == 2 and len(right) == 1:
        inputs = [one for one in inputs if one not in right] + right
    allowed: tuple[Any, ...] = (2, 6) if len(inputs) == 1 else (1, 3)
    sound = len(inputs) in (1, 2) and all(
        len(one.shape) == 4 and one.shape[1] in allowed and one.type in KINDS for one in inputs
    )
    if not sound or len({(str(one.shape[1:]), one.type) for one in inputs}) != 1:
        raise EngineError(
            f"{where} takes {shown(said)}. Wanted: left and right, [1, 3 or 1, H, W] each, or one [1, 6 or 2, H, W]."
        )
    size = _fixed(inputs[0])
    if size is not None and not all(0 < side <= MAX_SIDE for side in size):
        raise EngineError(f"{where} takes pictures of {size[1]}x{size[0]} px; at most {MAX_SIDE} a side are made.")
    return inputs


def _fixed(one: Any) -> tuple[int, int] | None:
    """Height and width that an input must have; None where it takes any."""
    height, width = one.shape[2:]
    return (height, width) if isinstance(height, int) and isinstance(width, int) else None


def _first_line(error: Exception) -> str:
    lines = str(error).strip().splitlines()
    return lines[0].rstrip(".") if lines else type(error).__name__
