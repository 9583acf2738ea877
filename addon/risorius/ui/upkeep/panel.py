# SPDX-License-Identifier: GPL-3.0-or-later
"""Warnings and buttons of the panel Face about problems that keep a face from moving."""

from ...scene.base import parts
from ...scene.upkeep import applied_transforms, library_overrides, migrations, repair
from .. import words
from ..blender_types import Context, UILayout
from .operators import RISORIUS_OT_bring_back, RISORIUS_OT_make_override, override_trouble


def draw_trouble(layout: UILayout, context: Context) -> bool:
    """Draw warnings and buttons about problems that keep the active face from moving.

    Args:
        layout: layout of the panel.
        context: context with the active object.

    Returns:
        True if the caller should draw nothing else in the panel.
    """
    linked, active = library_overrides.linked_rig(context), parts.active_rig(context)
    shown = linked or active
    newer = migrations.newer(shown) if shown is not None else ""
    if newer:
        words.write(layout, newer, "INFO")
    if linked is not None:
        words.write(layout, "Linked: make an override to animate.", "LINKED")
        layout.operator_menu_enum(RISORIUS_OT_make_override.bl_idname, "shapes")
        return True
    said = applied_transforms.last_said(active) if active is not None else None
    if said is not None:
        words.write(layout, said, "INFO")
    broken = override_trouble(active)
    if broken:
        words.write(layout, broken, "ERROR")
        layout.operator(RISORIUS_OT_make_override.bl_idname, text="Repair Override")
    lost = repair.missing(context.object or active)
    for sentence in lost:
        words.write(layout, sentence, "ERROR")
    if any("still in the file" in sentence for sentence in lost):
        layout.operator(RISORIUS_OT_bring_back.bl_idname)
    return bool(lost) and active is None
