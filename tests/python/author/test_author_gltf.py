# SPDX-License-Identifier: MIT
"""Heads from glTF: seams, sparse targets, strides, a node that turns and scales; and refusals."""

import json
import struct

import command_line
import face_shapes
import numpy as np
import pytest
from risorius.author.input import gltf
from risorius.author.input.obj import ShapeFileError
from risorius.importing.errors import AnimationFileError

TURN = [0.0, 0.6, 0.0, 0.8]  # a quaternion about y
SCALE, SHIFT = 2.0, [1.0, 2.0, 3.0]


class Glb:
    """A GLB that is written piece by piece."""

    def __init__(self):
        self.binary = b""
        self.json = {
            "asset": {"version": "2.0"}, "accessors": [], "bufferViews": [], "meshes": [],
            "buffers": [{}],
        }  # fmt: skip

    def view(self, data, stride=0):
        self.binary += b"\0" * (-len(self.binary) % 4)
        row = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)}
        if stride:
            row["byteStride"] = stride
        self.binary += data
        self.json["bufferViews"].append(row)
        return len(self.json["bufferViews"]) - 1

    def accessor(self, array, kind, component=5126, stride=0):
        array = np.asarray(array)
        data = array.tobytes()
        if stride:
            rows = array.reshape(len(array), -1)
            data = b"".join(row.tobytes().ljust(stride, b"\xee") for row in rows)
        row = {"bufferView": self.view(data, stride), "type": kind, "count": len(array),
               "componentType": component}  # fmt: skip
        self.json["accessors"].append(row)
        return len(self.json["accessors"]) - 1

    def sparse(self, array):
        moved = np.flatnonzero(np.any(array, axis=1)).astype("<u2")
        row = {
            "type": "VEC3", "count": len(array), "componentType": 5126,
            "sparse": {
                "count": len(moved),
                "indices": {"bufferView": self.view(moved.tobytes()), "componentType": 5123},
                "values": {"bufferView": self.view(array[moved].astype("<f4").tobytes())},
            },
        }  # fmt: skip
        self.json["accessors"].append(row)
        return len(self.json["accessors"]) - 1

    def save(self, path):
        binary = self.binary + b"\0" * (-len(self.binary) % 4)
        self.json["buffers"][0]["byteLength"] = len(binary)
        text = json.dumps(self.json).encode()
        text += b" " * (-len(text) % 4)
        length = 12 + 8 + len(text) + 8 + len(binary)
        path.write_bytes(
            struct.pack("<4sII", b"glTF", 2, length)
            + struct.pack("<I4s", len(text), b"JSON") + text
            + struct.pack("<I4s", len(binary), b"BIN\0") + binary
        )  # fmt: skip


def world(points):
    x, y, z, w = TURN
    matrix = np.array([[1 - 2 * y * y, 0, 2 * y * w], [0, 1, 0], [-2 * y * w, 0, 1 - 2 * y * y]])
    assert x == z == 0
    assert abs(y * y + w * w - 1) < 1e-12
    return SCALE * points @ matrix.T


def egg(path, *, sparse=True, change=None):
    """The formula's head: two primitives, every vertex of the second column twice."""
    positions, faces = face_shapes.head()
    moved = face_shapes.expressions(positions)
    triangles = np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])
    double = np.arange(len(positions)).reshape(face_shapes.DOWN, -1)[:, 1]
    order = np.concatenate([np.arange(len(positions)), double])
    again = dict(zip(double.tolist(), range(len(positions), len(order)), strict=True))
    second = triangles[len(triangles) // 2 :].copy()
    for old, new in again.items():
        second[second == old] = new
    glb = Glb()
    place = glb.accessor(positions[order].astype("<f4") / 100, "VEC3", stride=20)
    uvs = np.stack([np.linspace(0, 1, len(order)), np.linspace(1, 0, len(order))], axis=1)
    shared = {
        "attributes": {
            "POSITION": place,
            "TEXCOORD_0": glb.accessor(uvs.astype("<f4"), "VEC2"),
        },
        "targets": [
            {"POSITION": glb.sparse(delta[order] / 100) if sparse
             else glb.accessor((delta[order] / 100).astype("<f4"), "VEC3")}
            for delta in moved.values()
        ],
    }  # fmt: skip
    glb.json["meshes"] = [
        {
            "name": "Egg",
            "extras": {"targetNames": list(moved)},
            "primitives": [
                {**shared, "indices": glb.accessor(part.ravel().astype("<u4"), "SCALAR", 5125)}
                for part in (triangles[: len(triangles) // 2], second)
            ],
        }
    ]
    glb.json["nodes"] = [
        {"children": [1], "translation": SHIFT},
        {"mesh": 0, "rotation": TURN, "scale": [SCALE] * 3},
    ]
    if change:
        change(glb.json)
    glb.save(path)
    return positions / 100, {name: delta / 100 for name, delta in moved.items()}, uvs


@pytest.mark.parametrize("sparse", [True, False])
def test_a_head_is_what_was_written(tmp_path, sparse):
    path = tmp_path / "egg.glb"
    positions, moved, uvs = egg(path, sparse=sparse)
    mesh, found = gltf.read_gltf(path)
    assert mesh.positions.shape == positions.shape  # what was double is one, in the same order
    np.testing.assert_allclose(mesh.positions, world(positions) + SHIFT, atol=1e-6)
    assert list(found) == list(moved)
    for name, delta in moved.items():
        np.testing.assert_allclose(found[name], world(delta), atol=1e-6)
    assert len(mesh.faces) == 2 * len(face_shapes.head()[1])
    for face, uv_face in zip(mesh.faces, mesh.uv_faces, strict=True):
        for vertex, uv in zip(face, uv_face, strict=True):
            assert vertex == uv or uv >= len(positions)  # the second of a double one
    np.testing.assert_allclose(mesh.uvs[: len(uvs)], [1, -1] * uvs + [0, 1], atol=1e-6)


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
    assert "is not read: export it without" in said(
        lambda j: j.update(extensionsRequired=["KHR_draco_mesh_compression"])
    )
    assert "triangles were expected" in said(primitive("mode", 1))
    assert "VEC3 was expected" in said(accessor(0, componentType=[]))
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
    assert "of 528 vertices were expected" in said(accessor(9, componentType=5120))
    assert "3 finite numbers were expected" in said(
        lambda j: j["nodes"][1].update(scale=[1, "2", 3])
    )
    assert "indices: row " in said(accessor(2, count=3))
    assert "indices and values" in said(accessor(2, sparse={"count": 1}))
