"""Reads and checks scenarios: world, robot, path and engine. TOML by hand, JSON where a study or a run kept one."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from tomllib import TOMLDecodeError
from typing import Any

from pydantic import Field, ValidationError, field_validator, model_validator

from flysim.common.catalogue import find_robot, find_scenario, find_world, shipped_name
from flysim.common.overrides import override
from flysim.engines.choose import DEFAULT as FLIES
from flysim.engines.choose import ENGINES
from flysim.errors import EngineError, ScenarioError, did_you_mean
from flysim.flies.parameters import FlyParams
from flysim.foreign.data import parse_toml, read_json
from flysim.foreign.files import read_text
from flysim.localise.localiser import DEFAULT as ODOMETRY
from flysim.localise.localiser import LOCALISATIONS
from flysim.obstacles.parameters import ObstacleParams
from flysim.plain import shortened, shown_path
from flysim.render.light import LightParams
from flysim.robots.robot import Mount
from flysim.runs.calibration_source import MOST_TEXT, calibration_place, is_file
from flysim.runs.pairs import Pairs
from flysim.runs.scenario_parts import MAX_STOPS, StopPlan, Strict, TruthParams
from flysim.sensors.calibration import CalibrationParams
from flysim.sensors.parameters import SensorParams
from flysim.sim.driving import DriveParams
from flysim.sim.encoders import OdometryParams
from flysim.worlds.sdf.folder import FROM_ENVIRONMENT
from flysim.worlds.surface.finish import Finish

MAX_BYTES = 1_000_000
MAX_MODELS = 100  # folders
OWN = ("name", "folder", "planning_s")  # what no file says
_UNKNOWN = ("extra_forbidden", "unexpected_keyword_argument")  # pydantic's names for a key nobody reads


class Scenario(Strict):
    """A drive to repeat: everything but the renderer.

    Attributes:
        name: of the file, without its ending.
        description: one sentence.
        world: name of a world, or a path beside the scenario's file.
        robot: name of a robot, or a path beside the scenario's file.
        wheels: names of the joints of its left and its right driven wheel, where its file does not tell.
        cameras: "stereo" mounts the rover's pair in place of its own cameras.
        stops: the path; the robot starts at the first one.
        pairs: "stereo": the robot has two cameras. Else one of them alone takes pictures, the left one or the only one,
            and two stops make a pair: "consecutive" ones, or each with the last one before it in a range of believed
            distances, `{ baseline = [0.1, 0.6] }` [m].
        engine: what sees for the robot: "flies", another one of `flysim list`, or a `module:object`.
        flies: the engine's parameters.
        obstacles: how flies become obstacles.
        truth: how the truth is read.
        localisation: who says where the frames were taken: "odometry", "flies", or a `module:object`.
        sensors: what the cameras do to a picture; nothing, unless set.
        calibration: how the cameras differ from what the robot believes of them; not at all, unless set.
        calibrated_by: what the robot has its belief from: the files of a calibration, "truth" or "images:15"
            (`flysim.runs.calibration_source`); empty: its own file. `calibration = "..."` is written for it.
        light: in the world; a high sun and an even sky, unless set.
        drive: how the robot drives from stop to stop.
        odometry: how what its wheels tell differs from the way it goes; hardly, unless set.
        texture: "speckle" dresses what the world's file leaves without a texture; "tiles" and "blinds" put what repeats
            on every surface; None leaves all as it is.
        texture_contrast: of every texture, 0 (one colour each) to 1.
        seed: of all randomness, where whoever runs it names none.
        notes: what a planned path leaves out, one sentence each.
        models: folders in which the world's models are looked for besides, beside the scenario's file or from here;
            "env": those that Gazebo's variables name.
        planning_s: wall-clock seconds that a planned path took, which count in what a run takes.
        folder: where the file lies, for its relative paths.
    """

    name: str = "unnamed"
    description: str = ""
    world: str
    robot: str = "rover"
    wheels: tuple[str, str] | None = None
    cameras: Mount | None = None
    stops: tuple[StopPlan, ...] = Field(min_length=1, max_length=MAX_STOPS)
    pairs: Pairs = "stereo"
    engine: str = FLIES
    flies: FlyParams = FlyParams()
    obstacles: ObstacleParams = ObstacleParams()
    truth: TruthParams = TruthParams()
    localisation: str = ODOMETRY
    sensors: SensorParams = SensorParams()
    calibration: CalibrationParams = CalibrationParams()
    calibrated_by: str = Field(default="", max_length=MOST_TEXT)
    light: LightParams = LightParams()
    drive: DriveParams = DriveParams()
    odometry: OdometryParams = OdometryParams()
    texture: Finish | None = None
    texture_contrast: float = Field(default=1.0, ge=0.0, le=1.0)
    seed: int = Field(default=0, ge=0, lt=2**63)
    notes: tuple[str, ...] = ()
    models: tuple[str, ...] = Field(default=(), max_length=MAX_MODELS)
    planning_s: float = Field(default=0.0, exclude=True)
    folder: Path | None = Field(default=None, exclude=True)

    @field_validator("flies", "obstacles", mode="before")
    @classmethod
    def _tuple_shares(cls, value: Any) -> Any:
        if isinstance(value, dict) and isinstance(value.get("operators"), list):
            return {**value, "operators": tuple(value["operators"])}
        return value

    @model_validator(mode="before")
    @classmethod
    def _calibration_by_name(cls, data: Any) -> Any:
        if isinstance(data, dict) and isinstance(data.get("calibration"), str):
            return {**{key: data[key] for key in data if key != "calibration"}, "calibrated_by": data["calibration"]}
        return data

    @field_validator("engine")
    @classmethod
    def _known_engine(cls, value: str) -> str:
        if ENGINES.scheme(value) is not None:  # reading somebody's scenario starts no program
            raise ValueError("a scenario starts no program and loads no network: name it by --engine")
        try:
            return ENGINES.check(value)
        except EngineError as error:
            raise ValueError(str(error).removesuffix(".")) from None

    @field_validator("localisation")
    @classmethod
    def _known_localisation(cls, value: str) -> str:
        try:
            return LOCALISATIONS.check(value)
        except EngineError as error:
            raise ValueError(str(error).removesuffix(".")) from None

    @property
    def surfaces(self) -> str | None:
        """What a report says of the surfaces: "tiles, contrast 0.5"; None where they are as the world has them."""
        faded = [f"contrast {self.texture_contrast:g}"] if self.texture_contrast != 1.0 else []
        return ", ".join([*([self.texture] if self.texture else []), *faded]) or None

    @property
    def world_path(self) -> Path:
        """The world's file."""
        return find_world(self.world, self.folder)

    @property
    def model_folders(self) -> tuple[str, ...]:
        """Where the world's models are looked for."""
        return tuple(name if name == FROM_ENVIRONMENT else str(_beside(name, self.folder)) for name in self.models)

    @property
    def robot_path(self) -> Path:
        """The robot's file."""
        return find_robot(self.robot, self.folder)

    def kept(self, folder: Path, seed: int) -> dict[str, Any]:
        """All of it as JSON that runs again from `folder`, by this seed: with the folder, wherever that is moved to.

        What lies in the folder is named from there, what flysim ships by its name, all else by its whole path.
        """
        at = {"world": (self.world, self.world_path), "robot": (self.robot, self.robot_path)}
        if is_file(self.calibrated_by):
            at["calibrated_by"] = (self.calibrated_by, calibration_place(self.calibrated_by, self.folder))
        lasting = [name if name == FROM_ENVIRONMENT else str(Path(name).resolve()) for name in self.model_folders]
        named: dict[str, Any] = {"models": lasting} if lasting else {}
        named |= {key: _lasting(name, path, folder) for key, (name, path) in at.items()}
        return {**self.model_dump(mode="json"), **named, "seed": seed}


