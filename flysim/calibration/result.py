"""What a calibration found, and what to think of it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flysim.calibration.board import Board
from flysim.calibration.images import Sightings
from flysim.calibration.solve import Solved, SolvedEye, solve_camera, solve_pair
from flysim.common.sheet import Sheet, number, percent
from flysim.geometry.camera_info import CameraInfo

GRID = (8, 6)  # cells of the image, across and down, for what the boards covered
WIDTH = 640.0  # [px] of the image that limits in pixels are of
# What is good, and what is no use: rms [px], boards, standard deviation of the focal length over it, covered cells.
GOOD_RMS, POOR_RMS = 0.5, 1.0
GOOD_BOARDS, POOR_BOARDS = 10, 5
GOOD_FOCAL, POOR_FOCAL = 0.003, 0.01
GOOD_COVERAGE, POOR_COVERAGE = 0.6, 0.3
TILTED = math.radians(15.0)  # boards that face the camera tell nothing of its focal length
STRANGE = 3.0  # times the median rms: an image that does not belong


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BoardCalibration:
    """Cameras as a board showed them.

    Attributes:
        board: that was shown.
        views: what the images showed of it.
        solved: the cameras.
    """

    board: Board
    views: Sightings
    solved: Solved

    @property
    def infos(self) -> dict[str, CameraInfo]:
        """What is written, by the file's name: `camera`, or `left` and `right`."""
        names = ("left", "right") if len(self.solved.eyes) == 2 else ("camera",)
        return {name: eye.info for name, eye in zip(names, self.solved.eyes, strict=True)}

    def covered(self, eye: int) -> NDArray[np.bool_]:
        """`[6, 8]` cells of an eye's image in which some board had a corner."""
        uv = np.concatenate([one.uv for shot in self.views.shots if (one := shot[eye]) is not None])
        cells = np.zeros(GRID[::-1], bool)
        at = [np.clip((uv[:, a] + 0.5) / self.views.size[a] * GRID[a], 0, GRID[a] - 1).astype(int) for a in (0, 1)]
        cells[at[1], at[0]] = True
        return cells

    @property
    def coverage(self) -> float:
        """Share of the cells that are covered, of the eye that has less."""
        return min(float(self.covered(eye).mean()) for eye in range(len(self.solved.eyes)))

    @property
    def strange(self) -> tuple[str, ...]:
        """Images whose corners are much farther off than most images' are."""
        found = []
        for eye in self.solved.eyes:
            each = np.array([np.nan if one is None else one for one in eye.rms_of_images])
            usual = np.nanmedian(each)
            found += [n for n, off in zip(self.views.names, each, strict=True) if off > STRANGE * usual]
        return tuple(dict.fromkeys(found))

    @property
    def verdict(self) -> str:
        """good, usable or poor."""
        return "poor" if self._faults(poor=True) else "usable" if self.advice else "good"

    @property
    def advice(self) -> tuple[str, ...]:
        """What would make it better, one sentence each; nothing where it is good."""
        return self._faults(poor=False)

    def _faults(self, *, poor: bool) -> tuple[str, ...]:
        focal = max(eye.focal_std / eye.info.camera.fx for eye in self.solved.eyes)
        off = self.solved.rms * WIDTH / self.views.size[0]
        boards = len(self.views.names)
        tilted = sum(tilt > TILTED for tilt in self.solved.tilts)
        found = {
            "corners lie far from where they should: is the board flat, the square right, the image sharp?": (
                off > (POOR_RMS if poor else GOOD_RMS)
            ),
            f"only {boards} boards: take 15 to 20.": boards < (POOR_BOARDS if poor else GOOD_BOARDS),
            f"{self.coverage:.0%} of the image was covered: show the board in its corners and along its borders.": (
                self.coverage < (POOR_COVERAGE if poor else GOOD_COVERAGE)
            ),
            f"{tilted} boards were tilted by more than 15 degrees: tilt it, to all sides.": tilted < (2 if poor else 4),
            f"the focal length is known to {focal:.2%} only: show the board tilted, and nearer.": (
                focal > (POOR_FOCAL if poor else GOOD_FOCAL)
            ),
        }
        strange = self.strange
        if strange and not poor:
            found[f"look at {', '.join(strange[:3])}: the board in it is far off."] = True
        return tuple(words for words, holds in found.items() if holds)

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        T = self.solved.T_right_left
        return {
            "verdict": self.verdict,
            "advice": list(self.advice),
            "board": {
                "columns": self.board.columns,
                "rows": self.board.rows,
                "square_m": self.board.square,
                "charuco": self.board.charuco,
            },
            "boards": len(self.views.names),
            "left_out": list(self.views.left_out),
            "rms_px": self.solved.rms,
            "coverage": self.coverage,
            "baseline_m": self.solved.baseline,
            "T_right_left": None if T is None else T.tolist(),
            "cameras": {name: _camera(eye) for name, eye in zip(self.infos, self.solved.eyes, strict=True)},
            "images": [
                {
                    "name": name,
                    "tilt_deg": math.degrees(tilt),
                    "rms_px": [e.rms_of_images[k] for e in self.solved.eyes],
                }
                for k, (name, tilt) in enumerate(zip(self.views.names, self.solved.tilts, strict=True))
            ],
        }

    def sheets(self) -> list[Sheet]:
        """The cameras, then the images."""
        eyes = self.solved.eyes
        rows = [
            ("focal length [px]", *(f"{e.info.K[0, 0]:.2f}, {e.info.K[1, 1]:.2f}" for e in eyes)),
            ("known to", *(f"{100.0 * e.focal_std / e.info.K[0, 0]:.2f} %" for e in eyes)),
            ("principal point [px]", *(f"{e.info.K[0, 2]:.2f}, {e.info.K[1, 2]:.2f}" for e in eyes)),
            ("k1, k2", *(f"{e.info.D[0]:.4f}, {e.info.D[1]:.4f}" for e in eyes)),
            ("p1, p2", *(f"{e.info.D[2]:.5f}, {e.info.D[3]:.5f}" for e in eyes)),
            ("rms [px]", *(number(e.rms, 3) for e in eyes)),
            ("image covered", *(percent(float(self.covered(k).mean())) for k in range(len(eyes)))),
        ]
        pair = "" if self.solved.baseline is None else f", baseline {100.0 * self.solved.baseline:.2f} cm"
        note = [f"Verdict: {self.verdict}.", *(f"{one[0].upper()}{one[1:]}" for one in self.advice)]
        if self.views.left_out:
            note.append(f"No board in {', '.join(self.views.left_out)}: left out.")
        title = f"{self.board.name}, {len(self.views.names)} images, rms {self.solved.rms:.3f} px{pair}"
        images = tuple(
            (name, f"{math.degrees(tilt):.0f}", *(number(eye.rms_of_images[k], 3) for eye in eyes))
            for k, (name, tilt) in enumerate(zip(self.views.names, self.solved.tilts, strict=True))
        )
        return [
            Sheet(title=title, columns=("", *self.infos), rows=tuple(rows), note=" ".join(note)),
            Sheet(title="images", columns=("image", "tilt [deg]", *(f"rms {n} [px]" for n in self.infos)), rows=images),
        ]


def calibrated(board: Board, views: Sightings, name: str | None = None) -> BoardCalibration:
    """The camera, or the pair, that took the images.

    Raises:
        FlysimError: as `solve_camera` and `solve_pair`.
    """
    if len(views.shots[0]) == 1:
        solved = solve_camera([one for (one,) in views.shots if one is not None], board, views.size, name or "camera")
    else:
        solved = solve_pair([(left, right) for left, right in views.shots], board, views.size, name or "stereo")
    return BoardCalibration(board=board, views=views, solved=solved)


def _camera(eye: SolvedEye) -> dict[str, Any]:
    info = eye.info
    return {
        "width": info.width,
        "height": info.height,
        "fx": info.K[0, 0],
        "fy": info.K[1, 1],
        "cx": info.K[0, 2],
        "cy": info.K[1, 2],
        "model": info.model,
        "D": info.D.tolist(),
        "rms_px": eye.rms,
        "focal_std_px": eye.focal_std,
    }
