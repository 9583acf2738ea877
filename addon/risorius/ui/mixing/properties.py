# SPDX-License-Identifier: GPL-3.0-or-later
# Blender takes properties where Python has annotations:
# pyright: reportInvalidTypeForm=false
"""Which faces are mixed, and how much of each; the preview follows."""

from typing import cast

import bpy

from ... import native
from ...scene.mixing import parents
from ..blender_types import Context
from ..common import system_path

REGIONS = ("brow", "eyes", "nose", "cheeks", "mouth", "jaw", "neck", "skull")


def _changed(_self: bpy.types.PropertyGroup, given: bpy.types.Context) -> None:
    follow(cast(Context, given))


_SHARE = {"min": 0.0, "max": 1.0, "subtype": "FACTOR", "update": _changed}
_HERE = "Share of this face in this region; the rest follows the whole mix"


class RISORIUS_PG_mix_parent(bpy.types.PropertyGroup):
    """A face that is mixed."""

    path: bpy.props.StringProperty(name="File", subtype="FILE_PATH")
    share: bpy.props.FloatProperty(
        name="Share", description="Share of this face in the whole mix", default=1.0, **_SHARE
    )
    show_regions: bpy.props.BoolProperty(
        name="Regions", description="Take some regions from this face", default=False
    )
    brow: bpy.props.FloatProperty(name="Brows", description=_HERE, **_SHARE)
    eyes: bpy.props.FloatProperty(name="Eyes", description=_HERE, **_SHARE)
    nose: bpy.props.FloatProperty(name="Nose", description=_HERE, **_SHARE)
    cheeks: bpy.props.FloatProperty(name="Cheeks", description=_HERE, **_SHARE)
    mouth: bpy.props.FloatProperty(name="Mouth", description=_HERE, **_SHARE)
    jaw: bpy.props.FloatProperty(name="Jaw", description=_HERE, **_SHARE)
    neck: bpy.props.FloatProperty(name="Neck", description=_HERE, **_SHARE)
    skull: bpy.props.FloatProperty(name="Skull", description=_HERE, **_SHARE)


class RISORIUS_PG_mix(bpy.types.PropertyGroup):
    """The user's settings, stored with the window."""

    parents: bpy.props.CollectionProperty(type=RISORIUS_PG_mix_parent)


def choices(context: Context) -> RISORIUS_PG_mix:
    """The user's settings.

    Args:
        context: Blender context.
    """
    return cast(RISORIUS_PG_mix, context.window_manager.risorius_mix)  # type: ignore[attr-defined]


def paths_of(context: Context) -> list[str]:
    """The files, absolute.

    Args:
        context: Blender context.
    """
    return [system_path(parent.path) for parent in choices(context).parents]


def shares_of(context: Context) -> tuple[list[float], dict[str, dict[int, float]]]:
    """Shares of the whole, and by region of the parents that have one there.

    Where the shares of a region are more than 1 together, they are made to be 1.

    Args:
        context: Blender context.
    """
    rows = list(choices(context).parents)
    regions: dict[str, dict[int, float]] = {}
    for region in REGIONS:
        own = {at: getattr(row, region) for at, row in enumerate(rows) if getattr(row, region) > 0}
        total = max(1.0, sum(own.values()))
        if own:
            regions[region] = {at: share / total for at, share in own.items()}
    return [row.share for row in rows], regions


def follow(context: Context) -> None:
    """Update the preview, if there is one, to the sliders.

    Args:
        context: Blender context.
    """
    if parents.preview(context) is None:
        return
    shares, regions = shares_of(context)
    paths = paths_of(context)
    if len(paths) > 0 and sum(shares) > 0:
        try:
            parents.show(context, paths, shares, regions)
        except (OSError, *native.user_errors()):
            parents.hide(context)  # a file is gone: buttons say so


CLASSES = (RISORIUS_PG_mix_parent, RISORIUS_PG_mix)
