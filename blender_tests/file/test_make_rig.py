# SPDX-License-Identifier: GPL-3.0-or-later
"""Make Rig from Shape Keys: a head becomes a face that repeats its keys."""

import importlib.util
import sys
from pathlib import Path

import bpy
import numpy as np
import pytest
import risorius
from support import scene
from support.layout import drawn

_SUPPORT = Path(__file__).parents[2] / "tests" / "python" / "support"


def _supporting(name):
    """Load a module of tests/python/support.

    It is entered in sys.modules under `name`, by which other modules of that folder import it.
    """
    spec = importlib.util.spec_from_file_location(name, _SUPPORT / f"{name}.py")
    sys.modules[name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(sys.modules[name])
    return sys.modules[name]


face_shapes = _supporting("face_shapes")
likenesses = _supporting("likenesses")

METRES = 0.01


def to_blender(points):
    """Convert points from centimetres with y up to metres with z up, float64[N, 3]."""
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
    """Vertices of one shape key after the object's rotation and scale, float[V, 3] in metres.

    The object's location is not added.
    """
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
    assert sum(corners) - 2 * len(corners) == 2 * len(faces)  # the same number of triangles
    assert [len(face) for face in mesh.uv_faces] == corners
    assert np.ptp(mesh.uvs, axis=0).min() > 0.9
    wanted = face_shapes.expressions(positions)
    assert list(moved) == list(wanted)
    # Blender may change the order of vertices, so each saved vertex is matched by its position.
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
    assert len(head.data.shape_keys.key_blocks) == 8  # the head is unchanged


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
    task = heads.rig_task(shapes, heads.RigWishes(str(tmp_path / "a.dna"), 40, 8, 0.1))
    task.start()
    task.cancel()
    assert not task.is_running()
    assert task.result is None
    assert "stopped" in str(task.error)
    assert not list(tmp_path.iterdir())


def _add(name, geometry, shapes=None, place=(0, 0, 0), parent=None):
    """Add a mesh object.

    Args:
        name: name of the object, the mesh and its material.
        geometry: (points in centimetres with y up, polygons).
        shapes: name of a shape key -> displacements, like the points; None: no shape keys.
        place: location of the object in metres.
        parent: parent object, or None.
    """
    points, faces = geometry
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(to_blender(points).tolist(), [], np.asarray(faces).tolist())
    mesh.materials.append(bpy.data.materials.new(name))
    item = bpy.data.objects.new(name, mesh)
    item.parent, item.location = parent, place
    bpy.context.scene.collection.objects.link(item)
    if shapes:
        item.shape_key_add(name="Basis")
    for key_name, delta in (shapes or {}).items():
        key = item.shape_key_add(name=key_name)
        key.data.foreach_set("co", to_blender(points + delta).astype(np.float32).ravel())
        key.value = 0.0
    return item


@pytest.fixture
def whole_head():
    """A head that looks along +Y, teeth, eyes and hair with an armature as parent, and a cube.

    The teeth have shape keys with the names of the head's shape keys. The cube is apart and has no
    parent. Head and eyes are selected. The eyes, which have no shape keys, are the active object.
    Returns the head.
    """
    armature = bpy.data.objects.new("Body", bpy.data.armatures.new("Body"))
    bpy.context.scene.collection.objects.link(armature)
    armature.rotation_euler = (0.0, 0.0, np.pi)
    points, faces, shapes = likenesses.skull()
    row, moved = likenesses.with_moving_teeth(shapes)
    left, right = likenesses.eyes()
    for name, geometry, keys in (
        ("Head", (points, faces), shapes),
        ("Teeth", row, moved),
        ("Eyes", likenesses.joined(left, right), None),
        ("Hair", likenesses.ball([0, 5, -3], 10.5), None),
    ):
        _add(name, geometry, keys, (1.0, 2.0, 0.5), armature)
    _add("Cube", likenesses.slab([0, 0, 0], [5, 5, 5]))
    for item in bpy.context.scene.objects:
        item.select_set(item.name in ("Head", "Eyes"))
    bpy.context.view_layer.objects.active = bpy.data.objects["Eyes"]
    bpy.context.view_layer.update()
    return bpy.data.objects["Head"]


def test_the_selected_meshes_and_those_of_their_armature_are_one_face(whole_head, tmp_path):
    path = tmp_path / "anna.dna"
    assert bpy.ops.risorius.make_rig.poll()  # a selected mesh has keys, the active one has none
    assert make(path, levels=2, joints=12) == {"FINISHED"}
    rig = made_face()
    assert [b.name for b in rig.data.bones][2:4] == ["FACIAL_L_Eye", "FACIAL_R_Eye"]
    named = {m.name.removeprefix("Head_"): m for m in scene.meshes(rig).values()}
    meshes = {n.partition("_lod0")[0]: m for n, m in named.items() if "lod0" in n}
    assert sorted(meshes) == ["Hair", "Head", "Teeth", "eyeLeft", "eyeRight"]
    for name, material in (("Hair", "Hair"), ("Teeth", "Teeth"), ("eyeLeft", "Eyes")):
        assert [m.name for m in meshes[name].data.materials] == [material]
    place = np.array(rig.matrix_world.translation)
    at_rest = {name: scene.evaluated(m) - place for name, m in meshes.items()}
    assert at_rest["eyeLeft"].mean(axis=0) == pytest.approx([0.032, -0.069, 0.03], abs=1e-3)
    for control, mesh, way in (
        ("mouthCornerPullL", "Head", [0.008, 0.003, 0.007]),
        ("jawOpen", "Teeth", None),
        ("eyeLookUpL", "eyeLeft", None),
    ):
        scene.set_controls(rig, **{f"CTRL_expressions.{control}": 1.0})
        moved = scene.evaluated(meshes[mesh]) - place - at_rest[mesh]
        scene.set_controls(rig, **{f"CTRL_expressions.{control}": 0.0})
        most = np.linalg.norm(moved, axis=1).argmax()
        assert np.linalg.norm(moved[most]) > 0.004
        if way is not None:
            assert moved[most] == pytest.approx(way, abs=2e-3)
            assert at_rest[mesh][most][0] > 0.02
    only = tmp_path / "only.dna"
    for item in bpy.context.scene.objects:
        item.select_set(item.name in ("Head", "Eyes"))
    bpy.context.view_layer.objects.active = whole_head
    assert make(only, levels=1, joints=2, use_family=False, height=200.0) == {"FINISHED"}
    dna = risorius.load(only)
    assert [n.partition("_lod")[0] for n in dna.mesh_names] == ["Head", "eyeLeft", "eyeRight"]
    assert np.ptp(np.asarray(dna.meshes[0].positions)[:, 1]) == pytest.approx(20.0, abs=0.1)


def test_a_packed_roughness_of_a_gltf_is_read_in_its_green(tmp_path):
    from risorius.cli import main
    from risorius.files.png import png

    points, faces, shapes = likenesses.skull()
    head = likenesses.mesh("Head", (points, faces), shapes, material=0)
    rough = {"metallicRoughnessTexture": {"index": 0}}
    materials = [{"name": "Skin", "pbrMetallicRoughness": rough}]
    picture = png(np.full((4, 4, 3), [0.0, 0.8, 1.0]))
    likenesses.save_glb(tmp_path / "h.glb", likenesses.placed([head]), materials, [picture])
    (tmp_path / "h.toml").write_text(
        '[source]\nneutral = "h.glb"\n[joints]\ncount = 2\nrounds = 1\n[lods]\ncount = 1\n'
    )
    assert main(["author", str(tmp_path / "h.toml"), "-o", str(tmp_path / "h.dna")]) == 0
    rig = scene.load(tmp_path / "h.dna")
    tree = scene.meshes(rig)[0].data.materials[0].node_tree
    surface = next(n for n in tree.nodes if n.type == "BSDF_PRINCIPLED")
    link = surface.inputs["Roughness"].links[0]
    assert link.from_socket.name == "Green"
    assert link.from_node.inputs[0].links[0].from_node.image.name.startswith("Skin_orm")


def test_the_tab_offers_it_while_a_mesh_with_keys_is_selected(head, dna_file):
    panel = scene.submodule("ui.face.panel").RISORIUS_PT_character
    assert "risorius.make_rig" in drawn(panel).operators
    rig = scene.load(dna_file)
    bpy.context.view_layer.objects.active = head
    assert "risorius.make_rig" in drawn(panel).operators
    bpy.ops.object.select_all(action="DESELECT")
    bpy.context.view_layer.objects.active = scene.meshes(rig)[0]
    assert "risorius.make_rig" not in drawn(panel).operators
