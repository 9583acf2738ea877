# SPDX-License-Identifier: MIT
"""Writes small glTF bodies by the specification, without a library, and knows their vertices."""

import base64
import json
import struct

import numpy as np

# Bone -> (parent, metres to the left, metres up, metres to the front); from the origin.
BONES = {
    "Hips": ("", 0, 1.0, 0), "Spine": ("Hips", 0, 1.1, 0), "Spine1": ("Spine", 0, 1.25, 0),
    "Neck": ("Spine1", 0, 1.5, 0), "Head": ("Neck", 0, 1.6, 0.02),
    "LeftArm": ("Spine1", 0.2, 1.4, 0), "LeftForeArm": ("LeftArm", 0.45, 1.4, 0),
    "LeftHand": ("LeftForeArm", 0.7, 1.4, 0),
    "RightArm": ("Spine1", -0.2, 1.4, 0), "RightForeArm": ("RightArm", -0.45, 1.4, 0),
    "RightHand": ("RightForeArm", -0.7, 1.4, 0),
    "LeftUpLeg": ("Hips", 0.1, 0.95, 0), "LeftLeg": ("LeftUpLeg", 0.1, 0.5, 0),
    "LeftFoot": ("LeftLeg", 0.1, 0.08, 0),
    "RightUpLeg": ("Hips", -0.1, 0.95, 0), "RightLeg": ("RightUpLeg", -0.1, 0.5, 0),
    "RightFoot": ("RightLeg", -0.1, 0.08, 0),
}  # fmt: skip
EYES = {"LeftEye": ("Head", 0.03, 1.68, 0.1), "RightEye": ("Head", -0.03, 1.68, 0.1)}
PIXEL = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)
TURN = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0.0]])  # as exporters rotate a skeleton


