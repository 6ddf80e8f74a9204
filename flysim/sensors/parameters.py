"""What real cameras do to a picture: each figure with its unit, its range and where its model is from."""

from __future__ import annotations

from dataclasses import dataclass

from flysim.common.ranges import ranged

LEVELS, PX = "grey levels", "px"


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorParams:
    """What happens between the light and the image that an engine sees; all of it off unless set.

    The attributes stand in the order in which a real camera does it: lens, exposure, chip, file. A level is one of the
    8-bit image, 0 to 255, and is taken for the light itself. Refuses nonsense with a ValueError that names the figure.

    Attributes:
        k1, k2: radial distortion of both lenses, in coordinates over the focal length (Brown 1971, as OpenCV has it).
            The image stays distorted, and the rig that the robot believes in stays a pinhole's.
        p1, p2: tangential distortion of both lenses.
        vignetting: share of the light that is lost in the corner farthest from the optical axis; it grows with the
            square of the distance from the axis (the first term of Goldman 2010's polynomial).
        uneven_right: share of the light that the right eye lacks at its right border; at its left it lacks none.
        defocus_left, defocus_right: sigma [px] of the blur, a Gaussian (Pentland 1987).
        motion_px: length [px] of a smear along the rows, as of a robot that turns while the shutter is open. Up to
            1 px does nothing: a pixel is that wide.
        row_time_us: [us] by which a row is read later than the one above it. The picture shears as the robot turns, by
            the rotation alone: a robot that stands sees nothing of it.
        auto_exposure: mean level that the left image is exposed for, both eyes alike; 0 is off.
        exposure_lag: frames by which that exposure comes late.
        gain_left, gain_right: factor of the levels.
        gamma_left, gamma_right: exponent of the level over 255.
        offset_left, offset_right: added to the levels.
        contrast: factor of the distance from level 128.
        shot_noise: electrons in a pixel at level 255, which come one by one (Poisson; EMVA 1288); 0 is off.
        noise: standard deviation [levels] of the reading, normal, in each pixel and channel for itself.
        bayer: each pixel reads one colour, in the pattern RGGB; OpenCV fills in the two others.
        jpeg_quality: of the file that the image went through, 1 to 100; 0 is none.
    """

    __pydantic_config__ = {"extra": "forbid"}  # noqa: RUF012 (how a scenario file reads this record)

    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    vignetting: float = 0.0
    uneven_right: float = 0.0
    defocus_left: float = 0.0
    defocus_right: float = 0.0
    motion_px: float = 0.0
    row_time_us: float = 0.0
    auto_exposure: float = 0.0
    exposure_lag: int = 0
    gain_left: float = 1.0
    gain_right: float = 1.0
    gamma_left: float = 1.0
    gamma_right: float = 1.0
    offset_left: float = 0.0
    offset_right: float = 0.0
    contrast: float = 1.0
    shot_noise: float = 0.0
    noise: float = 0.0
    bayer: bool = False
    jpeg_quality: int = 0

    def __post_init__(self) -> None:
        ranged(
            self,
            k1=(-1.0, 1.0, "(no unit)"),
            k2=(-1.0, 1.0, "(no unit)"),
            p1=(-0.1, 0.1, "(no unit)"),
            p2=(-0.1, 0.1, "(no unit)"),
            vignetting=(0.0, 1.0, "of the light"),
            uneven_right=(0.0, 1.0, "of the light"),
            defocus_left=(0.0, 50.0, PX),
            defocus_right=(0.0, 50.0, PX),
            motion_px=(0.0, 200.0, PX),
            row_time_us=(0.0, 1000.0, "us"),
            auto_exposure=(0.0, 255.0, LEVELS),
            exposure_lag=(0, 100, "frames"),
            gain_left=(0.0, 16.0, "(a factor)"),
            gain_right=(0.0, 16.0, "(a factor)"),
            gamma_left=(0.1, 10.0, "(an exponent)"),
            gamma_right=(0.1, 10.0, "(an exponent)"),
            offset_left=(-255.0, 255.0, LEVELS),
            offset_right=(-255.0, 255.0, LEVELS),
            contrast=(0.0, 10.0, "(a factor)"),
            shot_noise=(0.0, 1e6, "electrons"),
            noise=(0.0, 255.0, LEVELS),
            jpeg_quality=(0, 100, "(0: no JPEG)"),
        )
        if not isinstance(self.bayer, bool):
            raise ValueError(f"bayer must be true or false, got {self.bayer!r}")
        if self.exposure_lag and not self.auto_exposure:
            raise ValueError("exposure_lag is of auto_exposure: set that too, such as auto_exposure = 110 grey levels")

    @property
    def distorts(self) -> bool:
        """Whether the lenses are no pinholes."""
        return any((self.k1, self.k2, self.p1, self.p2))
