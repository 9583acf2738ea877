# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads custom properties of a .blend safely, because their values may have any type and size.

A value of another type or out of range counts as missing. Tables and arrays are copied, because
they point into Blender's memory, which is freed with the property.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from typing import cast

import bpy
from idprop.types import IDPropertyArray, IDPropertyGroup

_MOST = 2**31 - 1  # largest integer of a custom property


# The owner of a custom property: a datablock, a bone, or a table (a group of custom properties).
Owner = bpy.types.bpy_struct | Mapping[str, object]


def whole(owner: Owner, key: str, default: int, low: int = -_MOST, high: int = _MOST) -> int:
    """The whole number in a custom property.

    Args:
        owner: the datablock, bone or table with the property.
        key: name of the property.
        default: returned if the value is missing or out of range.
        low, high: the range, ends included.
    """
    found = owner.get(key)
    if isinstance(found, float) and found.is_integer():
        found = int(found)
    return int(found) if isinstance(found, int) and low <= found <= high else default


def number(
    owner: Owner,
    key: str,
    default: float,
    low: float = -sys.float_info.max,
    high: float = sys.float_info.max,
) -> float:
    """The finite number in a custom property.

    Args:
        owner: the datablock, bone or table with the property.
        key: name of the property.
        default: returned if the value is missing or out of range.
        low, high: the range, ends included.
    """
    found = owner.get(key)
    usable = isinstance(found, int | float) and math.isfinite(found) and low <= found <= high
    return float(cast("float", found)) if usable else default


def text(owner: Owner, key: str, default: str = "") -> str:
    """The string in a custom property.

    Args:
        owner: the datablock, bone or table with the property.
        key: name of the property.
        default: returned if the property is missing or no string.
    """
    found = owner.get(key)
    return found if isinstance(found, str) else default


def wholes(owner: Owner, key: str, low: int = -_MOST, high: int = _MOST) -> list[int]:
    """The whole numbers of a list property that are in a range; other entries are left out.

    Args:
        owner: the datablock, bone or table with the property.
        key: name of the property.
        low, high: the range, ends included.
    """
    return [n for n in _entries(owner, key) if type(n) is int and low <= n <= high]


def numbers(owner: Owner, key: str, low: float = -math.inf, high: float = math.inf) -> list[float]:
    """The finite numbers of a list property that are in a range; other entries are left out.

    Args:
        owner: the datablock, bone or table with the property.
        key: name of the property.
        low, high: the range, ends included.
    """
    found = [float(n) for n in _entries(owner, key) if isinstance(n, int | float)]
    return [n for n in found if math.isfinite(n) and low <= n <= high]


def texts(owner: Owner, key: str) -> list[str]:
    """The strings of a list property; other entries are left out.

    Args:
        owner: the datablock, bone or table with the property.
        key: name of the property.
    """
    return [word for word in _entries(owner, key) if isinstance(word, str)]


def table(owner: Owner, key: str) -> Mapping[str, object] | None:
    """A copy of a group of custom properties; None if missing.

    Args:
        owner: the datablock, bone or table with the property.
        key: name of the property.
    """
    found = owner.get(key)
    return (
        cast("dict[str, object]", found.to_dict()) if isinstance(found, IDPropertyGroup) else None
    )


def item(owner: Owner, key: str) -> bpy.types.Object | None:
    """The object that a property points to, or None.

    Args:
        owner: the datablock, bone or table with the property.
        key: name of the property.
    """
    found = owner.get(key)
    return found if isinstance(found, bpy.types.Object) else None


def length(owner: Owner, key: str) -> int:
    """The length of an array property; 0 if it is missing.

    Args:
        owner: the datablock, bone or table with the property.
        key: name of the property.
    """
    found = owner.get(key)
    return len(cast("list[float]", found)) if isinstance(found, IDPropertyArray) else 0


def _entries(owner: Owner, key: str) -> list[object]:
    found = owner.get(key)
    if isinstance(found, IDPropertyArray):
        return cast("list[object]", found.to_list())
    return cast("list[object]", found) if isinstance(found, list) else []
