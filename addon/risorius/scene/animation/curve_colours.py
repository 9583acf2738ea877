# SPDX-License-Identifier: GPL-3.0-or-later
"""Sorts the F-curves of a face into groups by region, and gives them the region's colour."""

from __future__ import annotations

import colorsys

import bpy

from ... import native
from ..base import compat, parts
from ..base.blender_types import ArmatureObject
from ..character import armatures

Colour = tuple[float, float, float]

_HUES = {
    "brow": 0.08,
    "eye": 0.55,
    "nose": 0.42,
    "cheek": 0.94,
    "mouth": 0.0,
    "jaw": 0.13,
    "tongue": 0.88,
    "teeth": 0.17,
    "neck": 0.3,
    "ear": 0.75,
    "other": 0.66,
}
_STEPS = 5  # number of shades, so that the curves of a region can be told apart


def colour_of(region: str, step: int = 0) -> Colour:
    """The colour of a region, red, green and blue from 0 to 1.

    Args:
        region: name of the region; an unknown name gives the colour of "other".
        step: number of a curve in its region, from 0; successive numbers get different saturation.
    """
    share = (step * 2 % _STEPS) / (_STEPS - 1)
    return colorsys.hsv_to_rgb(_HUES.get(region, _HUES["other"]), 0.75 - 0.3 * share, 0.95)


def label_of(path: str) -> str:
    """The slider that an F-curve moves, "" for other curves.

    Args:
        path: the curve's data path.
    """
    start, _, end = parts.property_path("@").partition("@")
    if not path.startswith(start) or not path.endswith(end):
        return ""
    return bpy.utils.unescape_identifier(path.removeprefix(start).removesuffix(end))


def colour_group(group: bpy.types.ActionGroup, region: str) -> None:
    """Give a group of F-curves the colour of a region.

    Args:
        group: group of F-curves in an action of the face.
        region: name of the region.
    """
    group.color_set = "CUSTOM"
    colour = colour_of(region)
    group.colors.normal = [0.55 * part for part in colour]  # dark: white names stay readable
    group.colors.select = [0.8 * part for part in colour]
    group.colors.active = colour


def colour_curve(curve: bpy.types.FCurve, label: str, step: int | None = None) -> None:
    """Give a new F-curve the colour of a slider's region, and its group too if that has no colour.

    Args:
        curve: F-curve of a slider, in its group.
        label: name of the slider.
        step: number of the curve in its region, from 0, which chooses the shade; None: the number
            of other curves in the group.
    """
    region = native.regions().of_slider(label)
    group = curve.group
    if group is not None:
        if group.color_set == "DEFAULT":
            colour_group(group, region)
        if step is None:
            step = len(group.channels) - 1
    curve.color_mode, curve.color = "CUSTOM", colour_of(region, step or 0)


def colour_action(controls: ArmatureObject, action: bpy.types.Action) -> int:
    """Sort the slider curves of an action into groups by region, and colour curves and groups.

    Args:
        controls: control armature of the face.
        action: any action; of an action with slots, the curves that move these controls.

    Returns:
        The number of coloured curves.
    """
    bag = compat.bag_for(action, controls)
    if bag is None:
        return 0
    found = [(curve, label_of(curve.data_path)) for curve in bag.fcurves]
    counts: dict[str, int] = {}
    for curve, label in ((c, name) for c, name in found if name):
        title = armatures.key_group(label)
        group = bag.groups.get(title) or bag.groups.new(title)
        if curve.group != group:
            curve.group = group
        colour_group(group, native.regions().of_slider(label))
        colour_curve(curve, label, counts.setdefault(title, 0))
        counts[title] += 1
    return sum(counts.values())