def read_scenario(name: str, overrides: Iterable[str] = (), where: str | None = None) -> Scenario:
    """The scenario of a name or a path, with `KEY=VALUE` overrides such as `flies.population=3000`.

    A path may also be that of the `scenario.json` of a suite's run, or of a run's `config.json`: the same again. What
    is wrong is said to be in `where`, else in the file.

    Raises:
        ScenarioError: no such scenario, not TOML, an unknown key (with the nearest known one) or a bad value.
    """
    path = find_scenario(name)
    where = where or shown_path(path)
    kept = path.suffix == ".json"
    data = _kept_data(path, where) if kept else _typed_data(path, where)
    title = data.pop("name", path.stem) if kept else path.stem
    for one in overrides:
        override(data, one)
    reserved = {*OWN} & data.keys()
    if reserved:
        raise ScenarioError(
            f"{where}: '{min(reserved)}' comes from the file's own name, or from planning; take it out."
        )
    return make_scenario({**data, "name": title, "folder": path.parent}, where)


def _typed_data(path: Path, where: str) -> dict[str, Any]:
    text = read_text(path, "scenario", MAX_BYTES, ScenarioError)
    try:
        return parse_toml(text)
    except TOMLDecodeError as error:
        raise ScenarioError(f"{where}: not TOML: {error}.") from error
    except ValueError as error:
        raise ScenarioError(f"{where}: {error}.") from error


