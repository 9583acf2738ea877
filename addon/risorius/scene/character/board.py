# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads and sets the handles of a face board, and decides whether board or sliders lead the face.

The location of a handle in its own axes gives the value of its GUI control, independent of the
positions of board, armature and face. Raw controls without a GUI control keep their sliders. Either
the board or the sliders lead, that is, move the face. A leading board replaces only the sliders
that its handles can move. All code that reads or sets the pose of a face uses this module.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from ...logic.character import board_fit, board_layout
from ..base import compat, parts, session
from ..base.blender_types import ArmatureObject
from . import runtime

RANGE = "Range"  # name of the add-on's constraint of a handle
SEEN = 0.0005  # smaller errors of a raw control are not reported
_NEAR = 1e-6  # locations that differ by no more count as equal
_BY_BOARD, _BY_SLIDERS = "BOARD", "SLIDERS"
Floats = NDArray[np.float32]


@dataclass
class _Places:
    """Indices of handle values among the bone locations of an armature.

    Attributes:
        names: names of all pose bones of the armature; if they change, the indices are renewed.
        live: Runtime of the handles.
        at: int[n], indices into the flattened array float[bones, 3] of locations.
        gui: int[n], index of the GUI control of each location.
        low, high: float32[n], range of each location.
        unit: float32[n], value of the GUI control for a location of 1.
        moved: (bone, [(index into `at`, axis)]) of each handle with constraints by the user; None:
            not searched yet.
    """

    names: tuple[str, ...]
    live: runtime.Runtime
    at: NDArray[np.intp]
    gui: NDArray[np.intp]
    low: Floats
    high: Floats
    unit: Floats
    moved: list[tuple[str, list[tuple[int, int]]]] | None = None


# Session uid of a control armature -> indices of its handle values.
_places: dict[int, _Places] = session.table("board.places", ("undo", "load"))


def note_edit() -> None:
    """Search for handles with constraints again, because the user edited something."""
    for places in _places.values():
        places.moved = None


def _handles_there(controls: ArmatureObject, live: runtime.Runtime) -> list[board_layout.Handle]:
    bones = controls.pose.bones
    return [handle for handle in live.handles if handle.bone in bones]


def is_there(controls: ArmatureObject, live: runtime.Runtime | None) -> bool:
    """Whether a character has a face board, complete or incomplete.

    Args:
        controls: control armature of the character.
        live: Runtime of the character; None gives False.
    """
    bones = controls.pose.bones
    return live is not None and any(handle.bone in bones for handle in live.handles)


def missing(controls: ArmatureObject, live: runtime.Runtime) -> list[str]:
    """The bones of missing handles; empty if the character has no handle at all.

    Args:
        controls: control armature of the character.
        live: Runtime of the character.
    """
    bones = controls.pose.bones
    gone = [handle.bone for handle in live.handles if handle.bone not in bones]
    return gone if len(gone) < len(live.handles) else []


def leads(controls: ArmatureObject, live: runtime.Runtime | None) -> bool:
    """Whether the face board leads a face, and not its sliders; False while controls are baked.

    Args:
        controls: the original (not evaluated) control armature.
        live: Runtime of the character; None gives False.
    """
    wanted = controls.get(parts.LEAD) == _BY_BOARD and parts.BAKED not in controls
    return wanted and is_there(controls, live)


def leads_face(rig: ArmatureObject) -> bool:
    """Whether the face board leads a face; False while its controls are baked.

    Args:
        rig: the deforming armature of the face.
    """
    controls = parts.controls_of(rig)
    return controls is not None and leads(controls, runtime.of(rig))


def set_lead(controls: ArmatureObject, by_board: bool) -> None:
    """Choose whether board or sliders lead, without converting the pose.

    Args:
        controls: control armature of the character.
        by_board: True: the board; False: the sliders.
    """
    controls[parts.LEAD] = _BY_BOARD if by_board else _BY_SLIDERS
    controls.property_overridable_library_set(f'["{parts.LEAD}"]', True)
    controls.update_tag()


