# SPDX-License-Identifier: GPL-3.0-or-later
"""The list of layers, and the operators on it."""

import bpy

from ..logic.animation import layer_rules as logic
from ..scene.animation import expressions, layer_properties, layers, layers_nla
from ..scene.base import parts
from ..scene.character import runtime
from ..scene.frame import evaluate
from . import words
from .operators import FaceOperator
from .panels import FaceOnlyPanel, write

_ICONS = {"ACTION": "ACTION", "EXPRESSION": "USER", "IDLE": "HIDE_OFF"}


def _controls(context):
    return parts.controls_of(parts.active_rig(context))


class LayerOperator(FaceOperator):
    """What all operators on the active layer share."""

    @classmethod
    def poll(cls, context):
        if not super().poll(context):
            return False
        if not len(layers.of(_controls(context))):
            cls.poll_message_set("This face has no layers.")
            return False
        return True

    @staticmethod
    def place(controls):
        """The active layer's place; the highest one's where none is active."""
        place, count = controls.risorius_layers_index, len(layers.places(controls))
        if 0 <= place < count and not layers.places(controls)[place].removed:
            return place
        return layers.place_of(controls, layers.of(controls)[-1])


class RISORIUS_OT_layer_add(FaceOperator, bpy.types.Operator):
    """Add a layer on top of the others, at the current frame"""

    bl_idname = "risorius.layer_add"
    bl_label = "Add Layer"

    kind: bpy.props.EnumProperty(
        name="Source", items=layer_properties.KINDS, options={"SKIP_SAVE"}, default="ACTION"
    )
    source: bpy.props.StringProperty(
        name="Name",
        description="Of the action or expression; empty: the face's active action, which then is "
        "no longer played by itself",
        options={"SKIP_SAVE"},
    )

    def execute(self, context):
        rig = parts.active_rig(context)
        controls, frame = parts.controls_of(rig), context.scene.frame_current
        if self.kind == "ACTION":
            return self._add_action(context, rig, controls)
        if self.kind == "EXPRESSION":
            known = expressions.all_expressions()
            if self.source not in known:
                self.report({"ERROR"}, f"There is no expression {self.source}.")
                return {"CANCELLED"}
            layers.add(controls, "EXPRESSION", known[self.source].label, expression=self.source)
        else:
            layers.add(controls, "IDLE", "Idle Life", start=frame, blend="MAXIMUM")
        evaluate.bring_up(context, rig)
        return {"FINISHED"}

    def _add_action(self, context, rig, controls):
        action = bpy.data.actions.get(self.source) if self.source else None
        data = controls.animation_data
        if action is None and not self.source and data is not None:
            action, data.action = data.action, None
            layers.keep_weights(controls, action)
        if action is None:
            self.report({"ERROR"}, f"There is no action {self.source or 'to make a layer of'}.")
            return {"CANCELLED"}
        layers.add_action(controls, action)
        evaluate.bring_up(context, rig)
        return {"FINISHED"}


class RISORIUS_OT_layer_remove(LayerOperator, bpy.types.Operator):
    """Remove the active layer and the keys of its weight; its action stays"""

    bl_idname = "risorius.layer_remove"
    bl_label = "Remove Layer"

    def execute(self, context):
        controls = _controls(context)
        layers.remove(controls, self.place(controls))
        evaluate.bring_up(context, parts.active_rig(context))
        return {"FINISHED"}


class RISORIUS_OT_layer_move(LayerOperator, bpy.types.Operator):
    """Move the active layer up or down; higher layers lie over lower ones"""

    bl_idname = "risorius.layer_move"
    bl_label = "Move Layer"

    up: bpy.props.BoolProperty(name="Up", options={"SKIP_SAVE"})

    def execute(self, context):
        controls = _controls(context)
        if not layers.move(controls, self.place(controls), self.up):
            return {"CANCELLED"}
        evaluate.bring_up(context, parts.active_rig(context))
        return {"FINISHED"}


class RISORIUS_OT_layer_duplicate(LayerOperator, bpy.types.Operator):
    """Put a copy of the active layer right above it"""

    bl_idname = "risorius.layer_duplicate"
    bl_label = "Duplicate Layer"

    def execute(self, context):
        controls = _controls(context)
        layers.duplicate(controls, self.place(controls))
        evaluate.bring_up(context, parts.active_rig(context))
        return {"FINISHED"}


