# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Makes Blender's Paste Pose Flipped swap the sliders of a face too.

Blender swaps bones by L and R in their names. Sliders are properties of one bone, which Blender
pastes unchanged. So our operator has the shortcut of Blender's operator, and swaps the sliders too.
If Blender's operator is called from a menu, its paste is undone and our operator runs.
"""

from collections.abc import Collection
from typing import Any

import bpy
from bpy.app.handlers import persistent

from ... import native
from ...logic.character import slider_rows
from ...scene.base import parts, session
from ...scene.base.blender_types import ArmatureObject, current_context
from ...scene.character import board, sides
from ..blender_types import Context, Menu, Operator
from ..common import active_controls, face_controls, face_rig
from ..hand.base import HandOperator
from ..words import say

_MARK = 0.3215  # a marker value that no user sets
_BLENDERS = "POSE_OT_paste"
_keys: list[Any] = session.keep("paste_flipped.keys", list, ("unregister",))
# "last" -> (pointer, bl_idname) of the operator that `pasted_by_blender` has checked last;
# "selected" -> the setting On Selected Only of Blender's last flipped paste.
_seen: dict[str, object] = session.table("paste_flipped.seen", ("unregister",))


def _posed_controls(context: Context) -> ArmatureObject | None:
    """The control armature of the active face; None if this armature is not in pose mode."""
    controls = active_controls(context)
    return controls if controls is not None and context.pose_object == controls else None


class RISORIUS_OT_paste_pose_flipped(HandOperator, Operator):
    """Paste the copied pose with left and right swapped, including the sliders of the face"""

    bl_idname = "risorius.paste_pose_flipped"
    bl_label = "Paste Pose Flipped, with Sliders"

    selected: bpy.props.BoolProperty(
        name="On Selected Only", description="Paste only onto selected bones", default=False
    )

    @classmethod
    def poll(cls, context: Context) -> bool:
        if not super().poll(context):
            return False
        if _posed_controls(context) is None:
            cls.poll_message_set(say("Select the controls of a face and enter pose mode first."))
            return False
        return True

    def move(self, context: Context) -> Collection[str] | None:
        rig, controls = face_rig(context), face_controls(context)
        before, led = sides.hold(rig), board.leads_face(rig)
        face = controls.pose.bones[parts.FACE]
        for name in before.sliders:
            face[name] = _MARK
        if led:
            board.mark(rig, _MARK)
        tools = context.scene.tool_settings
        # With auto keying, Blender would insert keyframes when it pastes the sliders, before this
        # operator swaps left and right sliders.
        auto, tools.use_keyframe_insert_auto = tools.use_keyframe_insert_auto, False
        try:
            bpy.ops.pose.paste(flipped=True, selected_mask=self.selected)
        except RuntimeError as error:  # nothing was copied
            sides.restore(rig, before)
            self.report({"ERROR"}, str(error).strip().removeprefix("Error: "))
            return None
        finally:
            tools.use_keyframe_insert_auto = auto
        values = {name: float(face[name]) for name in before.sliders}
        pasted = {name: value for name, value in values.items() if not _is_mark(value)}
        if led:
            pasted = board.pasted_flipped(rig, _MARK)
        sides.restore(rig, before)
        sides.put(rig, slider_rows.flipped(pasted, native.regions()))
        return pasted


def _is_mark(value: float) -> bool:
    return abs(value - _MARK) < 1e-6


def _draw(self: Menu, context: Context) -> None:
    """Add this add-on's entries to Blender's menu Pose."""
    if _posed_controls(context) is not None:
        self.layout.separator()
        self.layout.operator("risorius.copy_pose", icon="COPYDOWN")
        self.layout.operator("risorius.paste_pose", icon="PASTEDOWN")
        self.layout.operator("risorius.paste_pose_flipped", icon="PASTEFLIPDOWN")
        self.layout.operator("risorius.mirror", icon="MOD_MIRROR")


def pasted_by_blender(manager: bpy.types.WindowManager) -> bool:
    """Whether Blender's last operator has pasted a pose flipped; True only once for each paste."""
    last = manager.operators[-1] if len(manager.operators) else None
    kind = last.bl_idname if last is not None else ""
    state = (last.as_pointer() if last is not None else 0, kind)
    if state == _seen.get("last"):
        return False
    _seen["last"] = state
    if last is None or kind != _BLENDERS or not last.properties.flipped:
        return False
    _seen["selected"] = last.properties.selected_mask
    return True


@persistent
def _updated(_scene: bpy.types.Scene, _depsgraph: object) -> None:
    manager = current_context().window_manager
    if pasted_by_blender(manager) and _posing_window(manager) is not None:
        bpy.app.timers.register(_once_more, first_interval=0.0)


def _posing_window(manager: bpy.types.WindowManager) -> bpy.types.Window | None:
    """The window whose active object is the control armature of a face in pose mode, or None."""
    for window in manager.windows:
        active = window.view_layer.objects.active
        rig = parts.rig_of(active)
        if active is None or rig is None:
            continue
        if active.mode == "POSE" and parts.controls_of(rig) == active:
            return window
    return None


def _once_more() -> None:
    """Undo Blender's paste and run this add-on's paste operator instead.

    Thus the user needs one undo step to revert the paste, not two.
    """
    context = current_context()
    window = _posing_window(context.window_manager)
    if window is None:
        return
    with context.temp_override(window=window):
        ours = bpy.ops.risorius.paste_pose_flipped  # pyright: ignore[reportAttributeAccessIssue]
        if not ours.poll():
            return  # Blender's paste stays
        if bpy.ops.ed.undo.poll():  # pyright: ignore[reportCallIssue]
            bpy.ops.ed.undo()
        ours("EXEC_DEFAULT", True, selected=bool(_seen.get("selected")))


def register() -> None:
    """Add the menu entries, the shortcuts, and the handler that notices Blender's operator."""
    bpy.types.VIEW3D_MT_pose.append(_draw)
    bpy.app.handlers.depsgraph_update_post.append(_updated)
    config = current_context().window_manager.keyconfigs.addon
    if config is not None:  # there is no key configuration without a window
        keymap = config.keymaps.new("Pose", space_type="EMPTY")
        for ctrl in (True, False):
            item = keymap.keymap_items.new(
                RISORIUS_OT_paste_pose_flipped.bl_idname,
                "V",
                "PRESS",
                shift=True,
                ctrl=ctrl,
                oskey=not ctrl,  # the Command key of a Mac
            )
            _keys.append((keymap, item))


def unregister() -> None:
    """Remove the menu entries, the shortcuts and the handlers."""
    for keymap, item in _keys:
        keymap.keymap_items.remove(item)
    _keys.clear()
    if _updated in bpy.app.handlers.depsgraph_update_post:
        bpy.app.handlers.depsgraph_update_post.remove(_updated)
    if bpy.app.timers.is_registered(_once_more):
        bpy.app.timers.unregister(_once_more)
    bpy.types.VIEW3D_MT_pose.remove(_draw)


CLASSES = (RISORIUS_OT_paste_pose_flipped,)