def set_kind(controls: ArmatureObject, kind: str) -> None:
    """Set the kind of board of a face, before its bones are built.

    Args:
        controls: control armature of the character, without a board.
        kind: runtime.PRIMARY, else runtime.COMPLETE.
    """
    if kind == runtime.PRIMARY:
        controls[parts.BOARD_KIND] = kind
    elif parts.BOARD_KIND in controls:
        del controls[parts.BOARD_KIND]


def read(seen: ArmatureObject, live: runtime.Runtime) -> Floats:
    """The values of GUI controls from the handles, clamped to their ranges.

    Args:
        seen: the control armature, evaluated or original.
        live: the character's Runtime.

    Returns:
        float32[G]; 0 for values that are not finite and for controls without a handle.
    """
    places = _places_of(seen, live)
    flat = np.empty(3 * len(places.names), np.float32)
    seen.pose.bones.foreach_get("location", flat)
    gui = np.zeros(len(live.table.names), np.float32)
    values = np.clip(flat[places.at], places.low, places.high) * places.unit
    if not np.isfinite(values).all():
        values[~np.isfinite(values)] = 0.0
    gui[places.gui] = values
    for bone, axes in places.moved or ():
        _read_moved(seen, seen.pose.bones[bone], places, axes, gui)
    return gui


