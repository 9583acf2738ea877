# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Operators of the face board."""

from collections.abc import Collection

import bpy

from ... import native
from ...logic.base import names
from ...scene.animation import board_keys, tweaks
from ...scene.base import parts
from ...scene.base.blender_types import ArmatureObject
from ...scene.character import armatures, board, board_bones, runtime, shown_keys
from ...scene.frame import evaluate
from ...scene.live import sessions
from ..blender_types import Context, Operator, Result
from ..common import FaceOperator, active_controls, face_controls, face_rig
from ..file import framing
from ..hand.base import HandOperator
from ..words import say

LEADERS = (
    ("SLIDERS", "Sliders", "The sliders in the panel Controls move the face"),
    ("BOARD", "Board", "The face board moves the face; the sliders show its values"),
)


KINDS = (
    (
        "PRIMARY",
        "Primary",
        (
            "Some 30 handles arranged like a face: brows, lids, gaze, nose, cheeks, "
            "mouth, jaw, tongue. Other controls keep their sliders"
        ),
    ),
    ("COMPLETE", "Complete", "A handle for each GUI control of the DNA file"),
)


def _regions(_self: object, _context: object) -> list[tuple[str, str, str]]:
    titles = native.regions().titles
    return [("ALL", "All", ""), *((region.upper(), title, "") for region, title in titles.items())]


class _Leading(FaceOperator):
    """Base of operators that may switch between moving the face by sliders and by the board.

    The operators are not available while a tweak of the face is active.
    """

    @classmethod
    def poll(cls, context: Context) -> bool:
        if not super().poll(context):
            return False
        if tweaks.of(face_controls(context)) is not None:
            cls.poll_message_set(say("A tweak is on: choose Done at the top of the tab first."))
            return False
        return True


class _OwnArmature(_Leading):
    """Base of operators that add or remove bones of the control armature."""

    @classmethod
    def poll(cls, context: Context) -> bool:
        if not super().poll(context):
            return False
        data = face_controls(context).data
        if data.library is not None or data.override_library is not None:
            cls.poll_message_set(
                say(
                    "The controls are linked: add the board in the file that contains the controls."
                )
            )
            return False
        return True


class _OnBoard(HandOperator):
    """Base of operators for a face whose sliders follow the face board."""

    @classmethod
    def poll(cls, context: Context) -> bool:
        if not super().poll(context):
            return False
        if not board.leads_face(face_rig(context)):
            cls.poll_message_set(say("The face board does not move this face: choose Board first."))
            return False
        return True


class RISORIUS_OT_add_board(_OwnArmature, Operator):
    """Add a face board beside the head, or restore its deleted handles"""

    bl_idname = "risorius.add_board"
    bl_label = "Add Face Board"

    kind: bpy.props.EnumProperty(
        name="Board",
        description=(
            "Kind of the new board; it replaces a board of the other kind, and the pose stays"
        ),
        items=KINDS,
        options={"SKIP_SAVE"},
    )

    @classmethod
    def description(
        cls, context: bpy.types.Context, properties: bpy.types.OperatorProperties
    ) -> str:
        """The tooltip of a button: the description of the kind of board that it adds, or "".

        Args:
            context: context of the button.
            properties: the operator's properties that the button sets.
        """
        tips = {kind: tip for kind, _name, tip in KINDS}
        text = tips.get(getattr(properties, "kind", ""), "")
        return bpy.app.translations.pgettext_tip(text) or text

    def execute(self, context: Context) -> Result:
        rig, controls = face_rig(context), face_controls(context)
        live = runtime.there(rig)
        old = live.board if board.is_there(controls, live) else None
        kind = self.kind if self.properties.is_property_set("kind") or old is None else old
        if kind == runtime.PRIMARY and not runtime.there(rig, kind).handles:
            kind = runtime.COMPLETE
            self.report(
                {"INFO"},
                say("No control has a name from the primary board: the complete board is used."),
            )
        if kind == runtime.COMPLETE and not runtime.there(rig, kind).handles:
            self.report({"ERROR"}, say("This file has no control that a board could move."))
            return {"CANCELLED"}
        if old is not None and old != kind:
            count = self._exchange(context, rig, kind)
        else:
            board.set_kind(controls, kind)
            count = board_bones.add(context, rig)
        if old is None:
            self._lead(rig)
        evaluate.bring_up(context, rig)
        if old != kind:
            _take_up(context, rig)
        self.report({"INFO"}, say("{count} handles on the face board", count=count))
        return {"FINISHED"}

    def _exchange(self, context: Context, rig: ArmatureObject, kind: str) -> int:
        """Replace the existing board by a board of another kind, and convert pose and keyframes.

        Returns the number of handles of the new board.
        """
        done = board_keys.exchange(context, rig, kind)
        lost = board_keys.lost(done.loss)
        if lost is not None:
            self.report({"WARNING"}, say(lost))
        return len(board.handles_in(rig))

    def _lead(self, rig: ArmatureObject) -> None:
        """Let a new board move the face, unless the sliders have keys."""
        if board_keys.animates_sliders(rig):
            self.report(
                {"INFO"},
                say(
                    "The sliders have keys and still move the face: choose Board to convert"
                    " the keys."
                ),
            )
            return
        lost = board_keys.lost(board_keys.switch(rig, by_board=True, with_keys=False).loss)
        if lost is not None:
            self.report({"WARNING"}, say(lost))


def _take_up(context: Context, rig: ArmatureObject) -> None:
    """Enter pose mode and show the new board beside the head.

    Nothing happens if the control armature is hidden or not selectable.
    """
    controls = parts.controls_there(rig)
    if not controls.visible_get() or controls.hide_select:
        return
    armatures.enter_pose_mode(context, controls)
    framing.show_with_board(context, rig)


