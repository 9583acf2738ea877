# SPDX-License-Identifier: GPL-3.0-or-later
"""The panels Face and Options of the sidebar tab Risorius."""

from ... import native
from ...logic.character import plans
from ...scene.base import parts, saved
from ...scene.base.blender_types import ArmatureObject
from ...scene.character import armatures, rig_placement, runtime
from ...scene.file import shape_key_head
from ...scene.hair import strands
from ...scene.lod import lods
from ...scene.skinning import conditions
from .. import words
from ..bake.panel import draw_late
from ..blender_types import Context, Panel, UILayout
from ..common import FaceOnlyPanel, FacePanel, active_controls, face_controls, face_rig
from ..drag import panel as drag_panel
from ..upkeep.panel import draw_trouble
from . import banner

_MOST_REASONS = 3  # most reasons why a face is not in Direct mode that the panel lists


class RISORIUS_PT_character(FacePanel, Panel):
    bl_idname = "RISORIUS_PT_character"
    bl_label = "Face"
    bl_order = 0

    def draw_header_preset(self, context: Context) -> None:
        """Draw the name of the face, if the banner shows a mode or the scene has several faces."""
        rig, controls = parts.active_rig(context), active_controls(context)
        if rig is None or controls is None:
            return
        if len(parts.rigs()) > 1 or banner.modes(context, rig, controls):
            words.show(self.layout, parts.title_of(rig))

    def draw(self, context: Context) -> None:
        layout = self.layout
        trouble = native.problem()
        if trouble:
            words.write(layout, trouble, "ERROR")
            return
        if draw_trouble(layout, context):
            return
        rig = parts.active_rig(context)
        # This is the first button, because the selected mesh is not a face yet.
        if parts.rig_of(context.object) is None and shape_key_head.head_of(context) is not None:
            layout.operator("risorius.make_rig", icon="SHAPEKEY_DATA")
        if rig is None:
            _draw_start(layout)
            return
        live = runtime.of(rig)
        controls = parts.controls_of(rig)
        if live is None or controls is None:
            return  # draw_trouble has shown the reason
        banner.draw(layout, context, rig, controls)
        row = layout.row(align=True)
        row.operator("risorius.reset", text="Reset", icon="LOOP_BACK").region = ""
        row.operator("risorius.key", text="Key All", icon="KEYFRAME_HLT").region = ""
        drag_panel.draw_button(layout, context)
        _draw_hint(layout, context)
        draw_late(layout, rig)
        for warning in plans.layer_warnings(live.rig.ignored_layers):
            words.write(layout, warning, "INFO")


def _draw_start(layout: UILayout) -> None:
    """Draw the steps from getting a face to animating it, while no face is active.

    Buttons of later steps are grey, and their tooltips name the step that must be done before.
    """
    if any(parts.rigs()):
        words.write(layout, "No face is selected: click on one.", "INFO")
    _draw_step(layout, words.say("1. Get a face"))
    layout.operator("risorius.add_character", text="Add a Face", icon="USER")
    layout.operator("risorius.import_dna", text="Import DNA", icon="IMPORT")
    layout.operator("risorius.make_rig_from_head", icon="MESH_MONKEY")
    _draw_step(layout, words.say("2. Move it"))
    words.write(layout, "Sliders, expressions and bones come with the face.")
    layout.operator("risorius.key", text="Key All", icon="KEYFRAME_HLT").region = ""
    _draw_step(layout, words.say("3. Animate it"))
    layout.operator("risorius.import_animation", icon="IMPORT")
    layout.operator("risorius.speak", icon="SPEAKER")


def _draw_step(layout: UILayout, text: str) -> None:
    layout.separator()
    words.show(layout, text)


def _draw_hint(layout: UILayout, context: Context) -> None:
    """Draw hints for a new face until the user hides them."""
    addon = context.preferences.addons.get(native.ADDON)
    if addon is not None and not getattr(addon.preferences, "hints", True):
        return
    box = layout.box()
    row = box.row()
    words.show(row, words.say("First Steps"), "LIGHT")
    row.operator("risorius.hide_hints", text="", icon="X")
    words.write(box, "The tool Drag the Face pulls at the skin.")
    words.write(box, "The button Key All keys the whole pose at this frame.")


