# SPDX-License-Identifier: MIT
"""Tests heads from glTF: seams, sparse targets, strides, rotated and scaled nodes.

Unsuitable files are refused.
"""

import command_line
import face_shapes
import numpy as np
import pytest
from glb_files import SCALE, SHIFT, TURN, egg, world
from risorius.author.input import gltf
from risorius.author.input.obj import ShapeFileError
from risorius.base.budget import BudgetError
from risorius.importing.errors import AnimationFileError


@pytest.mark.parametrize("sparse", [True, False])
def test_a_head_is_what_was_written(tmp_path, sparse):
    path = tmp_path / "egg.glb"
    positions, moved, uvs = egg(path, sparse=sparse)
    mesh, found = gltf.read_gltf(path)
    assert mesh.positions.shape == positions.shape  # double vertices are merged; the order stays
    np.testing.assert_allclose(mesh.positions, world(positions) + SHIFT, atol=1e-6)
    assert list(found) == list(moved)
    for name, delta in moved.items():
        np.testing.assert_allclose(found[name], world(delta), atol=1e-6)
    assert len(mesh.faces) == 2 * len(face_shapes.head()[1])
    for face, uv_face in zip(mesh.faces, mesh.uv_faces, strict=True):
        for vertex, uv in zip(face, uv_face, strict=True):
            assert vertex == uv or uv >= len(positions)  # the second copy of a double vertex
    np.testing.assert_allclose(mesh.uvs[: len(uvs)], [1, -1] * uvs + [0, 1], atol=1e-6)


def outward(mesh):
    """The fraction of triangles whose front faces away from the middle of the mesh."""
    points = mesh.positions[np.array(mesh.faces)]
    normals = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    return (
        np.sum(normals * (points.mean(axis=1) - mesh.positions.mean(axis=0)), axis=1) > 0
    ).mean()


def test_a_mirror_shows_the_backs_of_no_polygons(tmp_path):
    path = tmp_path / "egg.glb"
    egg(path)
    plain = outward(gltf.read_gltf(path)[0])
    positions, moved, _ = egg(
        path, change=lambda j: j["nodes"][1].update(scale=[-SCALE, SCALE, SCALE])
    )
    mesh, found = gltf.read_gltf(path)
    assert outward(mesh) == plain
    np.testing.assert_allclose(mesh.positions, world(positions * [-1, 1, 1]) + SHIFT, atol=1e-6)
    name = "mouthSmileLeft"
    np.testing.assert_allclose(found[name], world(moved[name] * [-1, 1, 1]), atol=1e-6)


def skinned(path, change=None):
    """Write a skinned head as programs that quantize meshes do.

    The skin's matrices contain the scale to metres, the neck is posed, and the node of the mesh is
    far away.
    """

    def posed(document):
        document["nodes"] = [
            {"name": "mesh", "mesh": 0, "skin": 0, "translation": [9, 9, 9], "scale": [5, 5, 5]},
            {"children": [2], "translation": SHIFT, "rotation": TURN, "scale": [SCALE] * 3},
            {"children": [3], "translation": [0, 0.5, 0]},
            {"translation": [0, 0.2, 0], "rotation": [0.6, 0, 0, 0.8]},
        ]
        document["skins"] = [
            {"joints": [3, 2], "inverseBindMatrices": len(document["accessors"]) - 1}
        ]
        if change:
            change(document)

    matrices = []
    for shift in (-0.7, -0.5):
        matrix = np.eye(4)
        matrix[1, 3] = shift
        matrices.append((matrix @ np.diag([0.5, 0.5, 0.5, 1.0])).T)
    return egg(path, change=posed, matrices=np.array(matrices, "<f4").reshape(-1, 16))


def test_a_skinned_head_stands_as_it_was_bound(tmp_path):
    path = tmp_path / "egg.glb"
    positions, moved, _ = skinned(path)
    mesh, found = gltf.read_gltf(path)
    np.testing.assert_allclose(mesh.positions, world(positions / 2) + SHIFT, atol=1e-6)
    np.testing.assert_allclose(found["jawOpen"], world(moved["jawOpen"] / 2), atol=1e-6)

    def said(**values):
        skinned(path, lambda j: j["skins"][0].update(values))
        with pytest.raises(AnimationFileError) as error:
            gltf.read_gltf(path)
        assert str(error.value).startswith(str(path))
        return str(error.value)

    assert "skins[0].joints: nodes were expected, found" in said(joints=[])
    assert "nodes[9] was expected, there are 4" in said(joints=[9])
    assert "skins[0].inverseBindMatrices: 3 were expected, found 2" in said(joints=[1, 2, 3])
    assert "MAT4 was expected, found 'VEC3'" in said(inverseBindMatrices=0)


