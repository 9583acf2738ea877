# SPDX-License-Identifier: GPL-3.0-or-later
"""Mix Faces: the preview follows the sliders, and the written face moves."""

from pathlib import Path

import bpy
import numpy as np
import pytest
import risorius
from support import scene

MEDIUM = Path(__file__).parents[2] / "tests" / "data" / "golden" / "medium.dna"


def to_blender(points):
    """Convert points from centimetres with y up to metres with z up, float64[N, 3]."""
    return np.stack([points[:, 0], -points[:, 2], points[:, 1]], axis=1) * 0.01


@pytest.fixture
def files(tmp_path):
    """A folder with three DNA files.

    one.dna is a face, wide.dna is the face made wider and deeper, and other.dna is wide.dna with a
    renamed joint.
    """
    dna = risorius.load(MEDIUM)
    dna.save(tmp_path / "one.dna")
    meshes = []
    for mesh in dna.meshes:
        mesh.positions = np.asarray(mesh.positions) * [1.2, 1.0, 1.1]
        meshes.append(mesh)
    dna.meshes = meshes
    dna.save(tmp_path / "wide.dna")
    names = list(dna.joint_names)
    dna.joint_names = [*names[:-1], "another"]
    dna.save(tmp_path / "other.dna")
    return tmp_path


def add(folder, *names):
    return bpy.ops.risorius.mix_add(
        directory=f"{folder}/", files=[{"name": name} for name in names]
    )


def parents():
    return bpy.context.window_manager.risorius_mix.parents


@pytest.fixture(autouse=True)
def nobody():
    yield
    while len(parents()):
        bpy.ops.risorius.mix_remove(index=0)


def preview():
    return scene.submodule("scene.mixing.parents").preview(bpy.context)


def points(item):
    out = np.empty(3 * len(item.data.vertices), np.float32)
    item.data.vertices.foreach_get("co", out)
    return out.reshape(-1, 3)


def seen(item):
    """The evaluated vertices of an object, float32[V, 3]."""
    shown = item.evaluated_get(bpy.context.evaluated_depsgraph_get())
    out = np.empty(3 * len(shown.data.vertices), np.float32)
    shown.data.vertices.foreach_get("co", out)
    return out.reshape(-1, 3)


def finest(path):
    """The neutral vertices of a DNA file's LOD 0, in metres with z up, float64[V, 3]."""
    dna = risorius.load(path)
    rows = [np.asarray(dna.meshes[int(m)].positions) for m in dna.lod_mesh_mapping[0]]
    return to_blender(np.concatenate(rows))


def test_the_preview_follows_the_sliders(files):
    assert add(files, "one.dna", "wide.dna") == {"FINISHED"}
    assert bpy.ops.risorius.mix_preview() == {"FINISHED"}
    one, wide = finest(files / "one.dna"), finest(files / "wide.dna")
    item = preview()
    np.testing.assert_allclose(points(item), (one + wide) / 2, atol=1e-5)
    assert len(item.data.polygons) > 50
    parents()[1].share = 0.0
    np.testing.assert_allclose(points(item), one, atol=1e-5)
    parents()[1].share = 0.5
    np.testing.assert_allclose(points(item), (2 * one + wide) / 3, atol=1e-5)
    assert preview() == item
    assert bpy.ops.risorius.mix_preview() == {"FINISHED"}
    assert preview() is None
    assert "Mix" not in bpy.data.meshes


def test_shares_of_nothing_leave_the_preview_where_it_was(files):
    add(files, "one.dna", "wide.dna")
    bpy.ops.risorius.mix_preview()
    before = points(preview())
    parents()[0].share = parents()[1].share = 0.0
    assert np.isfinite(points(preview())).all()
    parents()[0].share = parents()[1].share = 1.0
    np.testing.assert_allclose(points(preview()), before, atol=1e-6)


def test_the_mix_is_written_imported_and_moves(files, tmp_path):
    add(files, "one.dna", "wide.dna")
    bpy.ops.risorius.mix_preview()
    parents()[0].share = 0.25
    path = tmp_path / "child.dna"
    assert bpy.ops.risorius.mix_write(filepath=str(path)) == {"FINISHED"}
    assert preview() is None
    rigs = scene.submodule("scene.base.parts").rigs()
    assert len(rigs) == 1
    child = finest(path)
    expected = (finest(files / "one.dna") + 4 * finest(files / "wide.dna")) / 5
    np.testing.assert_allclose(child, expected, atol=1e-5)
    controls = scene.submodule("scene.base.parts").controls_of(rigs[0])
    face = controls.pose.bones["face"]
    mesh = scene.submodule("scene.base.parts").meshes_of(rigs[0])[0]
    still = seen(mesh)
    for name in [k for k in face.keys() if k.startswith("CTRL_expressions.")]:  # noqa: SIM118
        face[name] = 1.0
    controls.update_tag()
    bpy.context.view_layer.update()
    assert np.abs(seen(mesh) - still).max() > 1e-4


def test_the_scenes_faces_are_added_once(files):
    for name in ("one.dna", "wide.dna", "one.dna"):
        bpy.ops.risorius.import_dna(filepath=str(files / name))
    assert bpy.ops.risorius.mix_add_scene() == {"FINISHED"}
    assert sorted(Path(p.path).name for p in parents()) == ["one.dna", "wide.dna"]


def test_what_does_not_go_together_is_said_and_left_out(files):
    add(files, "one.dna")
    with pytest.raises(RuntimeError, match=r"other\.dna cannot be mixed with one\.dna: it has no"):
        add(files, "other.dna")
    (files / "broken.dna").write_bytes(b"no face")
    with pytest.raises(RuntimeError, match=r"broken\.dna"):
        add(files, "broken.dna")
    with pytest.raises(RuntimeError, match=r"gone\.dna"):
        add(files, "gone.dna")
    assert len(parents()) == 1


def test_a_parent_is_not_written_over(files):
    add(files, "one.dna", "wide.dna")
    before = (files / "one.dna").read_bytes()
    with pytest.raises(RuntimeError, match="cannot be written over"):
        bpy.ops.risorius.mix_write(filepath=str(files / "one.dna"))
    assert (files / "one.dna").read_bytes() == before
    with pytest.raises(RuntimeError, match="child"):
        bpy.ops.risorius.mix_write(filepath=str(files / "none" / "child.dna"))


def test_a_file_that_is_gone_is_said_where_it_is_needed(files):
    add(files, "one.dna", "wide.dna")
    bpy.ops.risorius.mix_preview()
    (files / "wide.dna").unlink()
    parents()[0].share = 0.7
    assert preview() is not None  # the file was read
    with pytest.raises(RuntimeError, match=r"wide\.dna: No such file"):
        bpy.ops.risorius.mix_write(filepath=str(files / "child.dna"))
    bpy.ops.risorius.mix_preview()
    assert preview() is None
    assert not (files / "child.dna").exists()


def test_without_faces_nothing_can_be_mixed():
    assert not bpy.ops.risorius.mix_preview.poll()
    assert not bpy.ops.risorius.mix_write.poll()
    with pytest.raises(RuntimeError, match="no face in this scene"):
        bpy.ops.risorius.mix_add_scene()
