# SPDX-License-Identifier: GPL-3.0-or-later
"""Mirrors poses, copies or links the sides of a face, and sets poses of regions.

Either the sliders or the face board lead, that is, move the face. A leading board replaces only the
sliders that its handles can move.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import cast

import bpy
from mathutils import Matrix

from ... import native
from ...logic.character import slider_rows
from ..base import compat, parts
from ..base.blender_types import ArmatureObject
from . import board, runtime

_FLIP = Matrix.Diagonal((-1.0, 1.0, 1.0, 1.0))
_TWIN = "twin"  # variable name of drivers that link a slider to the other side
_OTHER_BONE = {"eye_L": "eye_R", "eye_R": "eye_L"}


def values_of(rig: ArmatureObject, region: str = "") -> dict[str, float]:
    """Slider name -> value, for a face or a region.

    If the face board leads, its handles give the values of the sliders that they can move.

    Args:
        rig: the character.
        region: name of the region; "": all regions.
    """
    of_slider = native.regions().of_slider
    values = board.raw_now(rig)
    return {n: v for n, v in values.items() if not region or of_slider(n) == region}


def put(rig: ArmatureObject, values: Mapping[str, float]) -> int:
    """Set sliders, clamped to their limits.

    Missing sliders, and sliders that a driver links to the other side, are ignored.

    If a face board leads, its handles are moved to the nearest pose instead. Then the other sliders
    are set without limits, linked ones too.

    Args:
        rig: the character.
        values: values by slider names.

    Returns:
        The number of sliders that were set or passed to the board.
    """
    face, controls, live = parts.face_bone(rig), parts.controls_there(rig), runtime.there(rig)
    assert face is not None
    maximum, led = parts.maximum_of(controls), followers(controls)
    if board.leads(controls, live):
        asked = {n: v for n, v in values.items() if n in face}
        board.put_raw(rig, asked)
        return len(asked)
    count = 0
    for label, lowest in zip(live.labels, live.lowest, strict=True):
        if label in values and label in face and label not in led:
            face[label] = min(max(values[label], lowest), maximum)
            count += 1
    controls.update_tag()
    return count


@dataclass(frozen=True)
class Held:
    """Stored values of sliders and handles, for an exact restore.

    Attributes:
        sliders: name -> value.
        places: bone -> location of each handle.
    """

    sliders: Mapping[str, float]
    places: Mapping[str, tuple[float, ...]]


def hold(rig: ArmatureObject) -> Held:
    """Store the current values of sliders and handles.

    Args:
        rig: the character.
    """
    face, live, controls = parts.face_bone(rig), runtime.there(rig), parts.controls_there(rig)
    assert face is not None
    sliders = {label: face[label] for label in live.labels if label in face}
    return Held(sliders, board.places_of(controls, live))


def restore(rig: ArmatureObject, held: Held) -> None:
    """Restore sliders and handles, ignoring limits.

    Args:
        rig: the character.
        held: values from `hold`.
    """
    face = parts.face_bone(rig)
    assert face is not None
    for label, value in held.sliders.items():
        face[label] = value
    board.put_places(parts.controls_there(rig), runtime.there(rig), held.places)


def mirror(rig: ArmatureObject, region: str = "") -> None:
    """Exchange the slider values of left and right.

    Args:
        rig: the character.
        region: name of the region to mirror; "": all regions and the control bones.
    """
    put(rig, slider_rows.mirrored(values_of(rig, region), native.regions()))
    if not region:
        mirror_bones(parts.controls_there(rig))


def mirror_bones(controls: ArmatureObject) -> None:
    """Mirror the transforms of control bones at the armature's plane x = 0.

    The left and the right eye bone exchange their mirrored transforms.
    """
    bones = controls.pose.bones
    turned = {}
    for name in runtime.CONTROL_BONES:
        bone = bones.get(name)
        if bone is None:
            continue
        rest = bone.bone.matrix_local
        turned[_OTHER_BONE.get(bone.name, bone.name)] = (
            _FLIP @ rest @ bone.matrix_basis @ rest.inverted() @ _FLIP
        )
    for name, turn in turned.items():
        if name in bones:
            rest = bones[name].bone.matrix_local
            bones[name].matrix_basis = rest.inverted() @ turn @ rest


def copy_across(rig: ArmatureObject, from_left: bool, region: str = "") -> int:
    """Copy slider values from one side to the other. Both eyes then look in the same direction.

    Args:
        rig: the character.
        from_left: True: copy the character's left side to the right; False: right to left.
        region: name of the region to copy; "": all regions.

    Returns:
        The number of sliders that were set or passed to the board.
    """
    values = values_of(rig, region)
    return put(rig, slider_rows.across_from(values, native.regions(), from_left))


def link(rig: ArmatureObject, from_left: bool) -> int:
    """Link the sliders of one side to the other side with drivers, replacing earlier links.

    Pairs in which a slider has another driver are left out.

    Args:
        rig: the character.
        from_left: True: the character's left side drives the right side; False: the reverse.

    Returns:
        The number of linked sliders.
    """
    controls, live = parts.controls_there(rig), runtime.there(rig)
    unlink(rig)
    data = controls.animation_data_create()
    assert data is not None
    count = 0
    for pair in slider_rows.pairs(live.labels, native.regions()):
        leader, follower = pair if from_left else pair[::-1]
        path = parts.property_path(follower)
        if data.drivers.find(path) is not None or data.drivers.find(parts.property_path(leader)):
            continue
        driver = compat.driver_of(cast("bpy.types.FCurve", controls.driver_add(path)))
        driver.type = "SUM"
        variable = driver.variables.new()
        variable.name = _TWIN
        target = variable.targets[0]
        target.id, target.data_path = controls, parts.property_path(leader)
        count += 1
    return count


def unlink(rig: ArmatureObject) -> None:
    """Remove the drivers that link left and right sliders; the sliders keep their values."""
    controls, face = parts.controls_there(rig), parts.face_bone(rig)
    assert face is not None
    for follower, leader in followers(controls).items():
        controls.driver_remove(parts.property_path(follower))
        if leader in face and follower in face:
            face[follower] = face[leader]
    controls.update_tag()


def followers(controls: ArmatureObject) -> dict[str, str]:
    """Slider that is linked to the other side -> slider that drives it."""
    data = controls.animation_data
    if data is None or not len(data.drivers):
        return {}
    found = {}
    start, _, end = parts.property_path("@").partition("@")
    for curve in data.drivers:
        driver = compat.driver_of(curve)
        if len(driver.variables) == 1 and driver.variables[0].name == _TWIN:
            leader = driver.variables[0].targets[0].data_path
            found[_label(curve.data_path, start, end)] = _label(leader, start, end)
    return found


def _label(path: str, start: str, end: str) -> str:
    return bpy.utils.unescape_identifier(path.removeprefix(start).removesuffix(end))


def in_use(rig: ArmatureObject) -> set[str]:
    """The sliders that are not at rest or have keys in the active action, and their counterparts on
    the other side."""
    live, controls = runtime.there(rig), parts.controls_there(rig)
    data = controls.animation_data
    action = data.action if data is not None else None
    keyed = {curve.data_path for curve in compat.curves_of(action)} if action is not None else set()
    values = values_of(rig)
    used = {
        label
        for label, rest in zip(live.labels, live.rests, strict=True)
        if label in values
        and (abs(values[label] - rest) > 1e-6 or parts.property_path(label) in keyed)
    }
    return used | {native.regions().across(label) for label in used}
