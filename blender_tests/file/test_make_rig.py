# SPDX-License-Identifier: GPL-3.0-or-later
"""Make Rig from Shape Keys: a head of any make becomes a face that does what its keys did."""

import importlib.util
from pathlib import Path

import bpy
import numpy as np
import pytest
import risorius
from support import scene

_FILE = Path(__file__).parents[2] / "tests" / "python" / "support" / "face_shapes.py"
_SPEC = importlib.util.spec_from_file_location("face_shapes", _FILE)
face_shapes = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(face_shapes)

METRES = 0.01


def to_blender(points):
    """Centimetres with y up as metres with z up."""
    return np.stack([points[:, 0], -points[:, 2], points[:, 1]], axis=1) * METRES


@pytest.fixture
def head():
    positions, faces = face_shapes.head()
    mesh = bpy.data.meshes.new("Egg")
    mesh.from_pydata(to_blender(positions).tolist(), [], faces.tolist())
    layer = mesh.uv_layers.new(name="UVMap")
    uvs = np.random.default_rng(1).random(2 * len(mesh.loops)).astype(np.float32)
    layer.data.foreach_set("uv", uvs)
    for name in ("Skin", "Lips"):
        mesh.materials.append(bpy.data.materials.new(name))
    mesh.polygons[3].material_index = 1
    item = bpy.data.objects.new("Egg", mesh)
    bpy.context.scene.collection.objects.link(item)
    item.shape_key_add(name="Basis")
    for name, delta in face_shapes.expressions(positions).items():
        key = item.shape_key_add(name=name)
        key.data.foreach_set("co", to_blender(positions + delta).astype(np.float32).ravel())
        key.value = 0.0
    bpy.context.view_layer.objects.active = item
    item.select_set(True)
    return item


def make(path, **options):
    settings = {"joints": 40, **options}
    return bpy.ops.risorius.make_rig(filepath=str(path), **settings)


def made_face():
    rigs = scene.submodule("scene.base.parts").rigs()
    assert len(rigs) == 1
    return rigs[0]


def shape(item, name):
    """Where a key alone brings the vertices, without the object's own place."""
    key = item.data.shape_keys.key_blocks[name]
    out = np.empty(3 * len(key.data), np.float32)
    key.data.foreach_get("co", out)
    return out.reshape(-1, 3) @ np.array(item.matrix_world.to_3x3()).T


def _saved_as_gltf(path):
    from risorius.author.input import gltf

    bpy.ops.export_scene.gltf(filepath=str(path), use_selection=True, export_morph=True)
    return gltf.read_gltf(path)


def _saved_as_fbx(path, **options):
    from risorius.author.input import fbx

    bpy.ops.export_scene.fbx(filepath=str(path), use_selection=True, **options)
    return fbx.read_fbx(path)


_TURNED = {"axis_up": "Z", "axis_forward": "-Y", "global_scale": 0.3}
_APPLIED = {"bake_space_transform": True, "apply_scale_options": "FBX_SCALE_UNITS"}


@pytest.mark.parametrize(
    ("saved", "scale"),
    [
        pytest.param(lambda folder: _saved_as_gltf(folder / "egg.glb"), 1.5, id="glTF"),
        pytest.param(lambda folder: _saved_as_fbx(folder / "egg.fbx"), 1.5, id="FBX"),
        pytest.param(
            lambda folder: _saved_as_fbx(folder / "egg.fbx", **_TURNED), 0.45, id="FBX, z up"
        ),
        pytest.param(
            lambda folder: _saved_as_fbx(folder / "egg.fbx", **_APPLIED), 1.5, id="FBX, applied"
        ),
    ],
)
def test_what_blender_saves_is_the_same_head(saved, scale, head, tmp_path):
    head.location, head.scale = (0.02, 0.01, 0.03), (1.5, 1.5, 1.5)
    bpy.context.view_layer.update()
    mesh, moved = saved(tmp_path)
    positions, faces = face_shapes.head()
    assert len(mesh.positions) == len(positions)
    corners = [len(face) for face in mesh.faces]
    assert sum(corners) - 2 * len(corners) == 2 * len(faces)  # as many triangles
    assert [len(face) for face in mesh.uv_faces] == corners
    assert np.ptp(mesh.uvs, axis=0).min() > 0.9
    wanted = face_shapes.expressions(positions)
    assert list(moved) == list(wanted)
    # Blender may put vertices into another order: each is looked for by its place.
    unit = METRES * scale
    place = np.array([2.0, 3.0, -1.0]) / 1.5
    apart = np.linalg.norm(mesh.positions[:, None] / unit - positions[None] - place, axis=2)
    places = apart.argmin(axis=1)
    assert sorted(places.tolist()) == list(range(len(positions)))
    assert apart.min(axis=1).max() < 1e-4
    for name, delta in wanted.items():
        np.testing.assert_allclose(moved[name] / unit, delta[places], atol=1e-4)


