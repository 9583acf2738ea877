# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests of the operators Make Rig from Head and Conform Face to Head."""

import bmesh
import bpy
import numpy as np
import pytest
import risorius as package_module
from support import scene
from support.plain_head import PLACES, Onto, opened, plain_head, to_blender

risorius = bpy.ops.risorius


@pytest.fixture
def onto(monkeypatch):
    return Onto(monkeypatch)


@pytest.fixture
def head(onto):
    item = plain_head()
    item.data.materials.append(bpy.data.materials.new("Skin"))
    return item


def make(path, **options):
    settings = {"joints": 12, "levels": 1, **options}
    return risorius.make_rig_from_head(filepath=str(path), **settings)


def rigs():
    return scene.submodule("scene.base.parts").rigs()


def moved_by(rig, control):
    """Displacements of the first mesh's vertices if a control goes from 0 to 1, float64[V, 3]."""
    mesh = scene.meshes(rig)[0]
    rest = scene.evaluated(mesh)
    scene.set_controls(rig, **{control: 1.0})
    out = scene.evaluated(mesh) - rest
    scene.set_controls(rig, **{control: 0.0})
    return out


def test_a_head_without_expressions_becomes_a_face(head, onto, dna_file, tmp_path, capfd):
    head.location = (2.0, 1.0, 0.5)
    bpy.context.view_layer.update()
    file = {"template": "FILE", "template_file": str(dna_file)}
    assert make(tmp_path / "egg.dna", strength=0.5, use_repair=False, **file) == {"FINISHED"}
    said = capfd.readouterr().out
    assert said.count("It stands.") == said.count("It is odd.") == 1
    ((dna, transfer),) = onto.asked
    assert dna.mesh_names == package_module.load(dna_file).mesh_names
    assert transfer == (0.5, False)
    (rig,) = rigs()
    wanted = to_blender(0.5 * opened(onto.heads[0].parts[0].mesh.positions))
    moved = moved_by(rig, "jawOpen")
    np.testing.assert_allclose(moved, wanted, atol=2e-4)
    scene.add_board()  # the template's face board and animated maps
    controls, mesh = scene.controls(rig), scene.meshes(rig)[0]
    rest = scene.evaluated(mesh)
    controls.pose.bones["CTRL_C_jaw"].location.y = 1.0
    scene.update(controls)
    np.testing.assert_allclose(scene.evaluated(mesh) - rest, moved, atol=1e-5)
    assert list(rig["maps"]) == [1.0, 0.0]
    assert [m.name for m in scene.meshes(rig)[0].data.materials] == ["Skin"]
    assert rig.matrix_world.translation.x > 2.1  # the rig is placed beside the head
    assert rig.matrix_world.translation.z == pytest.approx(0.5, abs=1e-4)
    names = {point.name for point in head.children}
    assert names == {*PLACES, "chin"}  # found landmarks are shown on the head
    assert head.data.shape_keys is None  # the head is unchanged


def test_a_head_may_be_half_a_mesh_with_a_mirror(head, onto, dna_file, tmp_path):
    whole = len(head.data.polygons)
    bm = bmesh.new()
    bm.from_mesh(head.data)
    gone = [v for v in bm.verts if v.co.x < -1e-6]
    bmesh.ops.delete(bm, geom=gone, context="VERTS")
    bm.to_mesh(head.data)
    bm.free()
    head.modifiers.new("Mirror", "MIRROR")
    head.modifiers.new("Smooth", "SUBSURF")
    file = {"template": "FILE", "template_file": str(dna_file)}
    assert make(tmp_path / "egg.dna", **file) == {"FINISHED"}
    assert len(onto.heads[0].parts[0].mesh.positions) == 506
    mesh = scene.meshes(rigs()[0])[0].data
    assert (len(mesh.polygons), [m.name for m in mesh.materials]) == (whole, ["Skin"])
    assert not [mesh for mesh in bpy.data.meshes if not mesh.users]
    assert len(head.modifiers) == 2


