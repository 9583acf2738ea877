# SPDX-License-Identifier: GPL-3.0-or-later
"""Exported faces have the right look in programs other than Blender."""

import importlib.util
import json
import shutil
import sys
from pathlib import Path

import bpy
import limits
import numpy as np
import pytest
from support import looks, scene
from support.animation import animate
from support.faces import _mesh as patch
from support.faces import small_face

READERS = Path(__file__).parents[1] / "support" / "readers.py"
NEEDS = {"GLTF": "trimesh", "FBX": "PIL", "USD": "pxr", "ALEMBIC": "alembic3d"}
ENDINGS = {"GLTF": "glb", "FBX": "fbx", "USD": "usdc", "ALEMBIC": "abc"}
LIP, BROW = (0.69, 0.33, 0.31), (0.19, 0.13, 0.10)  # colours in the head's texture
SHOWN = ("head", "eyeLeft", "teeth", "eyelashes", "eyeshell")


def _face(tmp_path):
    """Save a face with a texture for its head, and meshes without textures. Returns the path."""
    random = np.random.default_rng(3)
    where = np.array([3.0, 158.0, 9.0])
    meshes = {"head_lod0_mesh": patch(random, (12, 14), 10.0, where * (0, 1, 0), (1, 2, 3), (0,))}
    meshes["eyeLeft_lod0_mesh"] = patch(random, (33, 33), 1.2, where, (4,), ())
    meshes["teeth_lod0_mesh"] = patch(random, (9, 9), 3.0, (0.0, 154.0, 6.0), (3,), ())
    meshes["eyelashes_lod0_mesh"] = patch(random, (9, 9), 1.3, where, (2,), ())
    meshes["eyeshell_lod0_mesh"] = patch(random, (9, 9), 1.22, where, (2,), ())
    path = tmp_path / "small.dna"
    looks.set_meshes(small_face(), meshes).save(str(path))
    folder = tmp_path / "small_textures"
    folder.mkdir()
    looks.write_image(folder / "head_color.png", looks.halves(LIP, BROW))
    return path


def _export(kind, folder, **options):
    path = folder / f"out.{ENDINGS[kind]}"
    done = bpy.ops.risorius.export_animation(
        filepath=str(path), format=kind, range="CUSTOM", start=1, end=10, **options
    )
    assert done == {"FINISHED"}
    return path


def _read(kind, path):
    """The content of an exported file, as a program other than Blender reads it."""
    if importlib.util.find_spec(NEEDS[kind]) is None or bpy.app.binary_path:
        pytest.skip(f"EXTRA NOT RUN: {kind} files read by {NEEDS[kind]}, which is not there")
    if kind == "FBX" and shutil.which("assimp") is None:
        pytest.skip("EXTRA NOT RUN: FBX files read by Assimp, which is not there")
    command = [sys.executable, str(READERS), kind, str(path)]
    done = limits.run(command, 100)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def _outside(kind, found):
    """The vertices of a mesh that another program has read, in Blender's axes and metres."""
    points = np.array(found["points"])
    if kind == "USD":  # the file states that z is up
        return points
    points = np.stack([points[:, 0], -points[:, 2], points[:, 1]], axis=1)
    return points * 0.01 if kind == "FBX" else points


def _everything():
    """The state that an export must not change.

    It contains names of data-blocks, numbers of users of materials, UV layers, material slots,
    sizes of node trees, and the render engine.
    """
    kinds = ("objects", "meshes", "scenes", "actions", "shape_keys", "armatures", "images")
    found = {k: sorted(x.name for x in getattr(bpy.data, k)) for k in kinds}
    # Numbers of users are compared only for materials. Numbers of users of images differ, because
    # Blender 4.2 counts a copied material twice as a user of its images.
    found["materials"] = sorted((x.name, x.users) for x in bpy.data.materials)
    found["layers"] = {m.name: [y.name for y in m.uv_layers] for m in bpy.data.meshes}
    found["slots"] = {o.name: [s.material.name for s in o.material_slots] for o in bpy.data.objects}
    found["trees"] = {m.name: len(m.node_tree.nodes) for m in bpy.data.materials}
    return found | {"engine": bpy.context.scene.render.engine}


