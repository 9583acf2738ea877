# SPDX-License-Identifier: GPL-3.0-or-later
"""Lists of the panel Layers: one line per layer, one line per fired reaction."""

from ...scene.animation import layer_properties, layers
from ...scene.base.blender_types import ArmatureObject
from .. import words
from ..blender_types import Context, Icon, UILayout, UIList
from .menus import ICONS


class RISORIUS_UL_layers(UIList):
    """One line per layer, the highest first."""

    def draw_item(
        self,
        context: Context,
        layout: UILayout,
        data: ArmatureObject,
        item: layer_properties.RISORIUS_PG_layer,
        icon: int,
        active_data: ArmatureObject,
        active_property: str,
    ) -> None:
        row = layout.row(align=True)
        row.active = not item.mute
        row.prop(item, "name", text="", emboss=False, icon=ICONS[item.kind])
        part = row.row(align=True)
        part.scale_x = 0.7
        part.prop(item, "weight", text="")
        row.prop(
            item, "solo", text="", emboss=False, icon="RADIOBUT_ON" if item.solo else "RADIOBUT_OFF"
        )
        tick: Icon = "CHECKBOX_DEHLT" if item.mute else "CHECKBOX_HLT"
        row.prop(item, "mute", text="", emboss=False, icon=tick, invert_checkbox=True)

    def filter_items(
        self, context: Context, data: ArmatureObject, property: str
    ) -> tuple[list[int], list[int]]:
        there = layers.of(data)
        shown = [0 if layer.removed else self.bitflag_filter_item for layer in layers.places(data)]
        order = [0] * len(shown)
        lines = [*reversed(there), *(y for y in layers.places(data) if y.removed)]
        for line, layer in enumerate(lines):
            order[layers.place_of(data, layer)] = line
        return shown, order


class RISORIUS_UL_reactions(UIList):
    """One line per fired reaction."""

    def draw_item(
        self,
        context: Context,
        layout: UILayout,
        data: ArmatureObject,
        item: layer_properties.RISORIUS_PG_reaction,
        icon: int,
        active_data: ArmatureObject,
        active_property: str,
    ) -> None:
        known = layers.known_reactions().get(item.name)
        split = layout.split(factor=0.52, align=True)
        if known:
            split.label(text=known.label, text_ctxt=words.CONTEXT)
        else:
            words.show(split, item.name)
        row = split.row(align=True)
        row.prop(item, "frame", text="", emboss=False)
        row.prop(item, "strength", text="", emboss=False)


CLASSES = (RISORIUS_UL_layers, RISORIUS_UL_reactions)