class RISORIUS_OT_layer_warp(LayerOperator, bpy.types.Operator):
    """Pin what the active layer shows now to the current frame, or take all pins away"""

    bl_idname = "risorius.layer_warp"
    bl_label = "Warp Point"

    clear: bpy.props.BoolProperty(name="Clear", options={"SKIP_SAVE"})

    def execute(self, context):
        controls = _controls(context)
        layer = layers.places(controls)[self.place(controls)]
        if self.clear:
            layer.warp.clear()
        elif layer.kind != "ACTION" or layer.action is None:
            self.report({"ERROR"}, "Only a layer with an action has a time to warp.")
            return {"CANCELLED"}
        else:
            layers.add_warp_point(layer, context.scene.frame_current_final)
        controls.update_tag()
        evaluate.bring_up(context, parts.active_rig(context))
        return {"FINISHED"}


class RISORIUS_OT_fire(FaceOperator, bpy.types.Operator):
    """Fire a reaction at the current frame"""

    bl_idname = "risorius.fire"
    bl_label = "Fire"

    reaction: bpy.props.StringProperty(name="Reaction", default="flash", options={"SKIP_SAVE"})
    strength: bpy.props.FloatProperty(
        name="Strength", default=1.0, min=0.0, max=1.0, subtype="FACTOR"
    )

    def execute(self, context):
        if self.reaction not in layers.known_reactions():
            self.report({"ERROR"}, f"There is no reaction {self.reaction}.")
            return {"CANCELLED"}
        frame = context.scene.frame_current_final
        layers.fire(_controls(context), self.reaction, frame, self.strength)
        evaluate.bring_up(context, parts.active_rig(context))
        return {"FINISHED"}


class RISORIUS_OT_unfire(FaceOperator, bpy.types.Operator):
    """Take the active reaction away"""

    bl_idname = "risorius.unfire"
    bl_label = "Remove Reaction"

    @classmethod
    def poll(cls, context):
        return super().poll(context) and bool(len(layers.reactions_of(_controls(context))))

    def execute(self, context):
        controls = _controls(context)
        count = len(layers.reactions_of(controls))
        layers.unfire(controls, min(max(controls.risorius_reactions_index, 0), count - 1))
        evaluate.bring_up(context, parts.active_rig(context))
        return {"FINISHED"}


class RISORIUS_OT_layers_to_nla(LayerOperator, bpy.types.Operator):
    """Make NLA strips of the layers, as far as the NLA can say the same"""

    bl_idname = "risorius.layers_to_nla"
    bl_label = "Push Layers to NLA"

    def execute(self, context):
        rig = parts.active_rig(context)
        count, notes = layers_nla.push(context.scene, rig)
        evaluate.bring_up(context, rig)
        for note in notes:
            self.report({"WARNING"}, note)
        self.report({"INFO"}, f"{count} layers are NLA strips now")
        return {"FINISHED"} if count else {"CANCELLED"}


class RISORIUS_OT_expression(FaceOperator, bpy.types.Operator):
    """Move the sliders to an expression"""

    bl_idname = "risorius.expression"
    bl_label = "Expression"

    expression: bpy.props.StringProperty(name="Expression")
    strength: bpy.props.FloatProperty(
        name="Strength", default=1.0, min=0.0, max=1.0, subtype="FACTOR"
    )
    only: bpy.props.BoolProperty(name="Rest of the Face at Rest", default=True)
    key: bpy.props.BoolProperty(name="Key", description="At the current frame")

    def execute(self, context):
        rig = parts.active_rig(context)
        found = expressions.all_expressions().get(self.expression)
        if found is None:
            self.report({"ERROR"}, f"There is no expression {self.expression}.")
            return {"CANCELLED"}
        names = expressions.apply(rig, found, self.strength, self.only)
        if self.key:
            expressions.key(rig, names, context.scene.frame_current)
        evaluate.bring_up(context, rig)
        return {"FINISHED"}


