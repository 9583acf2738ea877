# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Stores the faces to mix and their shares; a change updates the preview."""

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
_HERE = "Share of this face in this region; the rest of the region follows the whole mix"


class RISORIUS_PG_mix_parent(bpy.types.PropertyGroup):
    """A face of the mix: its DNA file, and its shares in the mix and in each region."""

    path: bpy.props.StringProperty(name="File", subtype="FILE_PATH")
    share: bpy.props.FloatProperty(
        name="Share", description="Share of this face in the whole mix", default=1.0, **_SHARE
    )
    show_regions: bpy.props.BoolProperty(
        name="Regions",
        description="Take only some regions of the new face from this face",
        default=False,
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
    """The user's settings of Mix Faces, stored with the window manager."""

    parents: bpy.props.CollectionProperty(type=RISORIUS_PG_mix_parent)


def choices(context: Context) -> RISORIUS_PG_mix:
    """The settings of Mix Faces.

    Args:
        context: context of Blender.
    """
    return cast(RISORIUS_PG_mix, context.window_manager.risorius_mix)  # type: ignore[attr-defined]


def paths_of(context: Context) -> list[str]:
    """The absolute paths of the DNA files to mix.

    Args:
        context: context of Blender.
    """
    return [system_path(parent.path) for parent in choices(context).parents]


def shares_of(context: Context) -> tuple[list[float], dict[str, dict[int, float]]]:
    """The share of each face in the whole mix, and the shares of faces in single regions.

    The second result is region -> index of a face -> share of this face in the region, with only
    shares above 0. If the shares of a region sum to more than 1, they are divided by their sum.

    Args:
        context: context of Blender.
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
    """Update the preview of the mix, if it exists, after a change of the faces or their shares.

    The preview stays unchanged while all shares are 0, and is removed if the DNA
    file of a face cannot be read.

    Args:
        context: context of Blender.
    """
    if parents.preview(context) is None:
        return
    shares, regions = shares_of(context)
    paths = paths_of(context)
    if len(paths) > 0 and sum(shares) > 0:
        try:
            parents.show(context, paths, shares, regions)
        except (OSError, *native.user_errors()):
            parents.hide(context)  # a file is missing; the operators report it


CLASSES = (RISORIUS_PG_mix_parent, RISORIUS_PG_mix)
