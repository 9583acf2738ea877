# SPDX-License-Identifier: MIT
"""Writes GLB files for tests, with or without compression."""

import json
import struct

import face_shapes
import numpy as np
from risorius import _native

TURN = [0.0, 0.6, 0.0, 0.8]  # a quaternion, rotation about y
SCALE, SHIFT = 2.0, [1.0, 2.0, 3.0]
MESHOPT = "EXT_meshopt_compression"


class Glb:
    """A GLB to which buffer views and accessors are added one after the other."""

    def __init__(self):
        self.binary = b""
        self.json = {
            "asset": {"version": "2.0"}, "accessors": [], "bufferViews": [], "meshes": [],
            "buffers": [{}],
        }  # fmt: skip

    def packed(self, data, stride, mode="ATTRIBUTES", filter_name="NONE", seen=True):
        """Add a buffer view that meshoptimizer compresses; its fallback buffer has no data.

        Args:
            data: bytes to compress.
            stride: bytes per element.
            mode: mode of EXT_meshopt_compression.
            filter_name: filter that was already applied to `data`.
            seen: True: the buffer view states a byteStride.

        Returns:
            The index of the buffer view.
        """
        count = len(data) // stride
        packed = _native.pack_buffer(data, count, stride, mode, filter_name)
        own = self.json["bufferViews"][self.view(packed)]
        packing = {**own, "byteStride": stride, "mode": mode, "count": count}
        if filter_name != "NONE":
            packing["filter"] = filter_name
        own.update(buffer=1, byteOffset=0, byteLength=len(data), extensions={MESHOPT: packing})
        if seen:
            own["byteStride"] = stride
        self.json["buffers"][1:] = [
            {"byteLength": 1 << 20, "extensions": {MESHOPT: {"fallback": True}}}
        ]
        self.json["extensionsRequired"] = [MESHOPT]
        return len(self.json["bufferViews"]) - 1

    def of_view(self, view, kind, component, count, **more):
        row = {"bufferView": view, "type": kind, "componentType": component, "count": count}
        self.json["accessors"].append({**row, **more})
        return len(self.json["accessors"]) - 1

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


def egg(path, *, sparse=True, change=None, matrices=None):
    """Write the head of face_shapes as two primitives. The second primitive has duplicated
    vertices.

    Args:
        path: path of the GLB.
        sparse: True: displacements of the morph targets are sparse accessors.
        change: function that changes the JSON before it is written.
        matrices: values of an additional MAT4 accessor.

    Returns:
        Positions in m before the nodes' transform, float64[V, 3]; name of a shape -> displacements
        in m; texture coordinates of all written vertices, which include the duplicates.
    """
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
    if matrices is not None:
        glb.accessor(matrices, "MAT4")
    if change:
        change(glb.json)
    glb.save(path)
    return positions / 100, {name: delta / 100 for name, delta in moved.items()}, uvs