@pytest.mark.parametrize("kind", ENDINGS)
def test_another_program_finds_colours_names_and_time(kind, tmp_path, capfd):
    if kind == "USD" and not bpy.app.build_options.usd:
        pytest.skip("EXTRA NOT RUN: this Blender has no USD exporter")
    if kind == "ALEMBIC" and not bpy.app.build_options.alembic:
        pytest.skip("EXTRA NOT RUN: this Blender has no Alembic exporter")
    rig = scene.load(_face(tmp_path))
    animate(rig)
    bpy.context.scene.render.fps = 30
    rest = {i.name.removeprefix("Small_"): i for i in scene.meshes(rig).values()}
    before = _everything()
    capfd.readouterr()
    path = _export(kind, tmp_path, texture_size=128)
    _is_quiet(capfd.readouterr())
    assert _everything() == before
    found = _read(kind, path)
    assert found["end"] - found["begin"] == pytest.approx(9 / 30, abs=1e-5)
    assert set(found["meshes"]) == {f"{name}_lod0_mesh" for name in SHOWN}
    for name, mesh in found["meshes"].items():
        assert mesh["material"] == f"Small_{name.removesuffix('_lod0_mesh')}"
        points = _outside(kind, mesh)
        wanted = np.array([v.co for v in rest[name].data.vertices])
        if kind != "ALEMBIC":  # Alembic contains only the moved vertices
            assert points.min(axis=0) == pytest.approx(wanted.min(axis=0), abs=1e-5)
            assert points.max(axis=0) == pytest.approx(wanted.max(axis=0), abs=1e-5)
    _has_names(kind, found["names"])
    _has_colors(kind, found)


def _is_quiet(captured):
    """Check that Blender printed only the operator's report (`Info: out.…`) and empty lines."""
    lines = [x for x in captured.out.splitlines() if x.strip()]
    assert captured.err == ""
    assert [x for x in lines if not x.startswith("Info: out.")] == []


def _has_names(kind, names):
    assert not [n for n in names if "control" in n.lower() or "_shape_" in n.lower()], names
    assert not [n for n in names if "risorius" in n.lower() or "lent" in n], names
    assert "Small" in names
    if kind == "ALEMBIC":
        return
    assert {"spine_04", "neck_01", "head", "FACIAL_C_Jaw", "FACIAL_L_Eye"} <= set(names)
    if kind != "FBX":  # Assimp 5.2 does not read the names of an FBX file's shapes
        assert "jaw" in names


def _has_colors(kind, found):
    """Check the colours: the head's texture, pupil, iris and sclera, light teeth, dark lashes."""
    meshes = {n.removesuffix("_lod0_mesh"): m for n, m in found["meshes"].items()}
    head = np.array(meshes["head"]["colors"])
    x = _outside(kind, meshes["head"])[:, 0]
    np.testing.assert_allclose(np.median(head[x < -0.02, :3], axis=0), LIP, atol=0.01)
    np.testing.assert_allclose(np.median(head[x > 0.02, :3], axis=0), BROW, atol=0.01)
    eye = _outside(kind, meshes["eyeLeft"])
    away = np.hypot(*(eye - (eye.min(axis=0) + eye.max(axis=0)) / 2)[:, [0, 2]].T)
    colors = np.array(meshes["eyeLeft"]["colors"])[:, :3].mean(axis=1)
    radius = np.ptp(eye[:, 2]) / 2
    assert colors[away < 0.1 * radius].max() < 0.1  # the pupil
    assert 0.05 < np.median(colors[(away > 0.2 * radius) & (away < 0.35 * radius)]) < 0.6
    assert np.median(colors[away > 0.6 * radius]) > 0.6  # the sclera
    teeth = np.median(np.array(meshes["teeth"]["colors"]), axis=0)
    assert teeth[:3].min() > 0.45
    lashes = np.array(meshes["eyelashes"]["colors"])
    assert lashes[:, :3].max() < 0.35
    assert np.ptp(lashes[:, 3]) > 0.9
    if found["opaque"]:  # Alembic contains no materials
        clear = {n.removeprefix("Small_") for n, value in found["opaque"].items() if not value}
        assert clear == {"eyelashes", "eyeshell"}