class RISORIUS_OT_make_pose_assets(FaceOperator, bpy.types.Operator):
    """Make a pose asset of every expression, for Blender's pose library"""

    bl_idname = "risorius.make_pose_assets"
    bl_label = "Expressions as Pose Assets"

    def execute(self, context):
        made, notes = expressions.make_assets(parts.active_rig(context))
        for note in notes:
            self.report({"WARNING"}, note)
        self.report({"INFO"}, f"{len(made)} pose assets")
        return {"FINISHED"}


def _expressions_of(group):
    return [(e.name, e.label) for e in expressions.groups().get(group, ())]


def _expression_menu(group, title, operator):
    """A menu with one entry per expression of a group."""

    def draw(self, _context):
        for name, label in _expressions_of(group):
            button = self.layout.operator(operator, text=label)
            if operator == RISORIUS_OT_expression.bl_idname:
                button.expression = name
            else:
                button.kind, button.source = "EXPRESSION", name

    name = f"RISORIUS_MT_{'set' if operator == RISORIUS_OT_expression.bl_idname else 'add'}_{group}"
    return type(name, (bpy.types.Menu,), {"bl_idname": name, "bl_label": title, "draw": draw})


_GROUPS = (("emotion", "Emotions"), ("face", "Faces"), ("viseme", "Visemes"))
_ADD = [_expression_menu(g, t, RISORIUS_OT_layer_add.bl_idname) for g, t in _GROUPS]
_SET = [_expression_menu(g, t, RISORIUS_OT_expression.bl_idname) for g, t in _GROUPS]


class RISORIUS_MT_actions(bpy.types.Menu):
    bl_idname = "RISORIUS_MT_actions"
    bl_label = "Action"

    def draw(self, context):
        controls = _controls(context)
        for action in bpy.data.actions:
            if action.asset_data is None and layers.fits(controls, action):
                button = self.layout.operator(
                    RISORIUS_OT_layer_add.bl_idname, text=action.name, icon="ACTION"
                )
                button.kind, button.source = "ACTION", action.name


class RISORIUS_MT_layer_add(bpy.types.Menu):
    bl_idname = "RISORIUS_MT_layer_add"
    bl_label = "Add Layer"

    def draw(self, _context):
        layout = self.layout
        add = RISORIUS_OT_layer_add.bl_idname
        layout.operator(add, text="From Active Action", icon="ACTION").kind = "ACTION"
        layout.menu(RISORIUS_MT_actions.bl_idname, icon="ACTION")
        layout.operator(add, text="Idle Life", icon=_ICONS["IDLE"]).kind = "IDLE"
        layout.separator()
        for menu in _ADD:
            layout.menu(menu.bl_idname, icon=_ICONS["EXPRESSION"])


class RISORIUS_MT_expressions(bpy.types.Menu):
    bl_idname = "RISORIUS_MT_expressions"
    bl_label = "Expressions"

    def draw(self, _context):
        for menu in _SET:
            self.layout.menu(menu.bl_idname)
        self.layout.separator()
        self.layout.operator(RISORIUS_OT_make_pose_assets.bl_idname, icon="ASSET_MANAGER")


class RISORIUS_MT_fire(bpy.types.Menu):
    bl_idname = "RISORIUS_MT_fire"
    bl_label = "Fire"

    def draw(self, _context):
        for name, reaction in layers.known_reactions().items():
            button = self.layout.operator(RISORIUS_OT_fire.bl_idname, text=reaction.label)
            button.reaction = name


class RISORIUS_MT_layer_more(bpy.types.Menu):
    bl_idname = "RISORIUS_MT_layer_more"
    bl_label = "Layer Specials"

    def draw(self, _context):
        layout = self.layout
        layout.operator(RISORIUS_OT_layer_duplicate.bl_idname, icon="DUPLICATE")
        layout.operator(RISORIUS_OT_layer_warp.bl_idname, icon="MOD_TIME").clear = False
        layout.operator(
            RISORIUS_OT_layer_warp.bl_idname, text="Clear Warp Points", icon="X"
        ).clear = True
        layout.separator()
        layout.operator(RISORIUS_OT_layers_to_nla.bl_idname, icon="NLA")


