# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel Layers: lists of layers and reactions, and settings of the active layer."""

from ...logic.animation import layer_rules as logic
from ...scene.animation import layer_mixing, layer_properties, layers
from ...scene.base.blender_types import ArmatureObject
from ...scene.character import runtime
from .. import words
from ..blender_types import Context, Panel, UILayout
from ..common import FaceOnlyPanel, face_controls, face_rig
from .menus import RISORIUS_MT_fire, RISORIUS_MT_layer_add, RISORIUS_MT_layer_more
from .operators import (
    LayerOperator,
    RISORIUS_OT_layer_move,
    RISORIUS_OT_layer_remove,
    RISORIUS_OT_unfire,
)


class RISORIUS_PT_layers(FaceOnlyPanel, Panel):
    bl_idname = "RISORIUS_PT_layers"
    bl_label = "Layers"
    bl_order = 1
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Context) -> None:
        layout = self.layout
        rig = face_rig(context)
        controls, live = face_controls(context), runtime.of(rig)
        if live is None:
            return
        row = layout.row()
        row.template_list(
            "RISORIUS_UL_layers",
            "",
            controls,
            logic.COLLECTION,
            controls,
            layer_properties.INDEX,
            rows=4,
        )
        _draw_side(row.column(align=True))
        if len(layers.of(controls)):
            _draw_layer(layout, controls, layers.places(controls)[LayerOperator.place(controls)])
            for sentence in layer_mixing.problems(controls, live, context.scene):
                words.write(layout, sentence, "ERROR")
        _draw_reactions(layout, controls)
        if len(layers.of(controls)) or len(layers.reactions_of(controls)):
            layout.prop(controls, "risorius_layer_rules")


def _draw_side(column: UILayout) -> None:
    column.menu(RISORIUS_MT_layer_add.bl_idname, text="", icon="ADD")
    column.operator(RISORIUS_OT_layer_remove.bl_idname, text="", icon="REMOVE")
    column.menu(RISORIUS_MT_layer_more.bl_idname, text="", icon="DOWNARROW_HLT")
    column.operator(RISORIUS_OT_layer_move.bl_idname, text="", icon="TRIA_UP").up = True
    column.operator(RISORIUS_OT_layer_move.bl_idname, text="", icon="TRIA_DOWN").up = False


def _draw_layer(
    layout: UILayout, controls: ArmatureObject, layer: layer_properties.RISORIUS_PG_layer
) -> None:
    column = layout.column()
    column.use_property_split = True
    column.use_property_decorate = False
    if layer.kind == "ACTION":
        column.prop(layer, "action")
    elif layer.kind == "IDLE":
        column.prop(layer, "seed")
    column.prop(layer, "blend")
    row = column.row()
    row.use_property_decorate = True
    row.prop(layer, "weight")
    header, body = layout.panel("RISORIUS_PT_layer_time", default_closed=True)
    header.label(text="Time", text_ctxt=words.CONTEXT)
    if body is not None:
        _draw_time(body, layer)
    header, body = layout.panel("RISORIUS_PT_layer_mask", default_closed=True)
    header.label(text="Mask", text_ctxt=words.CONTEXT)
    if body is not None:
        grid = body.grid_flow(columns=3, align=True, even_columns=True)
        for region in layer_properties.REGIONS:
            grid.prop_enum(layer, "regions", region[0])
        body.prop(layer, "controls")


def _draw_time(layout: UILayout, layer: layer_properties.RISORIUS_PG_layer) -> None:
    column = layout.column(align=True)
    column.use_property_split = True
    column.use_property_decorate = False
    warped = len(layer.warp) > 1
    if layer.kind == "ACTION" and not warped:
        column.prop(layer, "start")
        column.prop(layer, "trim_start")
        column.prop(layer, "trim_end")
        column.prop(layer, "scale")
        column.prop(layer, "repeat")
        column.prop(layer, "reverse")
    elif not warped:
        column.prop(layer, "start")
        words.prop_or(column, layer, "length", 0.0, "0: without an end")
    for point in layer.warp:
        row = column.row(align=True)
        row.use_property_split = False
        row.prop(point, "frame")
        row.prop(point, "source")
    column.prop(layer, "extend")
    column.prop(layer, "fade_in")
    column.prop(layer, "fade_out")


def _draw_reactions(layout: UILayout, controls: ArmatureObject) -> None:
    row = layout.row(align=True)
    row.menu(
        RISORIUS_MT_fire.bl_idname,
        text="Fire a Reaction",
        text_ctxt=words.CONTEXT,
        icon="LIGHT_SUN",
    )
    if not len(layers.reactions_of(controls)):
        return
    row = layout.row()
    row.template_list(
        "RISORIUS_UL_reactions",
        "",
        controls,
        layer_properties.REACTIONS,
        controls,
        f"{layer_properties.REACTIONS}_index",
        rows=2,
    )
    row.operator(RISORIUS_OT_unfire.bl_idname, text="", icon="REMOVE")


CLASSES = (RISORIUS_PT_layers,)
