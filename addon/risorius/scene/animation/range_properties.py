# SPDX-License-Identifier: GPL-3.0-or-later
"""Defines the capture ranges of a face as properties, which Blender saves and overrides.

The capture range of a control has two captured values, which are converted to 0 and 1.
"""

# Blender reads properties from annotations, which pyright does not accept as types:
# pyright: reportInvalidTypeForm=false

from typing import Any

import bpy

from ... import native
from ...language import tables
from ..base import parts, session
from ..base.blender_types import ArmatureObject

ROWS = parts.RANGES
INDEX = "risorius_ranges_index"
SWITCH = "risorius_use_range"
SOURCE = "risorius_range_source"
_OVERRIDE: Any = {"LIBRARY_OVERRIDABLE"}
_LEAST, _MOST = 0.1, 1.9  # limits of extreme minus neutral, equal to the limits in risorius.ranges
# Number of changes of the capture ranges of all faces since the add-on was enabled. A cache
# compares this number with its stored number to notice changes.
_changes = session.value("range_properties.changes", 0, ("unregister",))


def _touch(_self: bpy.types.bpy_struct, _context: bpy.types.Context) -> None:
    touch()


def _mend(self: "RISORIUS_PG_range", _context: bpy.types.Context) -> None:
    """Clamp the extreme value to at least neutral + 0.1 and at most neutral + 1.9.

    The call also counts as a change of the ranges.
    """
    wanted = min(max(self.extreme, self.neutral + _LEAST), self.neutral + _MOST)
    if abs(wanted - self.extreme) > 1e-6:
        self.extreme = wanted
    touch()


class RISORIUS_PG_range(bpy.types.PropertyGroup):
    """The capture range of one control; the entry has the name of the raw control."""

    used: bpy.props.BoolProperty(
        name="Use",
        description="Apply the range to this control; off: keep the captured values",
        override=_OVERRIDE,
        update=_touch,
    )
    neutral: bpy.props.FloatProperty(
        name="Neutral",
        description="Captured value of the face at rest, which becomes 0",
        min=0.0,
        max=0.9,
        precision=3,
        override=_OVERRIDE,
        update=_mend,
    )
    extreme: bpy.props.FloatProperty(
        name="Extreme",
        description="Captured value of the full movement, which becomes 1",
        default=1.0,
        min=0.0,
        max=2.8,
        precision=3,
        override=_OVERRIDE,
        update=_mend,
    )
    reason: bpy.props.StringProperty(override=_OVERRIDE)


def touch() -> None:
    """Record that ranges may have changed by an edit, by undo, or because a file was opened."""
    _changes.now += 1


def changes() -> int:
    """Number of calls of `touch`. A cache of ranges compares this number to notice changes."""
    return _changes.now


def rows_of(controls: ArmatureObject) -> list[RISORIUS_PG_range]:
    """The ranges of a face, one for each control.

    Args:
        controls: the character's control armature.
    """
    return list(getattr(controls, ROWS))


def all_of(controls: ArmatureObject) -> "native.Ranges":
    """The capture ranges of a face, even if the use of ranges is switched off.

    Args:
        controls: the control armature. A control with an invalid range counts as switched off.

    Returns:
        risorius.ranges.Ranges.
    """
    module = native.part("ranges")
    found = {}
    for row in rows_of(controls):
        # Blender stores 0.67 as the float32 number 0.670000017; rounding restores 0.67.
        range_ = module.Range(round(row.neutral, 5), round(row.extreme, 5))
        reason = "" if row.used and range_.trouble() is None else row.reason or "off"
        found[row.name] = module.Learned(range_, reason)
    return module.Ranges(found, getattr(controls, SOURCE))


def of(controls: ArmatureObject) -> "native.Ranges | None":
    """The ranges of a face from which captured values are stretched to the range 0 to 1.

    None if the ranges are switched off or missing.

    Args:
        controls: the control armature.

    Returns:
        risorius.ranges.Ranges, or None.
    """
    if not getattr(controls, SWITCH) or not len(getattr(controls, ROWS)):
        return None
    return all_of(controls)


def keep(controls: ArmatureObject, ranges: "native.Ranges") -> None:
    """Replace the ranges of a face, and switch them on.

    Args:
        controls: the control armature.
        ranges: the new ranges.
    """
    rows: Any = getattr(controls, ROWS)
    rows.clear()
    for name, (range_, reason) in ranges.controls.items():
        row = rows.add()
        row.name, row.reason, row.used = name, reason, not reason
        row.neutral, row.extreme = range_
    setattr(controls, INDEX, 0)
    setattr(controls, SOURCE, ranges.source)
    setattr(controls, SWITCH, True)
    touch()


def forget(controls: ArmatureObject) -> None:
    """Remove the ranges of a face.

    Args:
        controls: the character's control armature.
    """
    rows: Any = getattr(controls, ROWS)
    rows.clear()
    setattr(controls, SOURCE, "")
    touch()


def _all() -> dict[str, object]:
    """The properties that `register` adds to bpy.types.Object, by name."""
    insertable: Any = {*_OVERRIDE, "USE_INSERTION"}
    return {
        ROWS: bpy.props.CollectionProperty(type=RISORIUS_PG_range, override=insertable),
        INDEX: bpy.props.IntProperty(options=set(), override=_OVERRIDE),
        SOURCE: bpy.props.StringProperty(options=set(), override=_OVERRIDE),
        SWITCH: bpy.props.BoolProperty(
            name="Use the Range",
            description=(
                "Apply the range to imported and live captures: neutral becomes 0, the extreme 1"
            ),
            translation_context=tables.CONTEXT,
            default=True,
            options=set(),
            override=_OVERRIDE,
            update=_touch,
        ),
    }


CLASSES = (RISORIUS_PG_range,)


def register() -> None:
    """Add the properties to bpy.types.Object; CLASSES must be registered before."""
    for name, kind in _all().items():
        setattr(bpy.types.Object, name, kind)


def unregister() -> None:
    """Remove the properties; their values in .blend files stay."""
    for name in _all():
        delattr(bpy.types.Object, name)
