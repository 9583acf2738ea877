# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the custom shapes (outlines) and colours of control bones."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import bpy
from mathutils import Vector

from ..base import parts
from ..base.blender_types import ArmatureObject

Line = Sequence[tuple[float, float]]  # corners in the xy plane
_COUNT = 32  # corners of a ring


@dataclass(frozen=True)
class Room:
    """Extent of a face, in the space of its control armature.

    Attributes:
        middle: x of the face's centre.
        eyes: x of the midpoint between the eyes.
        wide: half the width of the face at the height of its eyes.
        top: z of the highest point of all meshes, hair included.
    """

    middle: float
    eyes: float
    wide: float
    top: float


def _ring(size: float = 1.0, x: float = 0.0, y: float = 0.0, flat: float = 1.0) -> Line:
    return [
        (x + size * math.cos(turn), y + size * flat * math.sin(turn))
        for turn in (2 * math.pi * i / _COUNT for i in range(_COUNT))
    ]


def _lens() -> Line:
    """The outline of an open eye: two arcs that meet in two corners."""
    half = _COUNT // 2
    turns = [math.pi * i / half for i in range(half)]
    arc = [(math.cos(turn), 0.55 * math.sin(turn) ** 2) for turn in turns]
    return arc + [(-x, -y) for x, y in arc]


def _band(low: float, high: float) -> Line:
    """The outline of a smiling mouth: the lower part of a ring with radii `low` and `high`."""
    turns = [math.pi * (1.15 + 0.7 * i / 12) for i in range(13)]
    outer = [(high * math.cos(t), high * math.sin(t)) for t in turns]
    return outer + [(low * math.cos(t), low * math.sin(t)) for t in reversed(turns)]


def _cross() -> list[Line]:
    """A ring with four marks, like crosshairs."""
    marks = []
    for x, y in ((1, 0), (0, 1), (-1, 0), (0, -1)):
        marks.append([(0.72 * x - 0.04 * y, 0.72 * y + 0.04 * x), (1.3 * x, 1.3 * y),
                      (0.72 * x + 0.04 * y, 0.72 * y - 0.04 * x)])  # fmt: skip
    return [_ring(), *marks]


def _collar() -> Line:
    """A band around the front of a neck; the back is left out, because it would cross the mouth."""
    outer = [(1.0, 0.0), (1.0, 0.6), (0.6, 1.0), (-0.6, 1.0), (-1.0, 0.6), (-1.0, 0.0)]
    return outer + [(0.93 * x, 0.93 * y) for x, y in reversed(outer)]


# Control bone -> lines of its outline in the xy plane, with a radius of about 1.
_OUTLINES: dict[str, list[Line]] = {
    "head": [_ring(), _ring(0.94)],
    "neck": [_collar()],
    "eye_L": [_lens(), _ring(0.3)],
    "eye_R": [_lens(), _ring(0.3)],
    "eyes": _cross(),
    "face": [_ring(), _ring(0.11, -0.36, 0.3), _ring(0.11, 0.36, 0.3), _band(0.5, 0.62)],
}  # fmt: skip
# Red, green and blue of each bone, 0 to 1.
_COLOURS = {
    "head": (0.95, 0.75, 0.15),
    "neck": (0.75, 0.45, 0.10),
    "eye_L": (0.15, 0.50, 1.00),
    "eye_R": (1.00, 0.25, 0.25),
    "eyes": (0.75, 0.35, 0.95),
    "face": (0.25, 0.85, 0.35),
}

PLACED = frozenset(_OUTLINES)  # the control bones that `place` supports


def make(made: list[bpy.types.ID], character: str, bone: str) -> bpy.types.Object:
    """Make the outline of a bone as a wire mesh object in no collection, so only the bone shows it.

    Args:
        made: receives every new datablock.
        character: prefix of the names of the datablocks.
        bone: name of the control bone.
    """
    corners: list[tuple[float, float, float]] = []
    edges = []
    for line in _OUTLINES[bone]:
        first, count = len(corners), len(line)
        corners += [(x, y, 0.0) for x, y in line]
        edges += [(first + i, first + (i + 1) % count) for i in range(count)]
    name = f"{character}_shape_{bone}"
    mesh = bpy.data.meshes.new(name)
    made.append(mesh)
    mesh.from_pydata(corners, edges, [])
    item = bpy.data.objects.new(name, mesh)
    made.append(item)
    return item


