# SPDX-License-Identifier: MIT
"""Reads .glb files by the specification and computes vertices for weights of morph targets."""

import json
import struct

import numpy as np
from risorius import _native

_KINDS = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
_MESHOPT = "EXT_meshopt_compression"


class GlbFile:
    def __init__(self, data):
        magic, version, size, length, kind = struct.unpack_from("<4sIII4s", data)
        assert (magic, version, size, kind) == (b"glTF", 2, len(data), b"JSON")
        self.json = json.loads(data[20 : 20 + length])
        at = 20 + length
        own, kind = struct.unpack_from("<I4s", data, at)
        assert kind == b"BIN\0"
        assert at + 8 + own == len(data)
        self.binary = data[at + 8 :]
        assert self.json["buffers"][0]["byteLength"] <= own

    def view(self, number):
        view = self.json["bufferViews"][number]
        packing = view.get("extensions", {}).get(_MESHOPT)
        if packing:
            begin = packing["byteOffset"]
            packed = self.binary[begin : begin + packing["byteLength"]]
            return _native.unpack_buffer(
                bytes(packed), packing["count"], packing["byteStride"], packing["mode"], "NONE"
            )
        begin = view.get("byteOffset", 0)
        assert begin % 4 == 0
        return self.binary[begin : begin + view["byteLength"]]

    def numbers(self, number):
        """Values of an accessor, float64[n, k].

        Fails if the file states other least and largest values (min, max) than its data have.
        """
        about = self.json["accessors"][number]
        kind, width = np.dtype(_KINDS[about["componentType"]]), _WIDTHS[about["type"]]
        out = np.zeros((about["count"], width), kind)
        if "bufferView" in about:
            view = self.json["bufferViews"][about["bufferView"]]
            stride = view.get("byteStride", kind.itemsize * width)
            rows = np.frombuffer(self.view(about["bufferView"]), np.uint8)
            rows = rows[: stride * about["count"]].reshape(-1, stride)
            out = rows[:, : kind.itemsize * width].copy().view(kind)
        if sparse := about.get("sparse"):
            rows = np.frombuffer(
                self.view(sparse["indices"]["bufferView"]),
                _KINDS[sparse["indices"]["componentType"]],
            )
            assert (np.diff(rows.astype(int)) > 0).all()
            assert len(rows) == sparse["count"]
            values = np.frombuffer(self.view(sparse["values"]["bufferView"]), kind)
            out[rows] = values.reshape(-1, width)
        if "min" in about:
            assert np.array_equal(out.min(axis=0), about["min"])
            assert np.array_equal(out.max(axis=0), about["max"])
        values = out.astype(np.float64)
        if about.get("normalized"):
            values = np.maximum(values / np.iinfo(kind).max, -1)
        return values

    def meshes(self):
        """Name of a node with a mesh -> (node, mesh), both as JSON."""
        nodes = [node for node in self.json["nodes"] if "mesh" in node]
        return {node["name"]: (node, self.json["meshes"][node["mesh"]]) for node in nodes}

    def names(self, name):
        return self.meshes()[name][1].get("extras", {}).get("targetNames", [])

    def positions(self, name, weights=None, kind="POSITION", world=None):
        """Vertices of a mesh in the scene, float64[V, 3], for weights of its targets.

        Args:
            name: name of the node that has the mesh.
            weights: morph target -> weight; all others are 0.
            kind: attribute of the vertices to return; only positions are moved into the scene: by
                the skin, or by the scale and translation of the node if it has no skin.
            world: node index -> float64[4, 4], world matrices of joints; None: at rest.

        """
        node, mesh = self.meshes()[name]
        [primitive] = mesh["primitives"]
        out = self.numbers(primitive["attributes"][kind])
        names = self.names(name)
        assert len(names) == len(primitive.get("targets", []))
        for target, called in zip(primitive.get("targets", []), names, strict=True):
            if weights and weights.get(called) and kind in target:
                out = out + weights[called] * self.numbers(target[kind])
        return self._placed(node, primitive, out, world) if kind == "POSITION" else out

    def _placed(self, node, primitive, points, world):
        if "skin" not in node:
            return points * node.get("scale", 1.0) + node.get("translation", [0, 0, 0])
        skin = self.json["skins"][node["skin"]]
        inverse = self.numbers(skin["inverseBindMatrices"]).reshape(-1, 4, 4).swapaxes(1, 2)
        world = self._world() if world is None else world
        moves = np.stack([world[j] @ inverse[i] for i, j in enumerate(skin["joints"])])
        joints = self.numbers(primitive["attributes"]["JOINTS_0"]).astype(int)
        weights = self.numbers(primitive["attributes"]["WEIGHTS_0"])
        assert np.allclose(weights.sum(axis=1), 1, atol=1e-6)
        blended = np.einsum("vk,vkij->vij", weights, moves[joints])
        return np.einsum("vij,vj->vi", blended, np.c_[points, np.ones(len(points))])[:, :3]

    def _world(self):
        out = {}

        def walk(number, above):
            node = self.json["nodes"][number]
            own = np.eye(4)
            own[:3, :3] = _turn(*node.get("rotation", [0, 0, 0, 1]))
            own[:3, 3] = node.get("translation", [0, 0, 0])
            out[number] = above @ own
            for child in node.get("children", []):
                walk(child, out[number])

        for number in self.json["scenes"][0]["nodes"]:
            walk(number, np.eye(4))
        return out


def _turn(x, y, z, w):
    """The rotation matrix of a unit quaternion, float64[3, 3]."""
    assert abs(x * x + y * y + z * z + w * w - 1) < 1e-6
    a, b = np.array([x, y, z]), np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) * (w * w - a @ a) + 2 * np.outer(a, a) + 2 * w * b
