# SPDX-License-Identifier: MIT
"""Computes vertices of a DNA file from its bytes, with struct and NumPy, without Risorius.

Written from the description of the format (big-endian; an index table of layers; sections of
lists). Reads files from version 2.2 on that rotate in the order x, y, z with positive signs, and
whose behavior has only raw controls, correctives (products), joint groups and blend shapes.
"""

import struct

import numpy as np


class Cursor:
    def __init__(self, data, at):
        self.data, self.at = data, at

    def number(self, kind):
        (value,) = struct.unpack_from(">" + kind, self.data, self.at)
        self.at += struct.calcsize(kind)
        return value

    def array(self, kind):
        count = self.number("I")
        dtype = np.dtype({"H": ">u2", "I": ">u4", "f": ">f4"}[kind])
        out = np.frombuffer(self.data, dtype, count, self.at)
        self.at += count * dtype.itemsize
        return out.astype(np.float64 if kind == "f" else np.int64)

    def text(self):
        size = self.number("I")
        self.at += size
        return bytes(self.data[self.at - size : self.at]).decode()

    def texts(self):
        return [self.text() for _ in range(self.number("I"))]

    def points(self):
        return np.stack([self.array("f") for _ in range(3)], axis=1)

    def levels(self):
        rows = self.array("H")
        lists = [self.array("H") for _ in range(self.number("I"))]
        return [lists[row] for row in rows]

    def table(self):
        return [self.array(kind) for kind in "HHffff"]


class Face:
    """A DNA file as arrays; vertices(raw, lod) returns posed vertices in the file's unit."""

    def __init__(self, data):
        assert data[:3] == b"DNA"
        generation, version, count = struct.unpack_from(">HHI", data, 3)
        assert generation == 2
        assert version >= 2
        self.layers = {}
        for entry in range(count):
            name, _, offset, size = struct.unpack_from(">4sIII", data, 11 + 16 * entry)
            assert offset + size <= len(data)
            self.layers[name.decode()] = (offset, size)
        self.data = data
        self._descriptor(self._at("desc"))
        self._definition(self._at("defn"))
        self._behavior(self._at("bhvr"))
        self._geometry(self._at("geom"))
        if "dsce" in self.layers:
            order, *signs = struct.unpack_from(">Iiii", data, self.layers["dsce"][0])
            assert order == 0
            assert signs == [1, 1, 1]

    def _at(self, layer):
        return Cursor(self.data, self.layers[layer][0])

    def _ends(self, layer, cursor):
        assert cursor.at == sum(self.layers[layer]), layer

    def _descriptor(self, c):
        self.name = c.text()
        c.at += 6
        self.metadata = {c.text(): c.text() for _ in range(c.number("I"))}
        self.unit, self.degrees = c.number("H"), c.number("H") == 0
        c.at += 6
        self.lod_count, _ = c.number("H"), c.number("H")
        c.text(), c.text()
        self._ends("desc", c)

    def _definition(self, c):
        self.lod_joints, self.lod_shapes, self.lod_maps, self.lod_meshes = (
            c.levels() for _ in range(4)
        )
        self.gui, self.raw, self.joints, self.channels, self.maps, self.meshes = (
            c.texts() for _ in range(6)
        )
        c.array("H"), c.array("H")
        self.parents = c.array("H")
        self.translations, self.rotations = c.points(), c.points()
        self._ends("defn", c)

    def _behavior(self, c):
        self.correctives = c.number("H")
        c.table()
        self.psds = c.array("H"), c.array("H"), c.array("f")
        c.at += 4
        self.groups = []
        for _ in range(c.number("I")):
            lods, inputs, outputs = c.array("H"), c.array("H"), c.array("H")
            values = c.array("f").reshape(len(outputs), len(inputs))
            c.array("H")
            self.groups.append((lods, inputs, outputs, values))
        self.shapes = c.array("H"), c.array("H"), c.array("H")
        c.array("H"), c.table()
        self._ends("bhvr", c)

    def _geometry(self, c):
        self.geometry = []
        for _ in range(c.number("I")):
            size = c.number("I")
            end = c.at + size
            mesh = {"positions": c.points(), "uvs": np.stack([c.array("f"), c.array("f")], axis=1)}
            mesh["normals"] = c.points()
            mesh["layouts"] = np.stack([c.array("I") for _ in range(3)], axis=1)
            mesh["faces"] = [c.array("I") for _ in range(c.number("I"))]
            c.number("H")
            mesh["skin"] = [(c.array("f"), c.array("H")) for _ in range(c.number("I"))]
            mesh["targets"] = [
                (c.points(), c.array("I"), c.number("H")) for _ in range(c.number("I"))
            ]
            assert c.at == end
            self.geometry.append(mesh)
        self._ends("geom", c)

    def _controls(self, raw):
        """float64: the values of the raw controls, then of the correctives.

        A corrective is the product of its weighted factors, clamped to 0..1.

        Args:
            raw: raw control -> value; all others are 0.
        """
        out = np.zeros(len(self.raw) + self.correctives)
        for name, value in raw.items():
            out[self.raw.index(name)] = value
        rows, columns, values = self.psds
        for row in np.unique(rows):
            factors = [
                out[c] * v for r, c, v in zip(rows, columns, values, strict=True) if r == row
            ]
            out[row] = np.clip(np.prod(factors), 0, 1)
        return out

    def _world(self, delta):
        """World matrices of joints in the neutral pose plus `delta`, float64[J, 4, 4]: v' = v M."""
        angles = self.rotations + delta[:, 3:6]
        angles = np.radians(angles) if self.degrees else angles
        out = []
        for joint, parent in enumerate(self.parents):
            m = np.eye(4)
            for axis in range(3):
                turn, (i, j) = np.eye(4), ((axis + 1) % 3, (axis + 2) % 3)
                turn[i, i] = turn[j, j] = np.cos(angles[joint, axis])
                turn[i, j] = np.sin(angles[joint, axis])
                turn[j, i] = -turn[i, j]
                m = m @ turn
            m[:3, :3] *= 1 + delta[joint, 6:9, None]
            m[3, :3] = self.translations[joint] + delta[joint, :3]
            assert parent <= joint
            out.append(m if parent == joint else m @ out[parent])
        return np.array(out)

    def vertices(self, raw, lod=0):
        """Posed vertices of all meshes of a LOD, concatenated, float64[V, 3].

        Args:
            raw: raw control -> value; all others are 0.
            lod: the level of detail.
        """
        controls = self._controls(raw)
        delta = np.zeros(9 * len(self.joints))
        for lods, inputs, outputs, values in self.groups:
            rows = lods[lod]
            delta[outputs[:rows]] += values[:rows] @ controls[inputs]
        lods, inputs, outputs = self.shapes
        weights = np.zeros(len(self.channels))
        weights[outputs[: lods[lod]]] = controls[inputs[: lods[lod]]]
        rest = self._world(np.zeros((len(self.joints), 9)))
        skin = np.linalg.inv(rest) @ self._world(delta.reshape(-1, 9))
        out = []
        for number in self.lod_meshes[lod]:
            mesh = self.geometry[number]
            points = mesh["positions"].copy()
            for deltas, places, channel in mesh["targets"]:
                points[places] += weights[channel] * deltas
            points = np.column_stack([points, np.ones(len(points))])
            for v, (shares, joints) in enumerate(mesh["skin"]):
                assert set(joints) <= set(self.lod_joints[lod].tolist())
                out.append(points[v] @ np.tensordot(shares / shares.sum(), skin[joints], 1))
        return np.array(out)[:, :3]
