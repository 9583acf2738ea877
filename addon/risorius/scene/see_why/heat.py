# SPDX-License-Identifier: GPL-3.0-or-later
"""Shows heat maps: colours the vertices of a face by the length of their motion.

The colours are a colour attribute of the meshes, which the solid view shows, so materials are
unchanged. A property of the deforming armature stores the choice of the heat map, so that undo
restores it. Saved files contain no heat map.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter
from typing import cast

import bpy
import numpy as np
from numpy.typing import NDArray

from ... import native
from ...logic.base import heat_ramp
from ...logic.base.errors import FaceError
from ...logic.base.sentences import told
from ..animation import layers
from ..base import parts, saved, session
from ..base.blender_types import (
    ArmatureObject,
    Attribute,
    Depsgraph,
    MeshObject,
    current_context,
)
from ..character import runtime
from . import causes, displacement, heat_views, layer_share, present

KINDS = ("CONTROL", "POSE", "CORRECTIVE", "LAYER")
_LEAST = 0.01  # lower limit of the millimetres of the hottest colour, so that noise looks cold
# Session uid of a deforming armature -> values from which its colours were computed.
_shown: dict[int, object] = session.table("heat.shown", ("undo", "load"))
# Session uid of a deforming armature -> `kind` and `what` of the Heat that is removed for a save.
_held: dict[int, tuple[str, str]] = session.table("heat.held", ("load",))
_PAUSE = 0.15  # seconds, at least, between two checks whether the pose has changed


@dataclass(frozen=True)
class Heat:
    """The contents of a heat map.

    Attributes:
        kind: CONTROL: motion from neutral if one control changes from its rest value, which may
            differ from 0, to 1; POSE: distance of the current pose from neutral; CORRECTIVE,
            LAYER: motion that one corrective or layer adds to the pose.
        what: label of the control, index of the corrective, or index of the layer.
        most: largest motion in millimetres; it gets the hottest colour if it is 0.01 or more.
    """

    kind: str
    what: str
    most: float


def of(rig: ArmatureObject) -> Heat | None:
    """The heat map that a character shows, or None.

    Args:
        rig: the deforming armature.
    """
    kind, *rest = saved.text(rig, parts.HEAT).split("\n", 2)
    try:
        most, what = float(rest[0]), rest[1]
    except (ValueError, IndexError):
        return None
    return Heat(kind, what, most) if math.isfinite(most) else None


def show(rig: ArmatureObject, kind: str, what: str, depsgraph: Depsgraph) -> Heat:
    """Colour the meshes of a character, and let the 3D views show the colours.

    The choice is stored on the deforming armature, and a timer updates the colours from then on.

    Args:
        rig: the character's deforming armature.
        kind: "CONTROL", "POSE", "CORRECTIVE" or "LAYER".
        what: label of the control, index of the corrective, or index of the layer; not used for
            "POSE".
        depsgraph: graph for reading layers.

    Raises:
        FaceError: the character is baked or incomplete, the control, corrective or layer does not
            exist, or no mesh can be coloured.
    """
    now = present.of(rig)
    if now is None:
        raise FaceError(told("This face shows no controls now."))
    far = _distances(rig, now, kind, what, depsgraph)
    unit = displacement.millimetres(rig)
    most = max([float(f.max()) * unit for f in far.values() if len(f)], default=0.0)
    coloured = 0
    for item in parts.meshes_of(rig):
        values = far.get(int(item[parts.MESH]))
        if values is not None and _is_as_imported(item, len(values)):
            _write(item, values * unit / max(most, _LEAST))
            coloured += 1
        else:
            _take_off(item)
    if not coloured:
        raise FaceError(
            told(
                "No mesh of {name} has as many vertices as in the DNA file.",
                name=rig.name,
            )
        )
    heat = Heat(kind, what, most)
    rig[parts.HEAT] = "\n".join((kind, repr(most), what))
    _shown[rig.session_uid] = _state(now, kind)
    heat_views.show()
    watch()
    return heat


def _is_as_imported(item: MeshObject, count: int) -> bool:
    data = item.data
    is_ours = data.library is None and data.override_library is None
    return is_ours and item.mode != "EDIT" and len(data.vertices) == count


def _distances(
    rig: ArmatureObject, now: present.Present, kind: str, what: str, depsgraph: Depsgraph
) -> dict[int, NDArray[np.float64]]:
    """Index of a mesh -> float64[V], distances that the heat map shows, in Blender units.

    Args:
        rig: deforming armature.
        now: the face in its current pose.
        kind: "CONTROL", "POSE", "CORRECTIVE" or "LAYER".
        what: label of the control, index of the corrective, or index of the layer; not used for
            "POSE".
        depsgraph: graph for reading layers.
    """
    one, other = _pair(rig, now, kind, what, depsgraph)
    meshes = displacement.meshes_at(rig, now.lod)
    return {m: displacement.distances(now.live, m, one, other) for m in meshes}


def _pair(
    rig: ArmatureObject, now: present.Present, kind: str, what: str, depsgraph: Depsgraph
) -> tuple[causes.Poses, causes.Poses]:
    """The two poses whose difference a heat map shows.

    Args:
        rig: deforming armature.
        now: the face in its current pose.
        kind: "CONTROL", "POSE", "CORRECTIVE" or "LAYER".
        what: label of the control, index of the corrective, or index of the layer; not used for
            "POSE".
        depsgraph: graph for reading layers.
    """
    evaluate = now.live.rig.evaluate
    if kind == "CONTROL":
        if what not in now.live.labels:
            raise FaceError(told("{name} has no control {control}.", name=rig.name, control=what))
        raised = now.rests
        raised[now.live.labels.index(what)] = 1.0
        return _poses(evaluate(raised, now.lod)), _poses(evaluate(now.rests, now.lod))
    if kind == "POSE":
        return _poses(now.pose()), _poses(evaluate(now.rests, now.lod))
    if kind == "CORRECTIVE":
        here = _poses(evaluate(now.raw, now.lod))
        return here, causes.without(now, int(what))
    with_it, without_it = layer_share.raw_pair(rig, now.live, int(what), depsgraph)
    return _poses(evaluate(with_it, now.lod)), _poses(evaluate(without_it, now.lod))


def _poses(pose: native.Pose) -> causes.Poses:
    return pose.joints, pose.blend_shapes


def _state(now: present.Present, kind: str) -> object:
    """The values on which the colours of a heat map depend, compared to notice changes.

    These are the LOD and, for all kinds of heat maps except CONTROL, the raw controls, solo and
    mute.
    """
    return (now.lod, None) if kind == "CONTROL" else (now.lod, now.raw.tobytes(), now.look)


def _write(item: MeshObject, shares: NDArray[np.float64]) -> None:
    """Write the colours of a heat map as the active colour attribute of a mesh.

    Args:
        shares: float64[V], 0 for the coldest colour to 1 for the hottest.
    """
    held = item.data.color_attributes
    layer: Attribute = held.get(parts.HEAT)
    if layer is not None and (layer.domain != "POINT" or len(layer.data) != len(shares)):
        held.remove(layer)
        layer = None
    if layer is None:
        if parts.HEAT_BEFORE not in item.data:
            names = (held.active_color_name or "", held.default_color_name or "")
            item.data[parts.HEAT_BEFORE] = "\n".join(names)
        layer = held.new(parts.HEAT, "FLOAT_COLOR", "POINT")
    held.active_color_name = layer.name
    flat = heat_ramp.linear(heat_ramp.colours(shares)).ravel()
    layer.data.foreach_set("color", flat)
    item.data.update_tag()


def _take_off(item: MeshObject) -> None:
    """Remove the heat map from a mesh, and activate its earlier colour attributes again."""
    data = item.data
    held = data.color_attributes
    layer = held.get(parts.HEAT)
    if layer is not None:
        held.remove(layer)
        data.update_tag()
    if parts.HEAT_BEFORE in data:
        active, _end, default = saved.text(data, parts.HEAT_BEFORE).partition("\n")
        del data[parts.HEAT_BEFORE]
        if active in held:
            held.active_color_name = active
        if default in held:
            held.default_color_name = default


def hide(rig: ArmatureObject) -> bool:
    """Remove the heat map of a character.

    The settings of the 3D views are restored if no other face has a heat map.

    Args:
        rig: the character's deforming armature.

    Returns:
        Whether the character had a heat map.
    """
    had = rig.pop(parts.HEAT, None) is not None
    _shown.pop(rig.session_uid, None)
    for item in parts.meshes_of(rig):
        _take_off(item)
    if not any(parts.HEAT in other for other in parts.rigs()):
        heat_views.give_back()
    return had


def take_away() -> None:
    """Remove all heat maps before a file is saved; `give_back` restores them."""
    _held.clear()
    for rig in parts.rigs():
        heat = of(rig)
        if heat is not None:
            _held[rig.session_uid] = (heat.kind, heat.what)
            hide(rig)


def give_back(depsgraph: Depsgraph) -> None:
    """Restore the heat maps that `take_away` removed.

    Args:
        depsgraph: graph from which animation layers are read.
    """
    for rig in parts.rigs():
        kept = _held.pop(rig.session_uid, None)
        if kept is not None:
            _show_again(rig, *kept, depsgraph)
    _held.clear()


def end_all() -> None:
    """Remove all heat maps, before the add-on is disabled and after a file was loaded."""
    _held.clear()
    for rig in parts.rigs():
        if parts.HEAT in rig:
            hide(rig)
    _shown.clear()
    if bpy.app.timers.is_registered(_look):
        bpy.app.timers.unregister(_look)
    heat_views.give_back()


def follow_undo() -> None:
    """After undo and redo: let 3D views show vertex colours if there is still a heat map, else
    restore the settings of the views."""
    if any(parts.HEAT in rig for rig in parts.rigs()):
        heat_views.show()
        watch()
    else:
        heat_views.give_back()


def refresh(rig: ArmatureObject, depsgraph: Depsgraph) -> bool:
    """Update the colours of a character if its pose, LOD, solo or mute changed.

    The colours of a heat map of kind CONTROL depend on the LOD alone.

    Args:
        rig: the character's deforming armature, with a heat map.
        depsgraph: graph for reading layers.

    Returns:
        Whether the colours were out of date and were updated.
    """
    heat, now = of(rig), present.of(rig)
    if heat is None or now is None or _shown.get(rig.session_uid) == _state(now, heat.kind):
        return False
    _show_again(rig, heat.kind, heat.what, depsgraph)
    return True


def _show_again(rig: ArmatureObject, kind: str, what: str, depsgraph: Depsgraph) -> None:
    try:
        show(rig, kind, what, depsgraph)
    except (FaceError, ValueError, LookupError):
        hide(rig)  # the layer was removed, or the corrective has stopped firing


def watch() -> None:
    """Start the timer that updates the colours when a pose changes."""
    if not bpy.app.timers.is_registered(_look):
        bpy.app.timers.register(_look, first_interval=_PAUSE)


def _look() -> float | None:
    """The function of the timer: update the heat maps of faces whose pose has changed.

    The pause until the next call is at least three times the duration of the update, so that
    updates take at most a quarter of the time.

    Returns:
        Seconds until the next call; None ends the timer.
    """
    begin = perf_counter()
    shown = [rig for rig in parts.rigs() if parts.HEAT in rig]
    if not shown:
        return None
    if bpy.app.is_job_running("RENDER"):
        return _PAUSE
    layer = current_context().view_layer
    for rig in shown:
        if layer is not None and layer.depsgraph is not None:
            refresh(rig, cast(Depsgraph, layer.depsgraph))
    return max(_PAUSE, 3.0 * (perf_counter() - begin))


def title(rig: ArmatureObject, heat: Heat, called: Callable[[str], str] = str) -> str:
    """The title of a heat map, as a sentence.

    Args:
        rig: deforming armature of the face.
        heat: its heat map.
        called: function that returns the label of a control or corrective from its name.
    """
    if heat.kind == "POSE":
        return told("Moved from Neutral")
    if heat.kind == "CONTROL":
        return told("Reach of {name}", name=called(heat.what.rpartition(".")[2]))
    live, controls = runtime.of(rig), parts.controls_of(rig)
    if heat.kind == "CORRECTIVE":
        name = present.name_of(live, int(heat.what)) if live is not None else heat.what
        return told("Added by {name}", name=called(name))
    places = layers.places(controls) if controls is not None else ()
    name = places[int(heat.what)].name if int(heat.what) < len(places) else heat.what
    return told("Added by layer {name}", name=name)
