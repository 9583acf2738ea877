# SPDX-License-Identifier: GPL-3.0-or-later
"""Defines the layers of a character as properties, which Blender saves, copies and overrides.

Reactions are properties too: short animations that start (are fired) at a frame.
"""

# Blender reads properties from annotations, which pyright does not accept as types:
# pyright: reportInvalidTypeForm=false

from collections.abc import Callable, Iterable
from typing import Any

import bpy

from ... import native
from ...language import tables
from ...logic.animation import layer_rules

KINDS = (
    ("ACTION", "Action", "An action with keys of the controls"),
    ("EXPRESSION", "Expression", "A built-in pose"),
    ("IDLE", "Idle Life", "Random blinks, glances and small movements"),
)
BLENDS = (
    ("OVERRIDE", "Override", "Replace lower layers"),
    ("ADD", "Add", "Add the values of this layer to the values of the lower layers"),
    ("MAXIMUM", "Maximum", "Use the higher value: of this layer, or of the lower layers"),
)
EXTENDS = (
    ("HOLD", "Hold", "Hold the first frame before the start, and the last frame after the end"),
    (
        "HOLD_FORWARD",
        "Hold Forward",
        ("No effect before the start; hold the last frame after the end"),
    ),
    ("NOTHING", "Nothing", "No effect before the start and after the end"),
    ("REPEAT", "Repeat", "Repeat the animation before the start and after the end"),
)
REGIONS = tuple((r.upper(), title, "") for r, title in native.regions().titles.items())
INDEX = f"{layer_rules.COLLECTION}_index"
REACTIONS = "risorius_reactions"
_OVERRIDE: Any = {"LIBRARY_OVERRIDABLE"}


def _changed(self: bpy.types.PropertyGroup, _context: bpy.types.Context) -> None:
    """Tag the character for evaluation, which compiles changed layers again."""
    owner = self.id_data
    assert owner is not None
    owner.update_tag()


def _still(
    kind: Callable[..., Any], options: Iterable[str] = frozenset(), **given: object
) -> object:
    """A property that cannot have keys or drivers, because it lacks the option ANIMATABLE.

    Args:
        kind: function of bpy.props that makes the property.
        options: options of the property.
        given: further arguments of `kind`.
    """
    return kind(options=set(options), override=_OVERRIDE, update=_changed, **given)


class RISORIUS_PG_warp(bpy.types.PropertyGroup):
    """A warp point: a scene frame, and the frame of the layer's animation that plays at it."""

    frame: _still(
        bpy.props.FloatProperty,
        name="Frame",
        description="Frame of the scene that is pinned to a frame of the layer",
    )
    source: _still(
        bpy.props.FloatProperty,
        name="Shows",
        description=("Frame of the layer's animation that is pinned to a frame of the scene"),
    )


class RISORIUS_PG_reaction(bpy.types.PropertyGroup):
    """A reaction that is fired at a frame."""

    name: _still(bpy.props.StringProperty, name="Reaction")
    frame: _still(
        bpy.props.FloatProperty, name="Frame", description="Frame at which the reaction begins"
    )
    strength: _still(
        bpy.props.FloatProperty, name="Strength", default=1.0, min=0.0, max=1.0, subtype="FACTOR"
    )