def _places_of(seen: ArmatureObject, live: runtime.Runtime) -> _Places:
    bones = seen.pose.bones
    names, uid = tuple(bones.keys()), seen.original.session_uid
    places = _places.get(uid)
    if places is None or places.names != names or places.live is not live:
        places = _places[uid] = _compiled(names, live)
    # In background mode, scripts may add constraints without an update that calls `note_edit`.
    if places.moved is None or bpy.app.background:
        axes: dict[str, list[tuple[int, int]]] = {}
        for row, at in enumerate(places.at.tolist()):
            axes.setdefault(names[at // 3], []).append((row, at % 3))
        places.moved = [
            (name, rows)
            for name, rows in axes.items()
            if any(constraint.name != RANGE for constraint in bones[name].constraints)
        ]
    return places


def _compiled(names: tuple[str, ...], live: runtime.Runtime) -> _Places:
    where = {name: place for place, name in enumerate(names)}
    rows = [
        (3 * where[handle.bone] + axis, way.gui, way.low, way.high, way.unit)
        for handle in live.handles
        if handle.bone in where
        for axis, way in enumerate((handle.x, handle.y))
        if way is not None
    ]
    columns = np.array(rows, np.float64).reshape(-1, 5).T
    at, gui = columns[:2].astype(np.intp)
    low, high, unit = columns[2:].astype(np.float32)
    return _Places(names, live, at, gui, low, high, unit)


def _read_moved(
    seen: ArmatureObject,
    bone: bpy.types.PoseBone,
    places: _Places,
    axes: Iterable[tuple[int, int]],
    gui: Floats,
) -> None:
    """Read a handle that the user's constraints move.

    Args:
        seen: the control armature, evaluated or original.
        bone: bone of the handle.
        places: indices and ranges of the handle values.
        axes: (index into places.at, axis) of each value of this handle.
        gui: float32[G], values of the GUI controls; changed in place.
    """
    local: Matrix = seen.convert_space(
        pose_bone=bone, matrix=bone.matrix, from_space="POSE", to_space="LOCAL"
    )
    for row, axis in axes:
        value = local.translation[axis]
        held = min(max(value, float(places.low[row])), float(places.high[row]))
        gui[places.gui[row]] = held * float(places.unit[row]) if np.isfinite(value) else 0.0


def raw_of(gui: Floats, live: runtime.Runtime, sliders: Floats | None) -> Floats:
    """Convert GUI controls to raw controls.

    Args:
        gui: float32[G], values of GUI controls.
        live: the character's Runtime.
        sliders: float32[R], values of raw controls without a GUI control; None: rest values.

    Returns:
        float32[R], values of raw controls.
    """
    table = live.table
    raw = table.own_raw(gui) if table.is_own else live.rig.gui_to_raw(gui)
    others = np.array(live.rests, np.float32) if sliders is None else sliders
    return np.where(table.reached, raw, others)


def raw_now(rig: ArmatureObject) -> dict[str, float]:
    """The pose of a face as slider name -> value.

    Args:
        rig: the character.

    Returns:
        Values of all existing sliders. If the board leads, sliders that handles can move have the
        values that the board gives them.
    """
    live, face, controls = runtime.there(rig), parts.face_bone(rig), parts.controls_there(rig)
    assert face is not None
    values = {label: float(face[label]) for label in live.labels if label in face}
    if not leads(controls, live):
        return values
    return values | {label: value for label, value in given(rig).items() if label in values}


def given(rig: ArmatureObject) -> dict[str, float]:
    """Slider name -> value from the board, for the sliders that the board's handles can move.

    Args:
        rig: the character.
    """
    live = runtime.there(rig)
    raw = raw_of(read(parts.controls_there(rig), live), live, None).tolist()
    return {label: raw[i] for i, label in enumerate(live.labels) if live.table.reached[i]}


def put_raw(rig: ArmatureObject, values: Mapping[str, float]) -> board_fit.Loss:
    """Move the handles so that the face comes as near as possible to wanted raw controls.

    Args:
        rig: a character with a face board.
        values: wanted values by slider names; controls without a handle are set on their sliders.
            Controls that are not named should keep their present values.

    Returns:
        The remaining differences of raw controls, which the board cannot reproduce.
    """
    live, controls = runtime.there(rig), parts.controls_there(rig)
    face = parts.face_bone(rig)
    assert face is not None
    now = {**raw_now(rig), **values}
    wanted = np.array([now.get(label, 0.0) for label in live.labels])
    reached = live.table.reached
    for i, label in enumerate(live.labels):
        if not reached[i] and label in values and label in face:
            face[label] = values[label]
    gui = fit(live, wanted[None], read(controls, live)[None])
    write(controls, live, gui[0])
    given = live.table.raw(gui)
    return board_fit.loss(live.labels, wanted[None], given, reached, SEEN)


def fit(
    live: runtime.Runtime, raw: NDArray[np.float64], start: Floats | None = None
) -> NDArray[np.float64]:
    """GUI controls that give the nearest values of raw controls.

    Args:
        live: the character's Runtime.
        raw: float[N, R], wanted values of raw controls at N frames.
        start: float[N, G], start of the search; None: the raw values converted by the rig's
            raw_to_gui, or 0 if the table is not from the DNA file: for the primary board, or if the
            file has no GUI controls.

    Returns:
        float64[N, G], values of GUI controls.
    """
    if start is None and live.table.is_own:
        start = np.zeros((len(raw), len(live.table.names)), np.float32)
    elif start is None:
        rows = np.asarray(raw, np.float32)
        start = np.stack([live.rig.raw_to_gui(np.ascontiguousarray(row)) for row in rows])
    return board_fit.fit(live.table, raw, start)


def write(controls: ArmatureObject, live: runtime.Runtime, gui: NDArray[np.float64]) -> None:
    """Move the handles to values of GUI controls.

    Args:
        controls: the original (not evaluated) control armature of the character.
        live: Runtime of the character.
        gui: float[G], values within the ranges of the handles.
    """
    for handle in _handles_there(controls, live):
        bone = controls.pose.bones[handle.bone]
        for axis, way in enumerate((handle.x, handle.y)):
            if way is not None:
                bone.location[axis] = float(gui[way.gui]) / way.unit
    controls.update_tag()


def handles_of_labels(rig: ArmatureObject, labels: Iterable[str]) -> list[board_layout.Handle]:
    """The existing handles that set given sliders.

    Args:
        rig: the character.
        labels: names of sliders.
    """
    live = runtime.there(rig)
    wanted = {i for i, label in enumerate(live.labels) if label in set(labels)}
    return [
        handle
        for handle in _handles_there(parts.controls_there(rig), live)
        if any(wanted.intersection(live.table.outputs_of(way.gui)) for way in handle.axes)
    ]


def handles_in(rig: ArmatureObject, region: str = "") -> list[board_layout.Handle]:
    """The existing handles of a region.

    Args:
        rig: the character.
        region: name of the region; "": all regions.
    """
    there = _handles_there(parts.controls_there(rig), runtime.there(rig))
    return [handle for handle in there if not region or handle.region == region]


def reset(controls: ArmatureObject, handles: Iterable[board_layout.Handle]) -> None:
    """Move handles to rest.

    Args:
        controls: the original (not evaluated) control armature of the character.
        handles: handles of its board.
    """
    for handle in handles:
        controls.pose.bones[handle.bone].location = (0.0, 0.0, 0.0)
    controls.update_tag()


def places_of(controls: ArmatureObject, live: runtime.Runtime) -> dict[str, tuple[float, ...]]:
    """Locations of the existing handles, by bone.

    Args:
        controls: control armature of the character.
        live: Runtime of the character.
    """
    there = _handles_there(controls, live)
    bones = controls.pose.bones
    return {handle.bone: (*bones[handle.bone].location[:],) for handle in there}


def put_places(
    controls: ArmatureObject, live: runtime.Runtime, places: Mapping[str, tuple[float, ...]]
) -> None:
    """Set handles to stored locations.

    Args:
        controls: control armature of the character.
        live: Runtime of the character.
        places: locations by bone, from places_of; missing bones are ignored.
    """
    for handle in _handles_there(controls, live):
        if handle.bone in places:
            controls.pose.bones[handle.bone].location = places[handle.bone]
    controls.update_tag()


def mark(rig: ArmatureObject, sign: float) -> None:
    """Mark all handles before Blender pastes a pose, to find the handles that the paste changed.

    Args:
        rig: the character.
        sign: the mark, a value that no user sets; the mark is stored as z of each handle's
            location.
    """
    for handle in handles_in(rig):
        parts.controls_there(rig).pose.bones[handle.bone].location[2] = sign


def pasted_flipped(rig: ArmatureObject, sign: float) -> dict[str, float]:
    """Undo the flip of handles that Blender pasted flipped, and return their values by slider.

    Blender mirrors each location, but does not exchange left and right handles.

    Args:
        rig: the character; its board leads.
        sign: the mark that was passed to `mark`.
    """
    live, controls = runtime.there(rig), parts.controls_there(rig)
    labels: set[str] = set()
    for handle in _handles_there(controls, live):
        place = controls.pose.bones[handle.bone].location
        if abs(place[2] - sign) > _NEAR:
            place[0] = -place[0]
            labels |= {
                live.labels[i] for way in handle.axes for i in live.table.outputs_of(way.gui)
            }
    return {label: value for label, value in given(rig).items() if label in labels}


def is_same(one: runtime.Runtime, other: runtime.Runtime) -> bool:
    """Whether two faces have equal handles.

    Args:
        one, other: Runtimes of the faces.
    """
    return one.handles == other.handles


def is_selected(controls: ArmatureObject, bone: str) -> bool:
    """Whether a handle is selected.

    Args:
        controls: control armature.
        bone: name of the handle's bone, which must exist.
    """
    return compat.is_bone_selected(controls.pose.bones[bone])


def select(controls: ArmatureObject, bones: Iterable[str], extend: bool) -> None:
    """Select handles.

    Args:
        controls: control armature.
        bones: names of the handles' bones.
        extend: True: add to the selection; False: deselect all other bones.
    """
    chosen = set(bones)
    for bone in controls.pose.bones:
        if bone.name in chosen or not extend:
            compat.select_bone(bone, bone.name in chosen)


def path_of(bone: str) -> str:
    """The data path of a handle's location, from the armature.

    Args:
        bone: name of the handle's bone.
    """
    return f'pose.bones["{bpy.utils.escape_identifier(bone)}"].location'
