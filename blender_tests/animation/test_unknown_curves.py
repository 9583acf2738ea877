# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests curves that no mapping contains: assigned in Blender, saved as a mapping, imported."""

import bpy
import pytest
from risorius import importing
from support import scene
from support.layout import drawn

PULL = "CTRL_expressions.mouthCornerPullL"


@pytest.fixture
def rig(dna_file):
    return scene.load(dna_file, "LIVE")


def table(folder, *names):
    path = folder / "take.csv"
    rows = [",".join(["time", *names]), *(f"{i},{','.join(['1'] * len(names))}" for i in (0, 1))]
    path.write_text("\n".join(rows), encoding="utf-8")
    return str(path)


def panel():
    return scene.submodule("ui.shape_keys.curves").RISORIUS_PT_curve_names


def test_unknown_curves_become_a_mapping_that_is_used_at_once(rig, tmp_path):
    path, mine = table(tmp_path, "jawOpen", "Key 1", "hat"), tmp_path / "mine.toml"
    assert not panel().poll(bpy.context)
    bpy.ops.risorius.import_animation(filepath=path, start=5.0)
    assert panel().poll(bpy.context)
    assert drawn(panel()).labels.count("Choose...") == 2
    assert bpy.ops.risorius.assign_curve(curve="Key 1", becomes="mouthCornerPullL") == {"FINISHED"}
    assert bpy.ops.risorius.assign_curve(curve="hat") == {"FINISHED"}  # without a control: left out
    assert bpy.ops.risorius.save_curve_mapping(filepath=str(mine)) == {"FINISHED"}
    written = importing.load_mapping(mine)
    assert written.rows["Key 1"] == {PULL: 1.0}
    assert written.rows["hat"] == {}
    assert "eyeBlinkLeft" in written.rows
    action = bpy.context.object.animation_data.action
    found = scene.submodule("scene.base.compat").curves_of(action)
    pull = next(c for c in found if PULL in c.data_path)
    assert pull.keyframe_points[0].co[:] == (5.0, 1.0)  # the settings of the import stay
    assert not panel().poll(bpy.context)


def test_a_file_of_which_nothing_is_known_can_be_named_too(rig, tmp_path):
    path = table(tmp_path, "Key 1", "Key 2")
    with pytest.raises(RuntimeError, match="no mapping knows any of its 2 curves"):
        bpy.ops.risorius.import_animation(filepath=path)
    bpy.ops.risorius.assign_curve(curve="Key 2", becomes="=mouthSmileLeft")
    with pytest.raises(RuntimeError, match="A control or an expression was expected"):
        bpy.ops.risorius.assign_curve(curve="Key 1", becomes="smile")
    mine = tmp_path / "mine.toml"
    assert bpy.ops.risorius.save_curve_mapping(filepath=str(mine)) == {"FINISHED"}
    scene.evaluated(scene.meshes(rig)[0])
    assert scene.face(rig)[PULL] == 1.0
    # Saving again adds the assignment of the second curve to the existing mapping file.
    bpy.ops.risorius.assign_curve(curve="Key 1", becomes="jawOpen")
    bpy.ops.risorius.save_curve_mapping(filepath=str(mine))
    assert set(importing.load_mapping(mine).rows) == {"Key 1", "Key 2"}
    assert not panel().poll(bpy.context)
