# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Operators for solo, mute and heat maps."""

from dataclasses import replace

import bpy

from ... import native
from ...logic.base.errors import FaceError
from ...logic.base.sentences import told
from ...scene.frame import evaluate, look_masks
from ...scene.see_why import causes, heat
from ..blender_types import Context, Operator, Result
from ..common import FaceOperator, face_rig
from ..words import of_error, say
from .properties import choices
from .spoken import title

MUTED = (
    ("JOINTS", "Joints", "Keep all joints in the neutral pose"),
    ("SHAPES", "Shapes", "Keep all blend shapes at weight 0"),
    ("MAPS", "Maps", "Keep all animated maps at 0: no wrinkles, no blush"),
)


class RISORIUS_OT_solo(FaceOperator, Operator):
    """Show this control alone: the view shows all others at rest; their values and keys stay"""

    bl_idname = "risorius.solo"
    bl_label = "Solo"

    control: bpy.props.StringProperty(
        name="Control", description="Name of the slider; empty: the slider of See Why"
    )
    corrective: bpy.props.IntProperty(
        name="Corrective",
        description="Number of a corrective; show its controls instead of one control",
        default=-1,
        options={"HIDDEN", "SKIP_SAVE"},
    )
    extend: bpy.props.BoolProperty(
        name="Extend",
        description="Show this control in addition to the controls that are shown now",
        options={"SKIP_SAVE"},
    )

    def execute(self, context: Context) -> Result:
        rig = face_rig(context)
        name = self.control or choices(context).control
        names = [name]
        if self.corrective >= 0:
            names = causes.sliders_of(rig, self.corrective)
        elif causes.control_of(rig, name) < 0:
            self.report(
                {"ERROR"}, say("{name} has no control {control}.", name=rig.name, control=name)
            )
            return {"CANCELLED"}
        before = look_masks.of(rig).solo if self.extend else frozenset[str]()
        look_masks.solo(rig, before | set(names))
        evaluate.bring_up(context, rig)
        return {"FINISHED"}


class RISORIUS_OT_mute(FaceOperator, Operator):
    """Mute or unmute the joints, shapes or maps of the face in the view"""

    bl_idname = "risorius.mute"
    bl_label = "Mute"

    kind: bpy.props.EnumProperty(name="Kind", description="Part to mute", items=MUTED)
    enable: bpy.props.BoolProperty(name="Mute", description="On: mute. Off: unmute", default=True)

    def execute(self, context: Context) -> Result:
        rig = face_rig(context)
        look_masks.mute(rig, self.kind, self.enable)
        evaluate.bring_up(context, rig)
        return {"FINISHED"}


class RISORIUS_OT_show_all(FaceOperator, Operator):
    """Show the whole face again: end solo and mute"""

    bl_idname = "risorius.show_all"
    bl_label = "Show the Whole Face"

    def execute(self, context: Context) -> Result:
        rig = face_rig(context)
        look_masks.put(rig, look_masks.WHOLE)
        evaluate.bring_up(context, rig)
        return {"FINISHED"}


class RISORIUS_OT_mask_renders(FaceOperator, Operator):
    """Apply solo and mute in renders too"""

    bl_idname = "risorius.mask_renders"
    bl_label = "In Renders Too"

    enable: bpy.props.BoolProperty(
        name="In Renders Too", description="Apply in renders too", default=True
    )

    def execute(self, context: Context) -> Result:
        rig = face_rig(context)
        look_masks.put(rig, replace(look_masks.of(rig), in_renders=self.enable))
        return {"FINISHED"}


class RISORIUS_OT_heat(FaceOperator, Operator):
    """Colour the face by its motion; materials stay, and one click removes the colours"""

    bl_idname = "risorius.heat"
    bl_label = "Heat Map"

    kind: bpy.props.EnumProperty(
        name="Kind",
        description="The kind of motion that the colours show",
        items=(
            ("POSE", "From Neutral", "Distance of the current pose from the neutral pose"),
            (
                "CONTROL",
                "Reach of a Control",
                "Motion of the neutral face when one control goes to its full value",
            ),
            ("CORRECTIVE", "A Corrective", "Motion that a corrective adds to the current pose"),
            ("LAYER", "A Layer", "Motion that a layer adds to the current pose"),
            ("OFF", "Off", "Remove the colours; views return to their earlier shading"),
        ),
    )
    what: bpy.props.StringProperty(
        name="What",
        description=(
            "Name of the control, number of the corrective or position of the layer "
            "in the list; empty: the chosen control or layer"
        ),
    )

    def execute(self, context: Context) -> Result:
        rig = face_rig(context)
        if self.kind == "OFF":
            heat.hide(rig)
            return {"FINISHED"}
        what = self.what
        if not what and self.kind == "CONTROL":
            what = choices(context).control
        try:
            if self.kind in ("CORRECTIVE", "LAYER") and not what.isdigit():
                raise FaceError(told("Choose a corrective or a layer first."))
            shown = heat.show(rig, self.kind, what, context.evaluated_depsgraph_get())
        except native.user_errors() as error:
            self.report({"ERROR"}, of_error(error))
            return {"CANCELLED"}
        text = say("{what}: up to {most:.2f} mm", what=title(context, rig, shown), most=shown.most)
        self.report({"INFO"}, text)
        return {"FINISHED"}


CLASSES = (
    RISORIUS_OT_solo,
    RISORIUS_OT_mute,
    RISORIUS_OT_show_all,
    RISORIUS_OT_mask_renders,
    RISORIUS_OT_heat,
)