def drawn(name: str, lines: Sequence[Line]) -> bpy.types.Object:
    """Make a wire mesh object of open lines, in no collection.

    Args:
        name: name of the new datablocks.
        lines: corners of each line in the xy plane.
    """
    corners: list[tuple[float, float, float]] = []
    edges = []
    for line in lines:
        first = len(corners)
        corners += [(x, y, 0.0) for x, y in line]
        edges += [(first + i, first + i + 1) for i in range(len(line) - 1)]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, edges, [])
    return bpy.data.objects.new(name, mesh)


def disc(name: str) -> bpy.types.Object:
    """Make a filled disc of radius 1, which is easy to click.

    Args:
        name: name of the datablocks.
    """
    mesh = bpy.data.meshes.new(name)
    ring = [(x, y, 0.0) for x, y in _ring()]
    # The disc has a second face for its back, because Blender draws only the front of a face and
    # some handles are seen from behind.
    back = range(2 * _COUNT - 1, _COUNT - 1, -1)
    mesh.from_pydata([*ring, *ring], [], [range(_COUNT), back])
    return bpy.data.objects.new(name, mesh)


def place(bone: bpy.types.PoseBone, name: str, room: Room) -> None:
    """Rotate, scale and move the outline beside its body part, and colour the bone.

    Seen from the front, no outline covers the eyes, and View Selected on the bones frames the head.

    Args:
        bone: the control bone with its outline.
        name: name of the control bone.
        room: extent of the face.
    """
    scale, offset = _placed(bone.bone, name, room)
    bone.custom_shape_scale_xyz = (scale, scale, scale)
    bone.custom_shape_translation = offset
    if name != "face":  # the outline is perpendicular to the bone
        bone.custom_shape_rotation_euler = (math.pi / 2, 0.0, 0.0)
    colour(bone, _COLOURS[name])


def step_aside(controls: ArmatureObject, aside: bool) -> None:
    """Move the outline of the slider bone to the other side of the head to make room for a board.

    Args:
        controls: control armature of a face.
        aside: True: to the other side; False: back. An outline that the user moved stays.
    """
    bone, head = controls.pose.bones[parts.FACE], controls.data.bones.get("head")
    if head is None:
        return
    across = Vector((2.0 * (head.head_local.x - bone.bone.head_local.x), 0.0, 0.0))
    there = bone.bone.matrix_local.to_3x3().inverted() @ across
    before, after = (Vector(), there) if aside else (there, Vector())
    if (bone.custom_shape_translation - before).length < 1e-3 * bone.bone.length:
        bone.custom_shape_translation = after


def is_placed(bone: bpy.types.PoseBone, name: str, room: Room) -> bool:
    """Whether an outline has the scale and position that the function `place` sets.

    Args:
        bone: the control bone.
        name: name of the control bone.
        room: extent of the face.
    """
    scale, offset = _placed(bone.bone, name, room)
    near = 1e-3 * bone.bone.length
    sized = (bone.custom_shape_scale_xyz - Vector((scale, scale, scale))).length
    return sized < 1e-3 and (bone.custom_shape_translation - offset).length < near


def _placed(bone: bpy.types.Bone, name: str, room: Room) -> tuple[float, Vector]:
    """Scale of the outline in bone lengths, and its translation in the bone's space.

    Args:
        bone: the control bone.
        name: name of the control bone.
        room: extent of the face.
    """
    # Bones of an extremely small or large face may have length 0; 1 avoids a division by 0.
    length, head = bone.length or 1.0, bone.head_local
    if name == "head":  # a ring above the hair
        radius = 0.9 * room.wide
        return radius / length, Vector((0.0, room.top - head.z + 0.25 * radius, 0.0))
    if name == "neck":
        return 1.2 * room.wide / length, Vector()
    if name == "face":
        return 0.7, Vector()
    if name == "eyes":  # small, because it is between a near viewpoint and the face
        return 0.18, Vector()
    radius = 0.4 * length  # beside the temple of its side
    away = 1 if head.x >= room.eyes else -1
    aside = Vector((room.middle + away * (room.wide + 1.3 * radius) - head.x, 0.0, 0.0))
    turn = bone.matrix_local.to_3x3().inverted()
    return 0.4, turn @ aside + Vector((0.0, 0.5 * length, 0.0))


def colour(bone: bpy.types.PoseBone, normal: tuple[float, float, float]) -> None:
    """Set the colour of a bone, and brighter colours for the selected and the active bone.

    Args:
        bone: any pose bone.
        normal: red, green and blue of the unselected bone, 0 to 1.
    """
    look = bone.color
    assert look is not None
    look.palette = "CUSTOM"
    colours = look.custom
    assert colours is not None
    colours.normal = normal
    colours.select = [0.5 + 0.5 * part for part in normal]
    colours.active = [0.75 + 0.25 * part for part in normal]