def test_the_face_does_what_the_keys_did(head, tmp_path):
    head.location = (2.0, 1.0, 0.5)
    head.scale = (1.5, 1.5, 1.5)
    bpy.context.view_layer.update()
    path = tmp_path / "egg.dna"
    assert make(path) == {"FINISHED"}
    dna = risorius.load(path)
    assert len(dna.joint_names) == 42
    rig = made_face()
    mesh = scene.meshes(rig)[0]
    place = np.array(rig.matrix_world.translation)
    width, _, height = np.ptp(shape(head, "Basis"), axis=0)
    assert place == pytest.approx([2.0 + 1.25 * width, 1.0, 0.5], abs=0.02 * width)  # beside it
    for control, key in (("jawOpen", "jawOpen"), ("mouthCornerPullL", "mouthSmileLeft")):
        scene.set_controls(rig, **{f"CTRL_expressions.{control}": 1.0})
        off = np.linalg.norm(scene.evaluated(mesh) - place - shape(head, key), axis=1)
        assert off.max() < 1.01 / 1500 * height  # the tolerance
        moved = np.linalg.norm(shape(head, key) - shape(head, "Basis"), axis=1)
        assert moved.max() > 0.005
        scene.set_controls(rig, **{f"CTRL_expressions.{control}": 0.0})
    assert [m.name for m in mesh.data.materials] == ["Skin", "Lips"]
    assert mesh.data.polygons[3].material_index == 1
    assert len(head.data.shape_keys.key_blocks) == 8  # it stays as it was


def test_joints_alone_and_as_many_levels_as_asked_for(head, tmp_path):
    path = tmp_path / "egg.dna"
    assert make(path, use_shapes=False, levels=3) == {"FINISHED"}
    dna = risorius.load(path)
    assert not any(mesh.blend_shape_targets for mesh in dna.meshes)
    assert dna.lod_count == 3
    sizes = [len(dna.meshes[int(level[0])].positions) for level in dna.lod_mesh_mapping]
    assert sizes[0] == 506 > sizes[1] > sizes[2]


def test_visemes_are_a_library_beside_the_face(head, tmp_path):
    spoken = head.shape_key_add(name="viseme_aa")
    spoken.data[30].co.z -= 0.01
    assert make(tmp_path / "egg.dna", joints=5) == {"FINISHED"}
    library = risorius.expressions.load(tmp_path / "egg_expressions")
    assert {name: dict(item.weights) for name, item in library.items()} == {
        "aa": {"CTRL_expressions.viseme_aa": 1.0}
    }
    assert "CTRL_expressions.viseme_aa" in risorius.load(tmp_path / "egg.dna").raw_control_names


def test_a_mesh_without_keys_and_a_face_are_refused(head, dna_file, tmp_path):
    for key in list(head.data.shape_keys.key_blocks):
        head.shape_key_remove(key)
    assert not bpy.ops.risorius.make_rig.poll()
    rig = scene.load(dna_file)
    bpy.context.view_layer.objects.active = scene.meshes(rig)[0]
    assert not bpy.ops.risorius.make_rig.poll()


def test_what_cannot_be_used_leaves_nothing(head, tmp_path):
    before = scene.counts()
    head.data.shape_keys.use_relative = False
    with pytest.raises(RuntimeError, match="The shape keys are not relative"):
        make(tmp_path / "a.dna")
    head.data.shape_keys.use_relative = True
    with pytest.raises(RuntimeError, match="nowhere"):
        make(tmp_path / "nowhere" / "a.dna")
    basis = shape(head, "Basis").astype(np.float32).ravel()
    for key in head.data.shape_keys.key_blocks:
        key.data.foreach_set("co", basis)
    with pytest.raises(RuntimeError, match="no expression moves a vertex"):
        make(tmp_path / "a.dna")
    assert scene.counts() == before
    assert not list(tmp_path.iterdir())


def test_a_cancelled_rig_leaves_no_file(head, tmp_path):
    heads = scene.submodule("scene.file.shape_key_head")
    shapes = heads.shapes_of(bpy.context, head)
    task = heads.rig_task(shapes, str(tmp_path / "a.dna"), 40, 8, 0.1)
    task.start()
    task.cancel()
    assert not task.is_running()
    assert task.result is None
    assert "stopped" in str(task.error)
    assert not list(tmp_path.iterdir())