class RISORIUS_UL_layers(bpy.types.UIList):
    """One line per layer, the highest first."""

    def draw_item(self, _context, layout, _data, item, _icon, _active, _property):
        row = layout.row(align=True)
        row.active = not item.mute
        row.prop(item, "name", text="", emboss=False, icon=_ICONS[item.kind])
        part = row.row(align=True)
        part.scale_x = 0.7
        part.prop(item, "weight", text="")
        row.prop(item, "solo", text="", emboss=False, icon="SOLO_ON" if item.solo else "SOLO_OFF")
        icon = "CHECKBOX_DEHLT" if item.mute else "CHECKBOX_HLT"
        row.prop(item, "mute", text="", emboss=False, icon=icon, invert_checkbox=True)

    def filter_items(self, _context, data, _name):
        there = layers.of(data)
        shown = [0 if layer.removed else self.bitflag_filter_item for layer in layers.places(data)]
        order = [0] * len(shown)
        lines = [*reversed(there), *(y for y in layers.places(data) if y.removed)]
        for line, layer in enumerate(lines):
            order[layers.place_of(data, layer)] = line
        return shown, order


class RISORIUS_UL_reactions(bpy.types.UIList):
    """One line per fired reaction."""

    def draw_item(self, _context, layout, _data, item, _icon, _active, _property):
        known = layers.known_reactions().get(item.name)
        split = layout.split(factor=0.52, align=True)
        split.label(text=known.label if known else item.name)
        row = split.row(align=True)
        row.prop(item, "frame", text="", emboss=False)
        row.prop(item, "strength", text="", emboss=False)


class RISORIUS_PT_layers(FaceOnlyPanel, bpy.types.Panel):
    bl_idname = "RISORIUS_PT_layers"
    bl_label = "Layers"
    bl_order = 1

    def draw(self, context):
        layout = self.layout
        rig = parts.active_rig(context)
        controls, live = parts.controls_of(rig), runtime.of(rig)
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
            for sentence in layers.problems(controls, live, context.scene):
                write(layout, sentence, "ERROR")
        _draw_reactions(layout, controls)
        if len(layers.of(controls)) or len(layers.reactions_of(controls)):
            layout.prop(controls, "risorius_layer_rules")


def _draw_side(column):
    column.menu(RISORIUS_MT_layer_add.bl_idname, text="", icon="ADD")
    column.operator(RISORIUS_OT_layer_remove.bl_idname, text="", icon="REMOVE")
    column.menu(RISORIUS_MT_layer_more.bl_idname, text="", icon="DOWNARROW_HLT")
    column.operator(RISORIUS_OT_layer_move.bl_idname, text="", icon="TRIA_UP").up = True
    column.operator(RISORIUS_OT_layer_move.bl_idname, text="", icon="TRIA_DOWN").up = False


def _draw_layer(layout, controls, layer):
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
    header.label(text="Time")
    if body is not None:
        _draw_time(body, layer)
    header, body = layout.panel("RISORIUS_PT_layer_mask", default_closed=True)
    header.label(text="Mask")
    if body is not None:
        grid = body.grid_flow(columns=3, align=True, even_columns=True)
        for region in layer_properties.REGIONS:
            grid.prop_enum(layer, "regions", region[0])
        body.prop(layer, "controls")


def _draw_time(layout, layer):
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


def _draw_reactions(layout, controls):
    row = layout.row(align=True)
    row.menu(RISORIUS_MT_fire.bl_idname, text="Fire a Reaction", icon="LIGHT_SUN")
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


CLASSES = (
    RISORIUS_OT_layer_add,
    RISORIUS_OT_layer_remove,
    RISORIUS_OT_layer_move,
    RISORIUS_OT_layer_duplicate,
    RISORIUS_OT_layer_warp,
    RISORIUS_OT_fire,
    RISORIUS_OT_unfire,
    RISORIUS_OT_layers_to_nla,
    RISORIUS_OT_expression,
    RISORIUS_OT_make_pose_assets,
    *_ADD,
    *_SET,
    RISORIUS_MT_actions,
    RISORIUS_MT_layer_add,
    RISORIUS_MT_expressions,
    RISORIUS_MT_fire,
    RISORIUS_MT_layer_more,
    RISORIUS_UL_layers,
    RISORIUS_UL_reactions,
    RISORIUS_PT_layers,
)