def test_what_fails_leaves_names_and_materials(tmp_path):
    rig = scene.load(_face(tmp_path))
    animate(rig)
    before = _everything()
    (tmp_path / "file").write_text("no folder")
    with pytest.raises(RuntimeError, match="^Error: [^\n]+\n?$"):
        _export("FBX", tmp_path / "file", texture_size=64)
    assert _everything() == before


def test_a_file_has_the_right_names_although_others_bear_them(tmp_path):
    rig = scene.load(_face(tmp_path))
    animate(rig)
    taken = [bpy.data.objects.new(n, None) for n in ("Small", "head_lod0_mesh")]
    path = _export("GLTF", tmp_path, bake_materials=False)
    assert [o.name for o in taken] == ["Small", "head_lod0_mesh"]
    content = path.read_bytes()
    tree = json.loads(content[20 : 20 + int.from_bytes(content[12:16], "little")])
    names = [n["name"] for n in tree["nodes"]]
    assert {"Small", "head_lod0_mesh"} <= set(names)
    assert not {"Small.001", "head_lod0_mesh.001"} & set(names)


def test_a_mesh_without_a_uv_map_gets_one_with_its_colours(tmp_path):
    rig = scene.load(_face(tmp_path))
    animate(rig)
    eye = next(m for m in scene.meshes(rig).values() if "eyeLeft" in m.name).data
    eye.uv_layers.remove(eye.uv_layers[0])
    found = _read("GLTF", _export("GLTF", tmp_path, texture_size=512))
    assert len(eye.uv_layers) == 0
    _has_colors("GLTF", found)


def _gltf(path):
    content = path.read_bytes()
    return json.loads(content[20 : 20 + int.from_bytes(content[12:16], "little")])


def test_a_material_without_a_shader_is_what_the_solid_view_shows(tmp_path):
    rig = scene.load(_face(tmp_path))
    animate(rig)
    teeth = next(m for m in scene.meshes(rig).values() if "teeth" in m.name)
    plain = bpy.data.materials.new("Plain")
    plain.diffuse_color, plain.roughness = (0.8, 0.4, 0.2, 1.0), 0.25
    plain.use_nodes = True
    plain.node_tree.nodes.clear()
    teeth.data.materials.clear()
    teeth.data.materials.append(plain)
    tree = _gltf(_export("GLTF", tmp_path, texture_size=64))
    found = next(m for m in tree["materials"] if m["name"] == "Plain")["pbrMetallicRoughness"]
    assert np.allclose(found["baseColorFactor"][:3], (0.8, 0.4, 0.2), atol=1e-6)
    assert np.isclose(found["roughnessFactor"], 0.25)
    assert teeth.material_slots[0].material == plain


def test_a_mesh_without_room_for_a_uv_map_is_one_sentence(tmp_path):
    rig = scene.load(_face(tmp_path))
    animate(rig)
    meshes = [m.data for m in scene.meshes(rig).values()]
    for mesh in meshes:
        flat = np.empty(2 * len(mesh.loops), np.float32)
        mesh.uv_layers[0].uv.foreach_get("vector", flat)
        mesh.uv_layers[0].uv.foreach_set("vector", 5 * flat)  # outside of the baked picture
        while len(mesh.uv_layers) < 8:
            mesh.uv_layers.new(name=f"own{len(mesh.uv_layers)}")
    before = _everything()
    with pytest.raises(RuntimeError, match="has eight UV maps: remove one to bake its materials"):
        _export("GLTF", tmp_path, texture_size=64)
    assert _everything() == before
    assert {len(mesh.uv_layers) for mesh in meshes} == {8}
