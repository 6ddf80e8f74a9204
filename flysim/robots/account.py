"""What becomes of each construct that a URDF may hold, and the account of what became of those of one file."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from flysim.plain import plain, shortened

Verdict = Literal["read", "approximated", "left out", "refused"]
PLACES = 3  # that a sentence names of each kind
MOST = 280  # characters of a sentence


@dataclass(frozen=True, slots=True, kw_only=True)
class Construct:
    """A kind of thing in a robot's file.

    Attributes:
        name: what it is.
        verdict: what becomes of it.
        how: in which way, or why not.
        said: how a sentence about one file begins, where there is one.
    """

    name: str
    verdict: Verdict
    how: str
    said: str = ""


def _read(name: str, how: str) -> Construct:
    return Construct(name=name, verdict="read", how=how)


def _near(name: str, how: str, said: str) -> Construct:
    return Construct(name=name, verdict="approximated", how=how, said=said)


def _left(name: str, how: str, said: str) -> Construct:
    return Construct(name=name, verdict="left out", how=how, said=said)


def _refused(name: str, how: str) -> Construct:
    return Construct(name=name, verdict="refused", how=how)


CONSTRUCTS: dict[str, Construct] = {
    "tree": _read(
        "a tree of links with any root, `base_footprint` above `base_link` or not",
        "the robot's own frame lies on the floor between its driven wheels, x forward, wherever `base_link` is",
    ),
    "shapes": _read("`<box>`, `<cylinder>`, `<sphere>`", "visuals and collisions, as they are"),
    "visual mesh": _read(
        "`<mesh>` of a `<visual>`", "by the reader of the worlds' meshes, from the robot's own folder or package"
    ),
    "joints": _read(
        "joints: fixed, continuous, revolute, prismatic",
        "those that nobody drives: continuous ones turn freely, the others stay at zero",
    ),
    "dynamics": _read("`<dynamics>`, `<limit>`, `<inertial>`, `<contact>`, `<mu1>`", "as they are"),
    "colour": _read("`<material>` with `<color>`", "red, green and blue"),
    "plugin wheels": _read(
        "the diff_drive plugin (classic, gz), `left_joint` and `right_joint`", "they are the driven wheels"
    ),
    "ros2_control": _read(
        "`<ros2_control>` with velocity commands", "where no plugin names wheels: by the sides they stand on"
    ),
    "transmission": _read("`<transmission>`", "where nothing else names wheels: by the sides they stand on"),
    "wheel names": _read(
        "joints named `left_wheel_joint` and `right_wheel_joint`", "where no tag names wheels; `--wheels` comes first"
    ),
    "camera": _read(
        "two cameras, a `multicamera`, a pair by names with left and right",
        "the pair; where names do not tell, two equal cameras side by side",
    ),
    "one camera": _read("one camera alone", 'it loads; a run needs `pairs = "consecutive"`'),
    "sensor pose": _read("`<pose>` of a sensor and of its camera", "one after the other, from the link they refer to"),
    "collision mesh": _near(
        "`<mesh>` of a `<collision>`", "its convex hull, of at most 256 corners", "meshes collide as their convex hulls"
    ),
    "wheel mesh": _near(
        "a driven wheel without a round collision",
        "a cylinder as large as its mesh or its visual, or of the plugin's radius",
        "wheels roll on a cylinder as large as their mesh or visual, or as the plugin says",
    ),
    "tyre": _near(
        "a driven wheel's collision that is a cylinder wider than 5 mm",
        "crowned: all of its radius on 4 mm in its middle, 2 mm less beside; a wide line of contact drags in turns",
        "wheels are crowned and touch the floor on 4 mm",
    ),
    "capsule": _near("`<capsule>`", "a cylinder as long with its caps", "capsules are cylinders"),
    "massless": _near(
        "a link with a collision and no mass on a fixed joint",
        "it weighs nothing",
        "without a mass, they weigh nothing",
    ),
    "point mass": _near(
        "an inertia that no body has, on a fixed joint",
        "that of a ball of 5 cm radius and the link's mass",
        "an inertia that no body has is taken for a ball's",
    ),
    "depth camera": _near(
        "`depth`, `depth_camera`, `rgbd`, `rgbd_camera`",
        "one eye with a colour image",
        "depth cameras are one eye each",
    ),
    "sense": _near(
        "a driven wheel that turns about -y",
        "turned the other way, so that the robot goes forward",
        "wheels whose axis points right are turned the other way round",
    ),
    "swapped": _near(
        "a left camera to the right of the right one",
        "each eye by where it is",
        "eyes are called left and right by where they are, not by their names",
    ),
    "behind": _near(
        "a camera that looks backward, where none looks ahead",
        "it sees what lies behind",
        "eyes look backward, away from where the robot goes",
    ),
    "turned base": _near(
        "a `base_link` whose x axis is not where the wheels go",
        "forward is across the axle",
        "forward is across the axle, not along base_link's x axis",
    ),
    "low": _near(
        "a collision that reaches more than 2 cm below the driven wheels",
        "the robot stands on it, and its wheels may hang in the air",
        "wheels may hang in the air, since collisions reach below the floor that they stand on",
    ),
    "plugin sizes": _near(
        "the plugin's wheel sizes where the wheels have others",
        "the wheels' own",
        "the plugin gives other sizes than the wheels have, which count",
    ),
    "mu2": _near("`<mu2>` other than `<mu1>`", "`<mu1>` all round", "friction is mu1 all round"),
    "transparency": _near("a colour that is not opaque", "opaque", "colours are opaque"),
    "mounted": _near(
        "`--cameras stereo`",
        "the rover's pair at the robot's front edge, 0.5 m high or just above it",
        "the rover's pair of cameras is mounted",
    ),
    "lost mesh": _left(
        "a mesh that cannot be read: not there, outside the folder, a format without reader, damaged",
        "named, with the reason",
        "meshes that cannot be read are left out",
    ),
    "picture": _left("`<texture>`", "the colour counts", "textures are left out"),
    "plugins": _left("other plugins", "named", "plugins are left out"),
    "sensors": _left("other sensors: laser, imu, gps ...", "named", "sensors are left out"),
    "cameras": _left("cameras beside the pair or the eye", "named", "further cameras are left out"),
    "lens": _left(
        "`<noise>`, `<distortion>`, `<lens>` of a camera",
        "set a scenario's `sensors` for the like",
        "a camera's own noise, distortion and lens are left out",
    ),
    "clip": _left(
        "`<clip>` that hides what is between 0.05 and 10 m", "seen all the same", "a camera's clip planes are left out"
    ),
    "joint extras": _left(
        "`<mimic>`, `<safety_controller>`, `<calibration>` of a joint", "named", "tags of joints are left out"
    ),
    "gazebo tags": _left("other tags of `<gazebo>`", "named", "tags of <gazebo> are left out"),
    "unknown": _left("any other tag", "named", "tags that URDF does not know are left out"),
    "xacro": _refused("xacro", "where the package `xacro` is not installed; the error has the command that expands it"),
    "forgiven": _read(
        "`--` in a comment, a prefix that nobody declares, byte order marks", "as readers of URDF have it"
    ),
    "entities": _refused("a DTD, an entity", "remove them"),
    "floating": _refused("joints: floating, planar", "of no known robot on two wheels"),
    "no tree": _refused("two parents, a ring of joints, a link that hangs on nothing", "the error names the link"),
    "mass": _refused("a moving link with a collision and no mass, or with an inertia that no body has", "correct it"),
    "names": _refused("two links, joints or cameras of one name; a tag that refers to no link", "the error says which"),
    "numbers": _refused("what is no finite number, or no size, where one belongs", "the error has what was got"),
    "no wheels": _refused("no driven wheels", "the error lists the continuous joints there are"),
    "skid": _refused(
        "more than two driven wheels: a skid steer", "by that name: how much it slips depends on how it turns"
    ),
    "wheel shape": _refused("driven wheels that are not round, not equal or not on one axle", "the error has figures"),
    "no camera": _refused("no camera", "`--cameras stereo` mounts a pair"),
    "size": _refused(
        "more than 4 MB, 100 links, 500 shapes, 2 million triangles, 64 levels",
        "a limit on all that a file makes large",
    ),
}


@dataclass(slots=True)
class Account:
    """What was approximated or left out of one file, by construct, in the order of first sight."""

    _places: dict[str, list[str]] = field(default_factory=dict)

    def note(self, construct: str, place: str) -> None:
        """Notes one more place of a construct that is approximated or left out."""
        assert CONSTRUCTS[construct].said  # of the table, and no silent one
        places = self._places.setdefault(construct, [])
        if place not in places:
            places.append(place)

    def rows(self) -> tuple[tuple[str, Verdict, tuple[str, ...]], ...]:
        """(construct, verdict, its places) of each that was noted."""
        return tuple((key, CONSTRUCTS[key].verdict, tuple(places)) for key, places in self._places.items())

    def sentences(self) -> tuple[str, ...]:
        """One a construct, which names its first places."""
        return tuple(_sentence(CONSTRUCTS[key].said, places) for key, places in self._places.items())


def _sentence(said: str, places: list[str]) -> str:
    head, more = f"Robot: {said}: ", ""
    for count in range(min(PLACES, len(places)), 0, -1):  # as many as a line has room for
        more = f" and {len(places) - count} more" if len(places) > count else ""
        line = plain(f"{head}{', '.join(places[:count])}{more}")
        if len(line) <= MOST:
            return line + "."
    return plain(shortened(f"{head}{places[0]}", MOST - len(more))) + more + "."