def test_the_command_makes_a_rig_of_it(tmp_path):
    egg(tmp_path / "egg.glb", change=lambda j: j["nodes"].clear())
    spec = tmp_path / "spec.toml"
    spec.write_text('[source]\nneutral = "egg.glb"\n[joints]\ncount = 20\n', encoding="utf-8")
    done = command_line.run("author", spec, "--names", text=True)
    assert '"jawOpen" = "jawOpen"' in done.stdout
    out = tmp_path / "egg.dna"
    done = command_line.run("author", spec, "-o", out, text=True)
    assert done.returncode == 0, done.stderr
    assert "20 new joints" in done.stdout


def test_what_is_no_head_is_one_sentence(tmp_path):
    path = tmp_path / "egg.glb"

    def said(change, error=(ShapeFileError, AnimationFileError), mesh=""):
        egg(path, change=change)
        with pytest.raises(error) as found:
            gltf.read_gltf(path, mesh)
        assert str(found.value).startswith(str(path))
        return str(found.value)

    def primitive(key, value):
        return lambda j: j["meshes"][0]["primitives"][1].update({key: value})

    def accessor(index, **values):
        return lambda j: j["accessors"][index].update(values)

    none = [{"primitives": []}]
    assert "morph targets was expected, found none" in said(lambda j: j.update(meshes=none))
    assert "one of Egg was expected, found Ham" in said(None, mesh="Ham")
    assert "triangles were expected" in said(primitive("mode", 1))
    assert "accessors[a number of 401 digits] was expected, there are" in said(
        lambda j: j["meshes"][0]["primitives"][0].update(indices=10**400)
    )

    def crowd(document):
        """Give the mesh 20,000 primitives that share all vertices and have no indices."""
        shape = {"POSITION": 0}
        document["meshes"][0]["primitives"] = [{"attributes": shape, "targets": [shape]}] * 20_000

    assert "POSITION: a bufferView was expected, found none; the file requires EXT_new" in said(
        lambda j: j.update(extensionsRequired=["EXT_new"]) or j["accessors"][0].pop("bufferView")
    )
    assert "bytes more than the" in said(crowd, BudgetError)
    assert "nodes[1]: it hangs on itself" in said(lambda j: j["nodes"][1].update(children=[0]))
    assert "componentType: one of 5120, 5121, 5122, 5123, 5126 was expected, found 5125" in said(
        accessor(0, componentType=5125)
    )
    assert "meshes[0]: triangles were expected, found none" in said(
        lambda j: [
            j["accessors"][p["indices"]].update(count=0) for p in j["meshes"][0]["primitives"]
        ]
    )
    assert "componentType: one of 5120" in said(accessor(0, componentType=[]))
    assert "found a list" in said(accessor(0, type=[1]))
    huge = 10**400
    assert "found a number of 401 digits" in said(accessor(0, count=huge))
    assert "found a number of 401 digits" in said(
        lambda j: j["bufferViews"][0].update(byteOffset=huge)
    )
    assert "3 finite numbers" in said(lambda j: j["nodes"][1].update(scale=[1, 1, huge]))
    assert "as many morph targets in all" in said(primitive("targets", []))
    assert "a table was expected" in said(primitive("targets", [3] * 7))
    assert "VEC3 was expected" in said(accessor(0, type="VEC4"))
    assert "the buffer is shorter" in said(accessor(0, count=99_999))
    assert "a stride of 12 bytes or more" in said(
        lambda j: j["bufferViews"][0].update(byteStride=8)
    )
    assert "one of 5121, 5123, 5125 was expected, found 5120" in said(
        accessor(9, componentType=5120)
    )
    assert "of 528 vertices were expected" in said(accessor(9, bufferView=0, count=9))
    assert "3 finite numbers were expected" in said(
        lambda j: j["nodes"][1].update(scale=[1, "2", 3])
    )
    assert "indices: row " in said(accessor(2, count=3))
    assert "indices and values" in said(accessor(2, sparse={"count": 1}))