class RISORIUS_PG_layer(bpy.types.PropertyGroup):
    """An animation layer, which is mixed over the keyframe animation of the controls."""

    name: bpy.props.StringProperty(name="Name", override=_OVERRIDE)
    kind: _still(bpy.props.EnumProperty, name="Source", items=KINDS)
    action: _still(
        bpy.props.PointerProperty,
        type=bpy.types.Action,
        name="Action",
        description="Action that the layer plays",
    )
    expression: _still(bpy.props.StringProperty, name="Expression")
    # Edition of the built-in expressions that the layer plays. The default is 1, because .blend
    # files from the time of edition 1 do not store it.
    edition: _still(bpy.props.IntProperty, name="Edition", default=1, min=1)
    seed: _still(
        bpy.props.IntProperty, name="Seed", description="Seed of the random movement", min=0
    )
    blend: _still(bpy.props.EnumProperty, name="Blend", items=BLENDS)
    weight: bpy.props.FloatProperty(
        name="Weight",
        description="Weight of the layer; the weight can have keys",
        default=1.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        override=_OVERRIDE,
        update=_changed,
    )
    regions: _still(
        bpy.props.EnumProperty,
        name="Regions",
        description="Regions that the layer moves; no region: all regions",
        items=REGIONS,
        options={"ENUM_FLAG"},
    )
    controls: _still(
        bpy.props.StringProperty,
        name="Controls",
        description=(
            "Controls that the layer moves, as names or patterns such as jawOpen "
            "mouth*; -name excludes a control"
        ),
    )
    start: _still(bpy.props.FloatProperty, name="Start", default=1.0, description="Frame")
    scale: _still(
        bpy.props.FloatProperty,
        name="Time Scale",
        description="Factor of the length: 2 plays at half the speed",
        default=1.0,
        min=0.01,
        max=100.0,
    )
    trim_start: _still(
        bpy.props.FloatProperty, name="Skip", description="Frames to skip at the start", min=0.0
    )
    trim_end: _still(
        bpy.props.FloatProperty, name="Cut", description="Frames to cut at the end", min=0.0
    )
    length: _still(
        bpy.props.FloatProperty,
        name="Length",
        description="Length of the layer in frames; 0: no end",
        min=0.0,
    )
    repeat: _still(bpy.props.FloatProperty, name="Repeat", default=1.0, min=0.01, max=1000.0)
    extend: _still(bpy.props.EnumProperty, name="Extend", items=EXTENDS)
    reverse: _still(bpy.props.BoolProperty, name="Reverse")
    fade_in: _still(bpy.props.FloatProperty, name="Fade In", description="Frames", min=0.0)
    fade_out: _still(bpy.props.FloatProperty, name="Fade Out", description="Frames", min=0.0)
    mute: _still(bpy.props.BoolProperty, name="Mute")
    solo: _still(
        bpy.props.BoolProperty,
        name="Solo",
        description="Play only this layer and other solo layers",
    )
    # Keys and drivers name a layer by its index in the collection. So the index must not change,
    # and order and removal are stored as properties.
    rank: _still(bpy.props.IntProperty, options={"HIDDEN"})
    removed: _still(bpy.props.BoolProperty, options={"HIDDEN"})
    warp: bpy.props.CollectionProperty(
        type=RISORIUS_PG_warp, override={*_OVERRIDE, "USE_INSERTION"}
    )


CLASSES = (RISORIUS_PG_warp, RISORIUS_PG_reaction, RISORIUS_PG_layer)


def register() -> None:
    """Add the properties to bpy.types.Object; CLASSES must be registered before."""
    insertable: Any = {*_OVERRIDE, "USE_INSERTION"}
    for name, kind in (
        (layer_rules.COLLECTION, RISORIUS_PG_layer),
        (REACTIONS, RISORIUS_PG_reaction),
    ):
        collection = bpy.props.CollectionProperty(type=kind, override=insertable)
        setattr(bpy.types.Object, name, collection)
        index = bpy.props.IntProperty(options=set(), override=_OVERRIDE)
        setattr(bpy.types.Object, f"{name}_index", index)
    bpy.types.Object.risorius_layer_rules = _still(  # pyright: ignore[reportAttributeAccessIssue]
        bpy.props.BoolProperty,
        name="Exclude Opposites",
        translation_context=tables.CONTEXT,
        description=(
            "On a face with layers, prevent that opposite controls act together: pressed lips "
            "close the jaw, a blink lowers wide lids"
        ),
        default=True,
    )


def unregister() -> None:
    """Remove the properties; their values in .blend files stay."""
    for name in (layer_rules.COLLECTION, REACTIONS):
        delattr(bpy.types.Object, name)
        delattr(bpy.types.Object, f"{name}_index")
    del bpy.types.Object.risorius_layer_rules  # pyright: ignore[reportAttributeAccessIssue]