def _kept_data(path: Path, where: str) -> dict[str, Any]:
    """What `Scenario.kept` made, alone or as a run's configuration has it."""
    data = read_json(path, "scenario", MAX_BYTES, ScenarioError)
    if isinstance(data, dict) and isinstance(data.get("scenario"), dict):
        data = data["scenario"]
    if not isinstance(data, dict) or "stops" not in data:
        raise ScenarioError(f"{where}: no scenario. Give the scenario.json of a suite's run, or a run's config.json.")
    return data


def _beside(name: str, folder: Path | None) -> Path:
    """A folder's path, taken from beside a scenario's file if it is there."""
    path = Path(name) if folder is None else folder / name
    return path if path.is_dir() else Path(name)


def _lasting(name: str, path: Path, folder: Path) -> str:
    """How a world or a robot is called in a scenario that is kept in `folder`."""
    path, folder = path.resolve(), folder.resolve()
    if path.is_relative_to(folder):
        return path.relative_to(folder).as_posix()
    shipped = shipped_name(path)
    return shipped if shipped is not None else str(path) if Path(path).name == Path(name).name else name


def make_scenario(data: dict[str, Any], where: str = "scenario") -> Scenario:
    """A scenario from plain data; errors are one line that begins with `where`."""
    try:
        return Scenario.model_validate(data)
    except ValidationError as error:
        raise ScenarioError(f"{where}: {_first_problem(error)}") from error


def _first_problem(error: ValidationError) -> str:
    # An unknown key first: what it was meant to be is likely to be what else is missing.
    problem = min(error.errors(), key=lambda e: e["type"] not in _UNKNOWN)
    place = [str(p) for p in problem["loc"]]
    key = ".".join(place)
    if problem["type"] in _UNKNOWN:
        return f"unknown key '{key}'. {did_you_mean(place[-1], _known_keys(place[:-1]))}"
    if problem["type"] == "missing":
        return f"'{key}' is missing. Add it."
    message = problem["msg"].removeprefix("Value error, ")
    given = "" if problem["type"] == "value_error" else f", got {_short(problem['input'])}"
    return f"{key}: {message}{given}" + ("" if message.endswith("?") else ".")


def _short(value: object) -> str:
    return shortened(repr(value), 60)


def _known_keys(place: list[str]) -> list[str]:
    """The keys that the table at `place` may have, such as those of `flies.search`."""
    if place[:1] == ["stops"]:
        return list(StopPlan.model_fields)
    record: Any = Scenario
    for name in place:
        kinds = {**getattr(record, "__dataclass_fields__", {}), **getattr(record, "model_fields", {})}
        if name not in kinds:
            return []
        field = kinds[name]  # every table has its defaults
        record = type(field.default_factory() if callable(field.default_factory) else field.default)
    fields = getattr(record, "model_fields", None) or getattr(record, "__dataclass_fields__", {})
    return [key for key in fields if record is not Scenario or key not in OWN]
