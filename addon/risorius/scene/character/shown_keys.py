# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes keys of a face visible in the animation editors.

The editors show only the keys of selected objects and selected bones. Code that inserts keys calls
`show`, which extends the selection.
"""

from __future__ import annotations

from collections.abc import Iterable

from ..base import compat, parts, session
from ..base.blender_types import ArmatureObject, Context, current_context
from . import armatures

# Session uid of a control armature -> (session uid of its active action, number of slider keys in
# this action) at the last call of `note_edit`.
_counts: dict[int, tuple[int, int]] = session.table("shown_keys.counts", ("undo", "load"))


def show(controls: ArmatureObject, paths: Iterable[str]) -> None:
    """Make new keys of a face visible in the animation editors.

    The slider bone is selected if it is keyed; it is locked, so nobody moves it by accident.
    Outside pose mode the keyed bones of head and eyes are selected too, so that moving a column of
    keys moves their keys. In pose mode these bones are selected only if no keyed bone is selected
    yet. In every mode, keyed handles of a face board are selected only if no keyed handle is
    selected yet.

    Args:
        controls: control armature of the face.
        paths: keyed data paths of the armature.
    """
    show_object(current_context(), controls)
    bones = controls.pose.bones
    keyed = {path.split('"')[1] for path in paths if path.startswith("pose.bones")} & set(
        bones.keys()
    )
    if parts.FACE in keyed:
        compat.select_bone(bones[parts.FACE])
    handles = {name for name in keyed if parts.BOARD in controls.data.bones[name]}
    for name in keyed - handles if controls.mode != "POSE" else ():
        compat.select_bone(bones[name])
    for group in (handles, keyed):
        if not any(compat.is_bone_selected(bones[name]) for name in group):
            for name in group:
                compat.select_bone(bones[name])


def show_some(controls: ArmatureObject) -> None:
    """Select the slider bone if no bone is selected, because all keys would be hidden.

    Args:
        controls: control armature of a face.
    """
    bones = controls.pose.bones
    if not any(compat.is_bone_selected(bone) for bone in bones):
        compat.select_bone(bones[parts.FACE])


def show_object(context: Context, controls: ArmatureObject) -> None:
    """Add the control armature to the selection.

    If the active object is in pose mode, the control armature enters pose mode too.

    Args:
        context: a Blender context.
        controls: control armature of a face.
    """
    layer = context.view_layer
    if layer is None or controls.name not in layer.objects:
        return
    if not controls.select_get(view_layer=layer):
        controls.select_set(True, view_layer=layer)
    active = layer.objects.active
    if active is None:
        layer.objects.active = controls
    elif active.mode == "POSE" and controls.mode == "OBJECT":
        armatures.join_pose_mode(context, controls)


def note_edit(controls: ArmatureObject) -> None:
    """Make slider keys visible if Blender's operators inserted new slider keys.

    Args:
        controls: a control armature whose action was edited.
    """
    data = controls.animation_data
    action = data.action if data is not None else None
    uid, count = 0, 0
    if action is not None:
        start, uid = parts.property_path("")[:-3], action.session_uid
        curves = compat.curves_for(action, controls)
        count = sum(len(c.keyframe_points) for c in curves if c.data_path.startswith(start))
    before = _counts.get(controls.session_uid)
    _counts[controls.session_uid] = uid, count
    if before is None or count <= before[1] or before[0] not in (0, uid):
        return
    layer = current_context().view_layer
    if layer is not None and controls.name in layer.objects:
        controls.select_set(True, view_layer=layer)
    compat.select_bone(controls.pose.bones[parts.FACE])