def test_the_face_of_the_scene_lends_its_expressions(head, onto, dna_file, tmp_path):
    with pytest.raises(RuntimeError, match="Select the head and one face"):
        make(tmp_path / "a.dna", template="FACE")
    rig = scene.load(dna_file)
    bpy.context.view_layer.objects.active = head
    head.select_set(True)
    assert make(tmp_path / "a.dna", template="FACE") == {"FINISHED"}
    runtime = scene.submodule("scene.character.runtime")
    assert onto.asked[0][0] is runtime.there(rig).dna


def test_landmarks_that_a_person_placed_are_used(head, onto, dna_file, tmp_path):
    assert risorius.find_landmarks() == {"FINISHED"}
    bpy.context.scene.cursor.location = (0.0, -0.08, -0.1)
    risorius.place_landmark(landmark="chin", way="CURSOR")
    file = {"template": "FILE", "template_file": str(dna_file)}
    assert make(tmp_path / "egg.dna", **file) == {"FINISHED"}
    used = onto.heads[-1]
    assert list(used.fixed) == ["chin"]
    np.testing.assert_allclose(used.fixed["chin"], [0.0, -10.0, 8.0], atol=1e-4)
    assert used.named == "Egg"  # the mesh with landmarks is the face


def test_what_cannot_be_used_leaves_nothing(head, onto, dna_file, tmp_path, monkeypatch):
    before = scene.counts()
    file = {"template": "FILE", "template_file": str(dna_file)}
    for options, said in (
        ({"template": "FILE"}, "Choose the DNA file"),
        ({"template": "FILE", "template_file": str(tmp_path / "none.dna")}, "none.dna"),
        ({"template": "FILE", "template_file": __file__}, "test_from_head.py"),
    ):
        with pytest.raises(RuntimeError, match=said):
            make(tmp_path / "a.dna", **options)
    with pytest.raises(RuntimeError, match="its folder is not there"):
        make(tmp_path / "nowhere" / "a.dna", **file)
    error = scene.submodule("logic.base.errors").FaceError("Egg: its lips are welded.")

    def fail(*_given):
        raise error

    monkeypatch.setattr(scene.submodule("scene.anyhead.making"), "_carry_over", fail)
    with pytest.raises(RuntimeError, match="its lips are welded"):
        make(tmp_path / "a.dna", **file)
    assert scene.counts() == before
    assert sorted(p.name for p in tmp_path.iterdir()) == ["small.dna"]


def test_esc_leaves_no_file(head, onto, dna_file, tmp_path):
    making, finding = (scene.submodule(f"scene.anyhead.{n}") for n in ("making", "finding"))
    heads = scene.submodule("scene.file.shape_key_head")
    wishes = heads.RigWishes(str(tmp_path / "a.dna"), 40, 8)
    read = finding.read(bpy.context, head, [])
    template = making.Template(path=str(dna_file))
    task = making.rig_task(read, template, making.Transfer(), wishes)
    task.start()
    task.cancel()
    assert not task.is_running()
    assert task.result is None
    assert not (tmp_path / "a.dna").exists()


def test_a_face_takes_the_form_of_a_head(head, onto, dna_file, tmp_path):
    assert not risorius.conform_face.poll()
    rig = scene.load(dna_file)
    bpy.context.view_layer.objects.active = head
    head.select_set(True)
    assert risorius.conform_face(filepath=str(tmp_path / "new.dna")) == {"FINISHED"}
    assert len(rigs()) == 2
    new = next(item for item in rigs() if item != rig)
    left = min(scene.evaluated(mesh)[:, 0].min() for mesh in scene.meshes(new).values())
    assert left > max((head.matrix_world @ v.co).x for v in head.data.vertices)  # beside the head
    ((dna, read),) = onto.asked
    assert dna is scene.submodule("scene.character.runtime").there(rig).dna
    assert len(read.parts[0].mesh.positions) == 506
    assert (tmp_path / "new.dna").is_file()
    bpy.ops.object.select_all(action="DESELECT")
    bpy.context.view_layer.objects.active = head
    scene.controls(rig).select_set(True)
    with pytest.raises(RuntimeError, match="the face's own file"):
        risorius.conform_face(filepath=str(dna_file))
