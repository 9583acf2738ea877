# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Operators on an existing face: reset, keys, shape mode, joints, overdrive, separation."""

from collections.abc import Collection

import bpy

from ... import native
from ...logic.base.errors import FaceError
from ...scene.animation import keying
from ...scene.base import parts
from ...scene.character import armatures, board, build, runtime
from ...scene.frame import evaluate
from ...scene.skinning import ordinary
from ...scene.upkeep import duplicates, library_overrides
from ..blender_types import Context, Operator, Result
from ..common import MODES, FaceOperator, face_controls, face_rig
from ..hand.base import HandOperator
from ..words import of_error, say


def _labels(context: Context, region: str = "") -> list[str]:
    face = face_controls(context).pose.bones[parts.FACE]
    return [
        label
        for label in runtime.there(face_rig(context)).labels
        if label in face and (not region or native.regions().of_slider(label) == region)
    ]


class RISORIUS_OT_reset(HandOperator, Operator):
    """Bring the controls and the bones of head, neck and eyes to rest"""

    bl_idname = "risorius.reset"
    bl_label = "Reset"

    region: bpy.props.StringProperty(
        name="Region",
        description="Region to change; empty: all regions",
        options={"SKIP_SAVE"},
    )

    def move(self, context: Context) -> Collection[str]:
        controls = face_controls(context)
        face, rig = controls.pose.bones[parts.FACE], face_rig(context)
        live = runtime.there(rig)
        led = board.leads(controls, live)
        labels = _labels(context, self.region)
        for i, label in enumerate(live.labels):
            if label in labels and not (led and live.table.reached[i]):
                face[label] = live.rests[i]
        if led:
            board.reset(controls, board.handles_in(rig, self.region))
        if not self.region:
            for bone in controls.pose.bones:
                if parts.BOARD not in bone.bone:
                    bone.matrix_basis.identity()
        controls.update_tag()
        return labels


class RISORIUS_OT_key(FaceOperator, Operator):
    """Insert keyframes on the controls at the current frame"""

    bl_idname = "risorius.key"
    bl_label = "Key"

    region: bpy.props.StringProperty(
        name="Region",
        description="Region to change; empty: all regions",
        options={"SKIP_SAVE"},
    )

    def execute(self, context: Context) -> Result:
        labels = _labels(context, self.region)
        bones = [] if self.region else keying.pose_of(face_controls(context)).bones
        try:
            count = keying.key(context, face_rig(context), labels, bones)
        except FaceError as error:
            self.report({"ERROR"}, of_error(error))
            return {"CANCELLED"}
        evaluate.bring_up(context, face_rig(context))
        frame = context.scene.frame_current
        self.report(
            {"INFO"}, say("{count} controls keyed at frame {frame}", count=count, frame=frame)
        )
        return {"FINISHED"}


class RISORIUS_OT_set_shape_mode(FaceOperator, Operator):
    """Choose how the face is shown: Direct, Live or real shape keys; edited keys are kept"""

    bl_idname = "risorius.set_shape_mode"
    bl_label = "Shapes"

    mode: bpy.props.EnumProperty(name="Shapes", description="Mode of the blend shapes", items=MODES)

    def execute(self, context: Context) -> Result:
        rig = face_rig(context)
        if any(item.mode == "EDIT" for item in parts.meshes_of(rig)):
            self.report({"ERROR"}, say("Leave edit mode first."))
            return {"CANCELLED"}
        if library_overrides.unlock_shapes(rig):
            self.report({"INFO"}, say("The linked meshes were copied into this file."))
        ordinary.leave(rig)
        for sentence in build.change_mode(rig, self.mode):
            self.report({"WARNING"}, sentence)
        rig.update_tag()
        evaluate.bring_up(context, rig)
        return {"FINISHED"}


class RISORIUS_OT_hide_joints(FaceOperator, Operator):
    """Hide the joints of this face: Direct mode does not pose hidden joints"""

    bl_idname = "risorius.hide_joints"
    bl_label = "Hide Joint Rig"

    def execute(self, context: Context) -> Result:
        rig = face_rig(context)
        armatures.hide_joints(rig)
        rig.select_set(False)
        evaluate.bring_up(context, rig)
        return {"FINISHED"}


class RISORIUS_OT_prepare_for_export(FaceOperator, Operator):
    """Pose the joints of this face and enable its armature modifiers, for exporters and scripts"""

    bl_idname = "risorius.prepare_for_export"
    bl_label = "Prepare for Export"

    enable: bpy.props.BoolProperty(
        name="Prepare",
        description="On: pose the joints. Off: return to Direct mode",
        default=True,
        options={"SKIP_SAVE"},
    )

    def execute(self, context: Context) -> Result:
        rig = face_rig(context)
        if self.enable:
            rig[parts.SKINNING] = "LIVE"
        else:
            rig.pop(parts.SKINNING, None)
        evaluate.bring_up(context, rig)
        if self.enable:
            self.report(
                {"INFO"}, say("Risorius poses the joint bones until you choose Direct again.")
            )
        return {"FINISHED"}


class RISORIUS_OT_set_overdrive(FaceOperator, Operator):
    """Allow values of the controls up to 1.5"""

    bl_idname = "risorius.set_overdrive"
    bl_label = "Overdrive"

    enable: bpy.props.BoolProperty(name="Overdrive", default=True, options={"SKIP_SAVE"})

    def execute(self, context: Context) -> Result:
        controls = face_controls(context)
        face = controls.pose.bones[parts.FACE]
        controls[parts.OVERDRIVE] = self.enable
        maximum = parts.maximum_of(controls)
        for label in _labels(context):
            limits = face.id_properties_ui(label)
            limits.update(max=maximum, soft_max=maximum)  # pyright: ignore  the stub says None
            face[label] = min(float(face[label]), maximum)
        controls.update_tag()
        context.view_layer.update()
        return {"FINISHED"}


class RISORIUS_OT_separate(FaceOperator, Operator):
    """Give a copied face its own materials, shapes and drivers"""

    bl_idname = "risorius.separate"
    bl_label = "Make Single User"

    def execute(self, context: Context) -> Result:
        for sentence in duplicates.separate(face_rig(context)):
            self.report({"INFO"}, sentence)
        context.view_layer.update()
        return {"FINISHED"}


CLASSES = (
    RISORIUS_OT_reset,
    RISORIUS_OT_key,
    RISORIUS_OT_set_shape_mode,
    RISORIUS_OT_hide_joints,
    RISORIUS_OT_prepare_for_export,
    RISORIUS_OT_set_overdrive,
    RISORIUS_OT_separate,
)
