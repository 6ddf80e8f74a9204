"""How an SDF `<visual>` looks: its colour or texture, and whether it is seen at all."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flysim.plain import shown
from flysim.worlds.model import Material
from flysim.worlds.sdf.elements import Unread, child_numbers, numbers, text_of
from flysim.worlds.sdf.reading import Reading

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

# The colours of Gazebo's own material scripts, which world files name without carrying them.
GAZEBO_COLOURS = {
    "Gazebo/Grey": (0.7, 0.7, 0.7),
    "Gazebo/DarkGrey": (0.175, 0.175, 0.175),
    "Gazebo/White": (1.0, 1.0, 1.0),
    "Gazebo/Black": (0.0, 0.0, 0.0),
    "Gazebo/FlatBlack": (0.1, 0.1, 0.1),
    "Gazebo/Red": (1.0, 0.0, 0.0),
    "Gazebo/Green": (0.0, 1.0, 0.0),
    "Gazebo/Blue": (0.0, 0.0, 1.0),
    "Gazebo/Yellow": (1.0, 1.0, 0.0),
    "Gazebo/Orange": (1.0, 0.51, 0.07),
}


def is_seen(visual: Element, reading: Reading) -> bool:
    """Whether any camera sees a visual: not one that is wholly transparent, or whose visibility flags are all off."""
    (transparency,) = child_numbers(visual, "transparency", 1, reading.where, (0.0,))
    flags = text_of(visual.find("visibility_flags"))
    if transparency >= 1.0 or (flags and _is_zero(flags)):
        return False
    if transparency > 0.0:
        reading.note("a <transparency> between 0 and 1 is not read and its visual is drawn solid", f"{transparency:g}")
    return True


def _is_zero(flags: str) -> bool:
    try:
        return len(flags) < 64 and int(flags, 0) == 0
    except ValueError:
        return False


def own_material(visual: Element, reading: Reading) -> Material | None:
    """The first colour and the first texture of a visual; the texture wins where both are drawn. None: it says nothing.

    A material that says nothing leaves a mesh its own.
    """
    materials = visual.findall("material")
    colour = next((e for m in materials if (e := m.find("diffuse")) is not None), None)
    script = next((e for m in materials if (e := m.find("script")) is not None), None)
    albums = [e for flow in ("metal", "specular") if (e := visual.find(f"material/pbr/{flow}/albedo_map")) is not None]
    if colour is None and script is None and not albums:
        return None
    diffuse, texture = Material().diffuse, None
    if colour is not None:
        rgba = numbers(colour, (3, 4), reading.where)
        if not all(0.0 <= value <= 1.0 for value in rgba):
            raise reading.where.error(
                f"<diffuse> must be red green blue alpha from 0 to 1, got {shown(text_of(colour))}"
            )
        diffuse = (rgba[0], rgba[1], rgba[2])
        if len(rgba) == 4 and rgba[3] < 1.0:
            reading.note("an alpha below 1 of a <diffuse> is not read and its visual is drawn solid", f"{rgba[3]:g}")
    elif script is not None:
        name = text_of(script.find("name"))
        if name in GAZEBO_COLOURS:
            diffuse = GAZEBO_COLOURS[name]
        else:
            reading.note("a material script is not read and its visual is grey", name)
    for album in albums:
        if texture is None:
            try:
                texture = reading.folder.texture(text_of(album), reading.base)
            except Unread as error:
                reading.skipped.leave_out(error, reading.where)
    return Material(diffuse=diffuse, texture=texture)
