# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Operators for animation by hand: next key, breakdown poses, tweaks, colours of curves."""

from collections.abc import Collection

import bpy

from ... import native
from ...logic.base.errors import FaceError
from ...scene.animation import curve_colours, keying, tweak_guard
from ...scene.base import compat, parts
from ...scene.frame import evaluate
from ...scene.hand import between
from ...scene.live import sessions
from ..blender_types import Context, Operator, Result
from ..common import FaceOperator, face_controls, face_rig
from ..words import of_error, say
from .base import HandOperator
from .favourites import favourites_of

_REACH = 0.3  # share of the window's width that brings the factor from its start value to 1
_AROUND = 12  # frames from the current frame to the first and to the last frame of a proposed tweak
_NONE = 0.5  # start factor of a breakdown: half way between the pose before and the pose after


def control_under_mouse(context: Context) -> str:
    """The name of the active face's slider that is under the mouse, or "".

    Args:
        context: context of a shortcut or of a button's context menu.
    """
    found = getattr(context, "property", None)
    if found is None or found[0] != parts.controls_of(face_rig(context)):
        return ""
    return curve_colours.label_of(found[1])


class RISORIUS_OT_next_key(FaceOperator, Operator):
    """Go to the next key of the control under the mouse, or of the face or region"""

    bl_idname = "risorius.next_key"
    bl_label = "Next Key of This Control"
    bl_options = {"REGISTER"}
    baked_too = True

    forward: bpy.props.BoolProperty(
        name="Forward",
        description="On: go to the next key. Off: go to the previous key",
        default=True,
        options={"SKIP_SAVE"},
    )
    control: bpy.props.StringProperty(
        name="Control",
        description="Control whose next key is found; empty: all controls of the region",
        options={"SKIP_SAVE"},
    )
    region: bpy.props.StringProperty(
        name="Region",
        description="Region whose next key is found; empty: the whole face",
        options={"SKIP_SAVE"},
    )

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        if not self.control and not self.region:
            self.control = control_under_mouse(context)
        return self.execute(context)

    def execute(self, context: Context) -> Result:
        controls, paths = face_controls(context), None
        if self.control:
            paths = {parts.property_path(self.control)}
        elif self.region:
            paths = between.paths_of(controls, _of_region(context, self.region), bones=False)
        frame = context.scene.frame_current_final
        found = between.next_key(controls, frame, self.forward, paths)
        if found is None:
            self.report({"INFO"}, say("There are no more keys in this direction."))
            return {"CANCELLED"}
        context.scene.frame_set(int(found // 1), subframe=found % 1)
        return {"FINISHED"}


def _of_region(context: Context, region: str) -> list[str]:
    of_slider = native.regions().of_slider
    sliders = keying.pose_of(face_controls(context)).sliders
    return [name for name in sliders if not region or of_slider(name) == region]


class RISORIUS_OT_breakdown(HandOperator, Operator):
    """Set a pose between the poses before and after; move the mouse, click to keep the pose"""

    bl_idname = "risorius.breakdown"
    bl_label = "Breakdowner"
    bl_options = {"REGISTER", "UNDO", "BLOCKING"}

    kind: bpy.props.EnumProperty(
        name="Towards",
        items=(
            (
                "BREAKDOWN",
                "Breakdown",
                ("Place of the new pose: 0 is the pose before, 1 is the pose after"),
            ),
            (
                "NEIGHBOURS",
                "Relax",
                (
                    "Move the pose towards the line between the poses before and after; "
                    "below 0: away from the line"
                ),
            ),
            ("REST", "Rest", "Move the pose towards rest; below 0: away from rest"),
        ),
    )
    factor: bpy.props.FloatProperty(
        name="Factor", default=0.5, min=-2.0, max=2.0, soft_min=-1.0, soft_max=1.0, subtype="FACTOR"
    )
    which: bpy.props.EnumProperty(
        name="Controls",
        items=(
            ("ALL", "All", "All sliders and the bones of head and eyes"),
            ("REGION", "Region", "The sliders of a region"),
            ("SELECTED", "Selected Curves", "Curves that are selected in the animation editors"),
            ("FAVOURITES", "Favourites", "The sliders with a star"),
        ),
        options={"SKIP_SAVE"},
    )
    region: bpy.props.StringProperty(
        name="Region",
        description="Region to change; empty: all regions",
        options={"SKIP_SAVE"},
    )

    def stand_at(self, frame: float) -> None:
        self._frame = frame

    def _paths(self, context: Context) -> set[str]:
        controls = face_controls(context)
        if self.which == "SELECTED":
            return between.selected_paths(controls)
        if self.which == "FAVOURITES":
            return between.paths_of(controls, favourites_of(context), bones=False)
        region = self.region if self.which == "REGION" else ""
        names = _of_region(context, region)
        return between.paths_of(controls, names, bones=self.which == "ALL")

    def move(self, context: Context) -> Collection[str]:
        rig, controls = face_rig(context), face_controls(context)
        now, paths, factor = keying.pose_of(controls), self._paths(context), self.factor
        if self.kind == "REST":
            return between.move(rig, now, between.rest_pose(rig, now), factor, paths)
        # A control without an F-curve has no key before or after the frame, so it is left out.
        paths &= set(keying.curves_by_path(controls))
        skipped = keying.selected_frames(controls) if self.at == "SELECTED" else ()
        found = between.neighbours(controls, self._frame, now, paths, skipped)
        if self.kind == "BREAKDOWN":
            return between.move(
                rig, now, between.mixed(found.before, found.after, factor), 1, paths
            )
        goal = between.mixed(found.before, found.after, found.share)
        return between.move(rig, now, goal, factor, paths)

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        if context.area is None or self.at == "SELECTED":
            return self.execute(context)
        self._start = keying.pose_of(face_controls(context))
        self._frame = context.scene.frame_current_final
        self._mouse = event.mouse_x
        self._from = _NONE if self.kind == "BREAKDOWN" else 0.0
        self.factor = self._from
        if not self._preview(context):
            return {"CANCELLED"}
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def _preview(self, context: Context) -> bool:
        """Show the breakdown pose at the current factor.

        Returns False after an error, which is reported.
        """
        keying.show(face_controls(context), self._start)
        try:
            self.move(context)
        except FaceError as error:
            self.report({"ERROR"}, of_error(error))
            return False
        evaluate.bring_up(context, face_rig(context))
        if context.area is not None:
            text = say(
                "{percent} %: click to keep, Esc to cancel", percent=round(self.factor * 100)
            )
            context.area.header_text_set(text)
            context.area.tag_redraw()
        return True

    def modal(self, context: Context, event: bpy.types.Event) -> Result:
        if event.type == "MOUSEMOVE":
            width = context.window.width if context.window is not None else 1000
            moved = (event.mouse_x - self._mouse) / (width * _REACH)
            factor = min(max(self._from + moved * (1 - self._from), -1.0), 1.5)
            self.factor = round(factor, 1) if event.ctrl else factor
            self._preview(context)
        elif event.type in {"LEFTMOUSE", "RET", "NUMPAD_ENTER"} and event.value == "PRESS":
            self._leave(context)
            return self.execute(context)
        elif event.type in {"RIGHTMOUSE", "ESC"}:
            self._leave(context)
            evaluate.bring_up(context, face_rig(context))
            return {"CANCELLED"}
        return {"RUNNING_MODAL"}

    def _leave(self, context: Context) -> None:
        keying.show(face_controls(context), self._start)
        if context.area is not None:
            context.area.header_text_set(None)


def proposed_range(context: Context) -> tuple[int, int]:
    """The proposed first and last frame of a tweak.

    The proposal is the range of the selected keyframes, if they are at two or more frames, but not
    at all frames with keyframes, as after an import. Otherwise it is the preview range, or without
    one the range from 12 frames before to 12 frames after the current frame.

    Args:
        context: context with the face and the scene.
    """
    controls, scene = face_controls(context), context.scene
    selected = keying.selected_frames(controls)
    if len(selected) > 1 and len(selected) < len(between.key_frames(controls)):
        return round(selected[0]), round(selected[-1])
    if scene.use_preview_range:
        return scene.frame_preview_start, scene.frame_preview_end
    return scene.frame_current - _AROUND, scene.frame_current + _AROUND


class RISORIUS_OT_tweak(FaceOperator, Operator):
    """Tweak a range of frames in a separate layer; keys stay; press again to end the tweak"""

    bl_idname = "risorius.tweak"
    bl_label = "Tweak over a Range"

    enable: bpy.props.BoolProperty(name="Tweak", default=True, options={"SKIP_SAVE"})
    first: bpy.props.IntProperty(name="First Frame", default=1)
    last: bpy.props.IntProperty(name="Last Frame", default=25)
    fade: bpy.props.FloatProperty(
        name="Fade",
        description="Number of frames in which the tweak fades in and out",
        default=5.0,
        min=0.0,
    )

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        if not self.enable:
            return self.execute(context)
        self.first, self.last = proposed_range(context)
        return context.window_manager.invoke_props_dialog(self)

    def execute(self, context: Context) -> Result:
        controls = face_controls(context)
        if self.enable and sessions.of(controls) is not None:
            self.report(
                {"ERROR"}, say("Live capture moves the sliders of this face: stop it first.")
            )
            return {"CANCELLED"}
        try:
            if self.enable:
                tweak_guard.begin(controls, self.first, self.last, self.fade)
            else:
                tweak_guard.end(controls)
        except FaceError as error:
            self.report({"ERROR"}, of_error(error))
            return {"CANCELLED"}
        evaluate.bring_up(context, face_rig(context))
        return {"FINISHED"}


class RISORIUS_OT_colour_curves(FaceOperator, Operator):
    """Sort the F-curves of the face into groups by region; each group gets a colour"""

    bl_idname = "risorius.colour_curves"
    bl_label = "Colour Curves by Region"
    baked_too = True

    def execute(self, context: Context) -> Result:
        controls = face_controls(context)
        actions = [a for a in compat.played_actions(controls) if a.library is None]
        count = sum(curve_colours.colour_action(controls, action) for action in actions)
        if not count:
            self.report({"WARNING"}, say("The sliders of this face have no F-curves."))
            return {"CANCELLED"}
        self.report({"INFO"}, say("{count} curves have the colours of their regions", count=count))
        return {"FINISHED"}


CLASSES = (
    RISORIUS_OT_next_key,
    RISORIUS_OT_breakdown,
    RISORIUS_OT_tweak,
    RISORIUS_OT_colour_curves,
)