def _draw_detail(layout: UILayout, rig: ArmatureObject) -> None:
    levels = lods.built(rig)
    if len(levels) < 2:
        return
    column = layout.column(align=True)
    auto = lods.by_distance(rig)
    for target, text, shown in (
        ("VIEWPORT", "Detail in the Viewport", lods.viewport_level(rig)),
        ("RENDER", "Detail in Renders", lods.render_level(rig)),
    ):
        # The label has its own line above the buttons, because up to eight buttons, one for each
        # level, leave no room for the label.
        column.label(text=text, text_ctxt=words.CONTEXT)
        row = column.row(align=True)
        row.active = not auto
        for level in levels:
            button = row.operator("risorius.set_lod", text=str(level), depress=level == shown)
            button.lod, button.target = level, target
    column.operator("risorius.set_lod_by_distance", depress=auto).enable = not auto
    if auto:
        for level in range(min(len(lods.distances(rig)), levels[-1])):
            column.prop(
                rig,
                f'["{parts.LOD_DISTANCES}"]',
                index=level,
                text=words.say("LOD {level} from", level=level + 1),
                translate=False,
            )


def _draw_shapes(layout: UILayout, rig: ArmatureObject) -> None:
    modes = {saved.text(m, parts.MODE) for m in parts.meshes_of(rig)}
    if rig.get(parts.SKINNING) != "LIVE":
        modes = {"AUTO" if mode == "LIVE" else mode for mode in modes}
    layout.label(text="Shapes", text_ctxt=words.CONTEXT)
    row = layout.row(align=True)
    for mode, text in (("AUTO", "Direct"), ("LIVE", "Live"), ("KEYS", "Keys")):
        row.operator("risorius.set_shape_mode", text=text, depress=mode in modes).mode = mode
    plan = conditions.known(rig)
    if plan is None or "AUTO" not in modes or not plan.why:
        return
    column = layout.column(align=True)
    column.label(text="Why Direct is off:", text_ctxt=words.CONTEXT)
    for sentence in plan.why[:_MOST_REASONS]:
        words.write(column, sentence)
    if armatures.joints_are_shown(rig):
        column.operator("risorius.hide_joints")


class RISORIUS_PT_options(FaceOnlyPanel, Panel):
    bl_idname = "RISORIUS_PT_options"
    bl_label = "Options"
    bl_order = 2
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Context) -> None:
        layout = self.layout
        rig, controls = face_rig(context), face_controls(context)
        addon = context.preferences.addons.get(native.ADDON)
        if addon is not None:
            layout.label(text="Left and Right", text_ctxt=words.CONTEXT)
            layout.row(align=True).prop(addon.preferences, "sides", expand=True)
        header, body = layout.panel("RISORIUS_PT_detail", default_closed=True)
        header.label(text="Detail and Shapes", text_ctxt=words.CONTEXT)
        if body is not None:
            _draw_detail(body, rig)
            _draw_shapes(body, rig)
        on = bool(controls.get(parts.OVERDRIVE))
        layout.operator("risorius.set_overdrive", depress=on).enable = not on
        if any(strands.cards(rig)):
            shown = strands.are_shown(rig)
            layout.operator("risorius.set_strands", depress=shown).enable = not shown
        attached = rig_placement.body_of(controls)
        body = "risorius.detach_body" if attached else "risorius.attach_body"
        layout.operator(body, icon="ARMATURE_DATA")
        layout.operator("risorius.separate", icon="UNLINKED")
        layout.operator("risorius.reload", icon="FILE_REFRESH")
        layout.operator("risorius.replace_dna", icon="FILEBROWSER")
        layout.operator("risorius.export_dna", icon="EXPORT")
        layout.operator("risorius.describe", icon="INFO")
        layout.prop(context.window_manager, "risorius_show_timing")
        render = context.scene.render
        if not render.use_lock_interface:
            layout.prop(
                render,
                "use_lock_interface",
                text="Lock Interface in Renders",
                text_ctxt=words.CONTEXT,
            )
        live = runtime.of(rig)
        if live is not None:
            column = layout.column(align=True)
            column.scale_y = 0.8
            words.show(
                column,
                words.say(
                    "{controls} controls, {joints} joints",
                    controls=len(live.labels),
                    joints=live.rig.joint_count,
                ),
            )
            words.show(
                column,
                words.say("{shapes} shapes", shapes=live.rig.blend_shape_count),
            )


CLASSES = (RISORIUS_PT_character, RISORIUS_PT_options)