class RISORIUS_OT_frame_board(FaceOperator, Operator):
    """Show head and face board beside each other, from the front"""

    bl_idname = "risorius.frame_board"
    bl_label = "Frame Face and Board"
    bl_options = {"REGISTER"}
    whole_face = False
    baked_too = True

    @classmethod
    def poll(cls, context: Context) -> bool:
        return super().poll(context) and _needs_board(
            cls, context, say("This face has no board: add one first.")
        )

    def execute(self, context: Context) -> Result:
        framing.show_with_board(context, face_rig(context))
        return {"FINISHED"}


class RISORIUS_OT_remove_board(_OwnArmature, Operator):
    """Remove the face board; its pose goes to the sliders, keys stay in their actions"""

    bl_idname = "risorius.remove_board"
    bl_label = "Remove Face Board"

    @classmethod
    def poll(cls, context: Context) -> bool:
        return super().poll(context) and _needs_board(cls, context, say("This face has no board."))

    def execute(self, context: Context) -> Result:
        rig = face_rig(context)
        if board.leads_face(rig):
            board_keys.switch(rig, by_board=False, with_keys=True)
        board_bones.remove(context, rig)
        shown_keys.show_some(face_controls(context))
        evaluate.bring_up(context, rig)
        return {"FINISHED"}


def _needs_board(cls: type[Operator], context: Context, missing: str) -> bool:
    """Whether the face has a board; if not, `missing` becomes the reason in the tooltip."""
    if _has_board(context):
        return True
    cls.poll_message_set(missing)
    return False


def _has_board(context: Context) -> bool:
    controls = active_controls(context)
    return controls is not None and board.is_there(controls, runtime.of(face_rig(context)))


class RISORIUS_OT_lead(_Leading, Operator):
    """Choose whether sliders or the board move the face; the pose is converted"""

    bl_idname = "risorius.lead"
    bl_label = "Lead"

    by: bpy.props.EnumProperty(
        name="By", description="Whether the sliders or the face board move the face", items=LEADERS
    )
    use_keys: bpy.props.BoolProperty(
        name="Convert Keys",
        description="Convert the keys in a copy of the action; the original is kept",
        default=True,
    )

    @classmethod
    def poll(cls, context: Context) -> bool:
        if not super().poll(context):
            return False
        if not _has_board(context):
            cls.poll_message_set(say("This face has no board: add one first."))
            return False
        if sessions.of(active_controls(context)) is not None:
            cls.poll_message_set(say("Live capture moves the sliders of this face: stop it first."))
            return False
        return True

    def execute(self, context: Context) -> Result:
        rig, by_board = face_rig(context), self.by == "BOARD"
        if board.leads_face(rig) == by_board:
            return {"CANCELLED"}
        done = board_keys.switch(rig, by_board, self.use_keys)
        evaluate.bring_up(context, rig)
        lost = board_keys.lost(done.loss)
        if lost is not None:
            self.report({"WARNING"}, say(lost))
        if done.kept is not None:
            self.report(
                {"INFO"},
                say(
                    "{curves} curves were converted; the unconverted action {action} was kept.",
                    curves=done.curves,
                    action=done.kept.name,
                ),
            )
        if done.idle:
            self.report(
                {"WARNING"},
                say(
                    "The keys of these actions have no effect now: {actions}.",
                    actions=names.listed(done.idle),
                ),
            )
        return {"FINISHED"}


class RISORIUS_OT_reset_board(_OnBoard, Operator):
    """Bring all handles of the face board, or the selected ones, to rest"""

    bl_idname = "risorius.reset_board"
    bl_label = "Reset Board"

    selected: bpy.props.BoolProperty(
        name="Selected Only", description="Only selected handles", options={"SKIP_SAVE"}
    )

    def move(self, context: Context) -> Collection[str] | None:
        rig, controls = face_rig(context), face_controls(context)
        chosen = board.handles_in(rig)
        if self.selected:
            chosen = [h for h in chosen if board.is_selected(controls, h.bone)]
        if not chosen:
            self.report({"WARNING"}, say("No handle of the board is selected."))
            return None
        board.reset(controls, chosen)
        live = runtime.there(rig)
        led = (live.table.outputs_of(way.gui) for h in chosen for way in h.axes)
        return {live.labels[i] for outputs in led for i in outputs}


class RISORIUS_OT_select_board(FaceOperator, Operator):
    """Select the handles of a region on the face board"""

    bl_idname = "risorius.select_board"
    bl_label = "Select on Board"

    region: bpy.props.EnumProperty(name="Region", items=_regions)
    extend: bpy.props.BoolProperty(
        name="Add to Selection", description="Add to the selection", options={"SKIP_SAVE"}
    )

    @classmethod
    def poll(cls, context: Context) -> bool:
        if not super().poll(context):
            return False
        if not _has_board(context):
            cls.poll_message_set(say("This face has no board: add one first."))
            return False
        return True

    def execute(self, context: Context) -> Result:
        rig, controls = face_rig(context), face_controls(context)
        region = "" if self.region == "ALL" else self.region.lower()
        chosen = [handle.bone for handle in board.handles_in(rig, region)]
        board.select(controls, chosen, self.extend)
        self.report({"INFO"}, say("{count} handles are selected", count=len(chosen)))
        return {"FINISHED"} if chosen else {"CANCELLED"}


CLASSES = (
    RISORIUS_OT_add_board,
    RISORIUS_OT_frame_board,
    RISORIUS_OT_remove_board,
    RISORIUS_OT_lead,
    RISORIUS_OT_reset_board,
    RISORIUS_OT_select_board,
)
