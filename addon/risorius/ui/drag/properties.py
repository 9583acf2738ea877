# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Settings of the drag tool; they belong to the window manager and are not saved."""

from typing import cast

import bpy

from ..blender_types import Context

METHODS = (
    (
        "NEAR",
        "Near",
        (
            "A few sliders that belong to the dragged part of the face: a "
            "dragged brow turns no eye. The point lags behind the pointer if "
            "these sliders do not reach the pointer"
        ),
    ),
    (
        "LEAST_SQUARES",
        "Exact",
        (
            "Smallest change of all sliders that brings the point to the pointer: many "
            "sliders move a little"
        ),
    ),
    (
        "TRANSPOSE",
        "Gentle",
        "Only sliders that move this point well; the point may lag behind the pointer",
    ),
)


def symmetric_property() -> object:
    """Define the property Symmetric, for the tool's settings and for the drag operator."""
    return bpy.props.BoolProperty(
        name="Symmetric",
        description="Mirror the drag on the other side of the face",
        options={"SKIP_SAVE"},
    )


def method_property() -> object:
    return bpy.props.EnumProperty(
        name="Method",
        description="Method that chooses the sliders that bring the dragged point to the pointer",
        items=METHODS,
        options={"SKIP_SAVE"},
    )


def region_property() -> object:
    return bpy.props.BoolProperty(
        name="Region Only",
        description="Move only sliders of the region of the dragged point",
        options={"SKIP_SAVE"},
    )


class RISORIUS_PG_drag(bpy.types.PropertyGroup):
    symmetric: symmetric_property()
    method: method_property()
    region: region_property()
    handles: bpy.props.BoolProperty(
        name="Show Handles",
        description=(
            "Show handles at the points that dragging moves farthest; you can drag "
            "any other point too"
        ),
        default=True,
        options={"SKIP_SAVE"},
    )
    heat: bpy.props.BoolProperty(
        name="Colour What Moves",
        description="Colour the skin by its motion during a drag",
        default=True,
        options={"SKIP_SAVE"},
    )


def choices_of(context: Context) -> RISORIUS_PG_drag:
    """The drag settings of the window manager."""
    return cast(RISORIUS_PG_drag, context.window_manager.risorius_drag)  # type: ignore[attr-defined]


CLASSES = (RISORIUS_PG_drag,)
