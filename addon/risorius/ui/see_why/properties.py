# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""The settings of See Why, stored with the window manager."""

from collections.abc import Iterator
from typing import cast

import bpy

from ...logic.character import slider_words
from ...scene.base import parts
from ...scene.character import runtime
from ..blender_types import Context


def _labels(_self: bpy.types.PropertyGroup, given: bpy.types.Context, typed: str) -> Iterator[str]:
    """The names of the active face's sliders that match the words typed in the search field."""
    rig = parts.active_rig(cast(Context, given))
    live = runtime.of(rig) if rig is not None else None
    labels = live.labels if live is not None else ()
    return (label for label in labels if slider_words.matches(label, typed))


class RISORIUS_PG_why(bpy.types.PropertyGroup):
    """The settings of See Why."""

    control: bpy.props.StringProperty(
        name="Control",
        description=(
            "Slider to examine: See Why shows its reach and correctives, and Solo shows it alone"
        ),
        search=_labels,
        search_options={"SORT"},
    )
    show_graph: bpy.props.BoolProperty(
        name="Draw in the View",
        description="Draw the control and its correctives over the 3D view, with values",
    )


def choices(context: Context) -> RISORIUS_PG_why:
    """The settings of See Why. Args: context  context of Blender."""
    return cast(RISORIUS_PG_why, context.window_manager.risorius_why)  # type: ignore[attr-defined]


CLASSES = (RISORIUS_PG_why,)