class BodyFile:
    """A body file.

    Attributes:
        shown: name of a mesh -> its vertices at rest in metres, float64[V, 3].
    """

    def __init__(self, *, unit=1.0, back=False, eyes=False, prefix="mixamorig:"):
        """Make a body.

        Args:
            unit: length of the file's unit in metres.
            back: the body looks along -z instead of +z.
            eyes: add eye bones.
            prefix: beginning of the names of bones.
        """
        self.json = {"asset": {"version": "2.0"}, "nodes": [], "accessors": [], "bufferViews": [],
                     "meshes": [], "skins": [], "scene": 0, "scenes": [{"nodes": [0]}]}  # fmt: skip
        self.binary, self.shown = b"", {}
        flip = np.diag([-1.0, 1, -1]) if back else np.eye(3)
        bones = {**BONES, **(EYES if eyes else {})}
        self.places = {n: flip @ np.array(row[1:]) / unit for n, row in bones.items()}
        nodes = self.json["nodes"]
        half = 0.5**0.5
        nodes.append({"name": "Armature", "rotation": [half, 0, 0, half], "scale": [0.5] * 3,
                      "children": []})  # fmt: skip
        self.world, self.number = [np.eye(4)], {}
        self.world[0][:3, :3] = 0.5 * TURN
        for name, (parent, *_) in bones.items():
            self.number[name] = len(nodes)
            above = self.number.get(parent, 0)
            own = np.eye(4)
            own[:3, :3], own[:3, 3] = 0.5 * TURN, self.places[name]
            local = np.linalg.inv(self.world[above]) @ own
            nodes[above].setdefault("children", []).append(len(nodes))
            nodes.append({"name": prefix + name, "translation": local[:3, 3].tolist()})
            self.world.append(own)
        self._add_looks()
        self.unit = unit
        torso = flip @ [[0, 0.2, 0.2, 0], [1, 1, 1.4, 1.4], [0.1, 0.1, 0.1, 0.1]]
        self.add_skinned("Torso", torso.T / unit, ["Hips", "Spine1"])
        head = flip @ [[0, 0.05, 0.05, 0], [1.6, 1.6, 1.8, 1.8], [0.1, 0.1, 0.1, 0.1]]
        names = ["jawOpen", "eyeBlinkLeft", "mouthSmileLeft"]
        self.add_skinned("BodyHead", head.T / unit, ["Neck", "Head"], names)
        hat = flip @ [[0, 0.1, 0], [1.8, 1.8, 1.9], [0, 0, 0]]
        self._add_rigid("Hat", hat.T / unit)

    def _add_looks(self):
        view = self.view(PIXEL)
        self.json.update(
            images=[{"bufferView": view, "mimeType": "image/png", "name": "Cloth"}],
            samplers=[{"wrapS": 33071}],
            textures=[{"source": 0, "sampler": 0}],
            materials=[
                {"name": "unused"},
                {
                    "name": "Cloth",
                    "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}},
                    "extensions": {"VRMC_materials_mtoon": {"shadeMultiplyTexture": {"index": 0}}},
                },
            ],
        )

    def add_skinned(self, name, places, joints, targets=()):
        """Add a skinned mesh whose vertices are stored in a rotated, moved and scaled space.

        Args:
            name: name of the mesh's node.
            places: vertices at rest in the file's unit, float64[V, 3]; V is 4.
            joints: names of the two bones that carry the vertices, without prefix.
            targets: names of morph targets; each one moves all vertices along the stored y axis.
        """
        space = np.eye(4)
        space[:3, :3], space[:3, 3] = 2.0 * TURN.T, [0.1, 0.2, 0.3]
        own = np.c_[places, np.ones(len(places))] @ np.linalg.inv(space).T
        inverse = [np.linalg.inv(self.world[self.number[j]]) @ space for j in joints]
        flat = np.array([m.T.ravel() for m in inverse])
        skin = {"joints": [self.number[j] for j in joints],
                "inverseBindMatrices": self.accessor(flat, "<f4", "MAT4")}  # fmt: skip
        count = len(places)
        shares = np.linspace(0.2, 1, count)
        weights = np.c_[shares, 1 - shares, np.zeros((count, 2))]
        attributes = {
            "POSITION": self.accessor(own[:, :3], "<f4", "VEC3"),
            "NORMAL": self.accessor(np.tile([0, 1, 0], (count, 1)), "<f4", "VEC3"),
            "TEXCOORD_0": self.accessor(np.zeros((count, 2)), "<f4", "VEC2"),
            "JOINTS_0": self.accessor(np.tile([0, 1, 0, 0], (count, 1)), "u1", "VEC4"),
            "WEIGHTS_0": self.accessor(weights, "<f4", "VEC4"),
        }
        corners = self.accessor(np.array([[0], [1], [2], [0], [2], [3]]), "<u2", "SCALAR")
        primitive = {"attributes": attributes, "indices": corners, "material": 1}
        mesh = {"name": f"{name}Mesh", "primitives": [primitive]}
        if targets:
            moved = np.tile([0, 0.01, 0], (count, 1))
            primitive["targets"] = [{"POSITION": self.accessor(moved, "<f4", "VEC3")}] * len(
                targets
            )
            mesh["extras"] = {"targetNames": list(targets)}
        self._add(name, mesh, self.json["nodes"][0], places, skin=len(self.json["skins"]))
        self.json["skins"].append(skin)

    def _add_rigid(self, name, places):
        head = self.number["Head"]
        own = (np.c_[places, np.ones(len(places))] @ np.linalg.inv(self.world[head]).T)[:, :3]
        attributes = {"POSITION": self.accessor(own, "<f4", "VEC3")}
        mesh = {"name": name, "primitives": [{"attributes": attributes}]}
        self._add(name, mesh, self.json["nodes"][head], places)

    def _add(self, name, mesh, above, places, **more):
        self.shown[name] = places * self.unit
        above.setdefault("children", []).append(len(self.json["nodes"]))
        self.json["nodes"].append({"name": name, "mesh": len(self.json["meshes"]), **more})
        self.json["meshes"].append(mesh)

    def view(self, data):
        self.json["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)}
        )
        self.binary += data + b"\0" * (-len(data) % 4)
        return len(self.json["bufferViews"]) - 1

    def accessor(self, rows, dtype, kind):
        component = {"<f4": 5126, "u1": 5121, "<u2": 5123}[dtype]
        about = {"componentType": component, "count": len(rows), "type": kind}
        about["bufferView"] = self.view(np.asarray(rows).astype(dtype).tobytes())
        self.json["accessors"].append(about)
        return len(self.json["accessors"]) - 1

    def data(self):
        self.json["buffers"] = [{"byteLength": len(self.binary)}]
        text = json.dumps(self.json).encode()
        text += b" " * (-len(text) % 4)
        whole = 28 + len(text) + len(self.binary)
        return b"".join(
            [struct.pack("<4sII", b"glTF", 2, whole), struct.pack("<I4s", len(text), b"JSON"),
             text, struct.pack("<I4s", len(self.binary), b"BIN\0"), self.binary]
        )  # fmt: skip
