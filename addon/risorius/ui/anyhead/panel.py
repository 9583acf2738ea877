# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel Face from Head: the landmarks of a head, and buttons that make a face from it."""

from __future__ import annotations

from collections.abc import Mapping

from ... import native
from ...scene.anyhead import finding, heads, points
from .. import words
from ..blender_types import Context, Panel, UILayout
from ..common import FacePanel

_LEAST = 200  # polygons: smaller meshes are not heads
_MOST = 5  # missing landmarks that are listed with buttons at the same time


class RISORIUS_PT_head(FacePanel, Panel):
    bl_idname = "RISORIUS_PT_head"
    bl_label = "Face from Head"
    bl_order = 0  # a selected head comes before the controls of a face

    @classmethod
    def poll(cls, context: Context) -> bool:
        head = None if native.problem() else heads.head_of(context)
        if head is None:
            return False
        return len(head.data.polygons) >= _LEAST or bool(points.of(head))

    def draw(self, context: Context) -> None:
        layout, head = self.layout, heads.head_of(context)
        if head is None:
            return
        there = points.of(head)
        row = layout.row(align=True)
        row.operator("risorius.find_landmarks", icon="VIEWZOOM")
        row.operator("risorius.load_landmarks", text="", icon="IMPORT")
        if there:
            row.operator("risorius.save_landmarks", text="", icon="EXPORT")
            shown = points.names_are_shown(there.values())
            button = row.operator(
                "risorius.landmark_names", text="", icon="SORTALPHA", depress=shown
            )
            button.enable = not shown
            row.operator("risorius.clear_landmarks", text="", icon="TRASH")
            _draw_points(layout, there)
        column = layout.column(align=True)
        column.operator("risorius.make_rig_from_head", icon="ARMATURE_DATA")
        column.operator("risorius.conform_face", icon="MOD_SHRINKWRAP")


def _draw_points(layout: UILayout, there: Mapping[str, points.Point]) -> None:
    """Draw the number of landmarks, and the first missing landmarks with buttons to place them."""
    counts = {state: 0 for state in (points.FOUND, points.MOVED, points.PLACED)}
    for point in there.values():
        counts[point.state] += 1
    text = "Landmarks: {found} found, {moved} moved, {placed} placed"
    said = words.say(
        text,
        found=counts[points.FOUND],
        moved=counts[points.MOVED],
        placed=counts[points.PLACED],
    )
    words.show(layout, said, "CHECKMARK")
    missing = [name for name in finding.words() if name in finding.needed() and name not in there]
    if not missing:
        return
    box = layout.box()
    words.show(box, words.say("{count} missing", count=len(missing)), "ERROR")
    for name in missing[:_MOST]:
        words.write(box, finding.words()[name])
        line = box.row(align=True)
        button = line.operator("risorius.place_landmark", text="By Click", icon="EYEDROPPER")
        button.landmark, button.way = name, "CLICK"
        button = line.operator("risorius.place_landmark", text="At Cursor", icon="PIVOT_CURSOR")
        button.landmark, button.way = name, "CURSOR"


CLASSES = (RISORIUS_PT_head,)
