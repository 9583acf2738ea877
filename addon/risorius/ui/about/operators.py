# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that list a face's contents and run the self-test."""

import bpy
import numpy as np

from ... import native
from ...scene.base import console, parts
from ...scene.base.blender_types import ArmatureObject
from ...scene.character import meshes, runtime
from ...scene.lod import lods
from .. import words
from ..blender_types import Context, Operator, Result
from ..common import FaceOperator, face_rig, usable


def describe(rig: ArmatureObject) -> list[str]:
    """The contents of a face as text: counts, a line for each mesh, and shapes that move nothing.

    Args:
        rig: deforming armature of the face.

    Returns:
        Lines of text.
    """
    live = runtime.there(rig)
    names = live.dna.blend_shape_channel_names
    lines = [
        words.say(
            (
                "{controls} controls, {joints} joints ({moved} of them follow controls), "
                "{channels} blend shape channels, {maps} animated maps."
            ),
            controls=len(live.labels),
            joints=live.rig.joint_count,
            moved=len(live.owned),
            channels=len(names),
            maps=len(live.dna.animated_map_names),
        ),
        words.say("Hair, clothes and grooms are not in DNA files."),
    ]
    for item in parts.meshes_of(rig):
        dna_mesh = runtime.dna_mesh(live, item)
        targets = dna_mesh.blend_shape_targets if dna_mesh is not None else ()
        real = len(meshes.real_channels(item))
        still = [
            names[t.blend_shape_channel_index] for t in targets if not np.any(np.asarray(t.deltas))
        ]
        levels = ", ".join(str(level) for level in lods.levels_of(item))
        line = words.say(
            (
                "{mesh}: level {levels}, {vertices:,} vertices, {channels} channels move it, "
                "{real} of them as real keys."
            ),
            mesh=item.name,
            levels=levels,
            vertices=len(item.data.vertices),
            channels=len(targets),
            real=real,
        )
        lines.append(line)
        if still:
            lines.append(
                "    "
                + words.say(
                    "These blend shape channels move nothing: {names}", names=", ".join(still)
                )
            )
    return lines


class RISORIUS_OT_describe(FaceOperator, Operator):
    """List the parts of the active face, mesh by mesh"""

    bl_idname = "risorius.describe"
    bl_label = "Contents of the Face"
    baked_too = True
    bl_options = {"REGISTER"}

    def execute(self, context: Context) -> Result:
        lines = describe(face_rig(context))
        for line in lines:
            self.report({"INFO"}, line)
        if not bpy.app.background:
            context.window_manager.popup_menu(
                lambda menu, _context: [words.show(menu.layout, line) for line in lines],
                title=words.say("Contents of the Face"),
                icon="INFO",
            )
        return {"FINISHED"}


def self_test_rows() -> tuple[list[tuple[str, bool, str]], str]:
    """Run the self-test of the wheel.

    Returns:
        (name, whether it passed, details) of each check; the text of the report.

    Raises:
        UnusableError: the native module is missing or of another version.
    """
    selftest = native.part("selftest")
    window = "background" if bpy.app.background else bpy.app.version_cycle
    where = f"{bpy.app.version_string}, {window}, add-on {native.addon_version()}"
    rows = [selftest.Row("Blender", True, where), *selftest.run(native.bundled_sample("man"))]
    return rows, selftest.text(rows)


class RISORIUS_OT_self_test(Operator):
    """Test on this machine whether and how fast faces load, move and are written; copy a report"""

    bl_idname = "risorius.self_test"
    bl_label = "Self-Test"

    @classmethod
    def poll(cls, context: Context) -> bool:
        return usable(cls)

    def execute(self, context: Context) -> Result:
        rows, report = self_test_rows()
        console.say(*report.splitlines())
        context.window_manager.clipboard = report
        bad = [row for row in rows if not row[1]]
        if bad:
            text = words.say("{count} checks failed: {name}", count=len(bad), name=bad[0][0])
            self.report({"ERROR"}, text)
        else:
            self.report({"INFO"}, words.say("All {count} checks passed.", count=len(rows)))
        if not bpy.app.background:
            context.window_manager.popup_menu(
                lambda menu, _context: [words.show(menu.layout, s) for s in report.splitlines()],
                title=words.say("Self-test: this report was copied to the clipboard"),
                icon="ERROR" if bad else "CHECKMARK",
            )
        return {"FINISHED"}


class RISORIUS_OT_hide_hints(Operator):
    """Hide the first steps; the option First Steps in the preferences shows them again"""

    bl_idname = "risorius.hide_hints"
    bl_label = "Hide First Steps"

    def execute(self, context: Context) -> Result:
        addon = context.preferences.addons.get(native.ADDON)
        if addon is not None:
            addon.preferences.hints = False  # type: ignore[attr-defined]
            context.preferences.is_dirty = True
        return {"FINISHED"}


CLASSES = (RISORIUS_OT_describe, RISORIUS_OT_self_test, RISORIUS_OT_hide_hints)
