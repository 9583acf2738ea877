# SPDX-License-Identifier: MIT
"""Writes meshes, morph targets, joints and materials into one glTF file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .avatar import springs, vrm
from .body.reading import Body
from .body.writing import Put, frames, put_meshes
from .glb import QUANTIZED, Glb
from .joints.hair import Chains
from .joints.nodes import add_nodes, node_of
from .joints.skeleton import Skeleton
from .joints.weights import INFLUENCES
from .materials import Materials
from .naming import unlike
from .parts import Part, Points, normals_of
from .wishes import Wishes

Doubles = npt.NDArray[np.float64]
Floats = npt.NDArray[np.float32]

_STEPS = 32767  # largest integer of a quantized coordinate
_TURNED = 127.0  # largest integer of a quantized normal
_REACHES = 0.2  # metres: meshes that end nearer than this to the toes have legs
_LEAST_TURN = 1e-3  # smaller changes of a normal's components, about 0.06°, are set to 0


class Change(NamedTuple):
    """A morph target: name, group in the statistics, float32[P, 3]: displacements in metres."""

    name: str
    group: str
    delta: Floats


@dataclass
class Written:
    """The written file and its statistics.

    Attributes:
        data: bytes of the file.
        groups: group of targets -> (number of targets, number of vertices that they move, bytes).
    """

    data: bytes
    groups: dict[str, tuple[int, int, int]] = field(default_factory=dict)


def write(
    points: Points,
    skeleton: Skeleton,
    materials: Materials,
    changes: Sequence[Change],
    wishes: Wishes,
    manner: vrm.Manner,
    body: Body | None = None,
    chains: Chains | None = None,
) -> Written:
    """Writes the glTF file.

    Args:
        points: vertices of the LOD.
        skeleton: joints of the face, written if wishes.skeleton is set.
        materials: materials of the face.
        changes: morph targets in the order of the file.
        wishes: export options.
        manner: measured VRM values of the face.
        body: the body on which the skeleton is put; None: the face alone.
        chains: joints of the skeleton that swing.
    """
    farthest = max((float(np.abs(c.delta).max(initial=0.0)) for c in changes), default=0.0)
    writer = _Writer(points, skeleton, materials, wishes, farthest)
    writer.body, writer.chains = body, chains or Chains()
    return writer.file(changes, manner)


class _Writer:
    def __init__(
        self, points: Points, skeleton: Skeleton, materials: Materials, wishes: Wishes,
        farthest: float,
    ) -> None:  # fmt: skip
        self.points, self.skeleton, self.materials = points, skeleton, materials
        self.wishes = wishes
        self.body: Body | None = None
        self.chains = Chains()
        self.node_of = list(range(len(skeleton.names)))
        self.glb = Glb(packs=wishes.meshopt, sparse=wishes.sparse)
        self.step, self.middle = 1.0, np.zeros(3)
        if wishes.quantize:
            low, high = points.rest.min(axis=0), points.rest.max(axis=0)
            self.middle = (low + high) / 2
            self.step = max(float((high - low).max()) / 2, farthest) / _STEPS or 1.0
            self.glb.uses(QUANTIZED, required=True)
        self.known: dict[str, int] = {}
        self.bytes: dict[str, int] = {}
        self.names: dict[str, set[str]] = {}
        self.moved: dict[str, npt.NDArray[np.bool_]] = {}

    def file(self, changes: Sequence[Change], manner: vrm.Manner) -> Written:
        table = self.glb.table
        nodes = table.setdefault("nodes", [])
        roots = self._joints(nodes) if self.wishes.skeleton else []
        # TalkingHead looks for meshes below the armature, other apps at the root of the scene.
        below = nodes[0].setdefault("children", []) if self.wishes.humanoid == "mixamo" else roots
        shown = list[vrm.Shown]()
        whole = max(self.points.parts, key=lambda p: (p.kind == "skin", len(p.rows)))
        names = {node["name"].lower() for node in nodes}
        for part in self.points.parts:
            mesh = self._mesh(part, changes, part is whole)
            name = unlike(part.name, names)
            table.setdefault("meshes", []).append({"name": name, **mesh})
            node: dict[str, Any] = {"name": name, "mesh": len(table["meshes"]) - 1}
            if self.wishes.skeleton:
                node["skin"] = 0
            elif self.wishes.quantize:
                node.update(scale=[self.step] * 3, translation=self.middle.tolist())
            below.append(len(nodes))
            named = mesh.get("extras", {}).get("targetNames", [])
            shown.append(vrm.Shown(len(nodes), node["mesh"], named, self._first_person(part)))
            nodes.append(node)
        if self.wishes.humanoid == "mixamo":
            self._add_soles(below)
        put = self._put_body(roots, names)
        shown += put.meshes
        table.update(scene=0, scenes=[{"name": "Face", "nodes": roots}])
        if self.wishes.vrm:
            self._make_vrm(shown, changes, manner, put)
        groups = {
            group: (len(self.names[group]), int(self.moved[group].sum()), size)
            for group, size in self.bytes.items()
        }
        return Written(self.glb.data(), groups)

    def _make_vrm(
        self, shown: Sequence[vrm.Shown], changes: Sequence[Change], manner: vrm.Manner,
        put: Put,
    ) -> None:  # fmt: skip
        own, table = self.skeleton, self.glb.table
        head, eyes = own.places[own.head], [own.bones.get(f"{s}Eye") for s in ("left", "right")]
        known = [own.places[eye] for eye in eyes if eye is not None]
        bones = {name: self.node_of[joint] for name, joint in own.bones.items()}
        if self.body:  # the body's neck and head move those of the face
            moved = {name: bones[name] for name in bones if name not in ("neck", "head")}
            bones = {**self.body.bones, **moved}
            head = frames(self.body, self.wishes.vrm)[0][self.body.bones["head"]]
        avatar = vrm.Avatar(
            bones,
            (np.mean(known, axis=0) - head).tolist() if known else [0.0, 0.0, 0.0],
            shown,
            [c.name for c in changes if c.group not in ("vrm", "combinations")],
            self.wishes.licence,
            manner,
            put.plain,
            self._springs().joined(put.springs),
        )
        name, made = vrm.extension(self.wishes.vrm, avatar, table.get("materials", []))
        table.setdefault("extensions", {})[name] = made
        self.glb.uses(name, required=False)
        if self.wishes.vrm == "1.0" and avatar.springs.springs:
            table["extensions"][springs.EXTENSION] = springs.table_1(avatar.springs)
            self.glb.uses(springs.EXTENSION, required=False)

    def _springs(self) -> springs.Springs:
        """The swinging chains of long hair, with a sphere in the head that they do not enter."""
        own, chains = self.skeleton, self.chains
        if not chains.joints:
            return springs.Springs()
        offset = own.turns[own.head].T @ (chains.centre - own.places[own.head])
        ball = springs.Collider(self.node_of[own.head], offset.tolist(), chains.radius)
        rows = [
            springs.Spring(f"Hair{i}", [self.node_of[j] for j in chain], [0], chains.hit)
            for i, chain in enumerate(chains.joints, 1)
        ]
        return springs.Springs(rows, [ball])

    def _add_soles(self, below: list[int]) -> None:
        """Adds two triangles of 1 mm at the toes of a body without meshes: TalkingHead lowers an
        avatar until its lowest vertex is on the ground, and a head alone would sink into it."""
        own, table = self.skeleton, self.glb.table
        feet = [own.bones[f"{side}Toes"] for side in ("left", "right")]
        if self.points.rest[:, 1].min() < own.places[feet, 1].max() + _REACHES:
            return
        corners = np.array([[0, 0, 0], [1e-3, 0, 0], [0, 0, 1e-3]])
        places = (own.places[feet][:, None] + corners).reshape(-1, 3) - self.middle
        joints = np.zeros((6, INFLUENCES), "u1")
        joints[:, 0] = np.repeat(feet, 3)
        primitive = {
            "attributes": {
                "POSITION": self.glb.vertices((places / self.step).astype("<f4"), bounds=True),
                "JOINTS_0": self.glb.vertices(joints),
                "WEIGHTS_0": self._weights(np.eye(1, INFLUENCES).repeat(6, axis=0)),
            },
            "indices": self.glb.corners(np.arange(6).reshape(2, 3), 6),
        }
        table["meshes"].append({"name": "Soles", "primitives": [primitive]})
        below.append(len(table["nodes"]))
        table["nodes"].append({"name": "Soles", "mesh": len(table["meshes"]) - 1, "skin": 0})

    def _first_person(self, part: Part) -> str:
        """Whether the avatar's wearer sees a mesh: VRM's "thirdPersonOnly", "auto" or "both".

        The wearer must not see vertices that follow the head. "thirdPersonOnly": all vertices
        follow it, "auto": some, "both": none.
        """
        own = self.skeleton
        is_head = np.zeros(max(len(own.names), INFLUENCES), np.bool_)
        for joint in range(len(own.names)):
            above = own.parents[joint]
            is_head[joint] = joint == own.head or (above >= 0 and is_head[above])
        on = is_head[part.joints][part.weights > 0]
        return "thirdPersonOnly" if on.all() else "auto" if on.any() else "both"

    def _joints(self, nodes: list[dict[str, Any]]) -> list[int]:
        """Write the nodes and the skin of the joints. Returns the numbers of nodes without parent.

        Args:
            nodes: list that receives the nodes.
        """
        own, body = self.skeleton, self.body
        roots = [0]
        if body:
            places, turns = frames(body, self.wishes.vrm)
            add_nodes(nodes, body.names, body.parents, places, turns)
            roots = [i for i, parent in enumerate(body.parents) if parent < 0]
            self.node_of = [own.hooks[0], *range(len(nodes), len(nodes) + len(own.names) - 1)]
        taken = {node["name"].lower() for node in nodes}
        for i in range(bool(body), len(own.names)):
            if i in own.hooks and body:
                above, place, turn = own.hooks[i], places[own.hooks[i]], turns[own.hooks[i]]
            elif own.parents[i] >= 0:
                parent = own.parents[i]
                above, place, turn = self.node_of[parent], own.places[parent], own.turns[parent]
            else:
                above, place, turn = -1, np.zeros(3), np.eye(3)
            name = unlike(own.names[i], taken)
            nodes.append(node_of(name, own.places[i] - place, own.turns[i], turn))
            if above >= 0:
                nodes[above].setdefault("children", []).append(self.node_of[i])
        inverse = np.tile(np.eye(4), (len(own.names), 1, 1))
        back = np.swapaxes(own.turns, 1, 2)
        # glTF ignores the transform of a skinned mesh's node, so these matrices scale the mesh.
        inverse[:, :3, :3] = back * self.step
        inverse[:, :3, 3] = np.einsum("jab,jb->ja", back, self.middle - own.places)
        skin = {"joints": self.node_of, "inverseBindMatrices": self.glb.matrices(inverse)}
        self.glb.table["skins"] = [skin if body else {**skin, "skeleton": 0}]
        return roots

    def _put_body(self, roots: list[int], names: set[str]) -> Put:
        """Add the meshes of the body, if there is one, to the meshes of the face."""
        if not self.body:
            return Put()
        called = [unlike(mesh.name, names) for mesh in self.body.meshes]
        return put_meshes(self.body, self.glb, called, self.wishes.vrm, roots)

    def _mesh(self, part: Part, changes: Sequence[Change], whole: bool) -> dict[str, Any]:
        glb, rest = self.glb, self.points.rest[part.rows]
        attributes = {
            "POSITION": glb.vertices(self._places(rest - self.middle), bounds=True),
            "NORMAL": self._directions(part.normals, False),
        }
        material = self.materials.add(part.mesh, glb, self.known, self.wishes.textures)
        if self.materials.is_painted(glb, material):
            attributes["TEXCOORD_0"] = self._uv(part.uv)
        if self.wishes.skeleton:
            attributes["JOINTS_0"] = glb.vertices(part.joints.astype("u1"))
            attributes["WEIGHTS_0"] = self._weights(part.weights)
        primitive: dict[str, Any] = {
            "attributes": attributes,
            "indices": glb.corners(part.triangles, len(rest)),
            "material": material,
        }
        targets, names = [], []
        neutral = normals_of(rest, part.triangles, part.rows) if self._turns(part) else None
        for change in changes:
            delta = change.delta[part.rows]
            if whole or delta.any():
                before = glb.size
                targets.append(self._target(part, delta, neutral))
                names.append(change.name)
                self._count(part, change, glb.size - before)
        if not targets:
            return {"primitives": [primitive]}
        primitive["targets"] = targets
        return {"primitives": [primitive], "extras": {"targetNames": names}}

    def _turns(self, part: Part) -> bool:
        # Hair cards have the normals of the skin below, and these cannot be computed from
        # the displaced polygons of the cards.
        return self.wishes.normals and part.kind not in ("hair", "lashes")

    def _target(self, part: Part, delta: Floats, neutral: Doubles | None) -> dict[str, int]:
        out = {"POSITION": self.glb.changes(self._places(delta), bounds=True)}
        if neutral is not None:
            turned = np.zeros_like(neutral)
            if delta.any():
                at = self.points.rest[part.rows] + delta
                turned = normals_of(at, part.triangles, part.rows) - neutral
                turned[np.abs(turned).max(axis=1) < _LEAST_TURN] = 0.0
            out["NORMAL"] = self._directions(turned, True)
        return out

    def _count(self, part: Part, change: Change, size: int) -> None:
        self.bytes[change.group] = self.bytes.get(change.group, 0) + size
        self.names.setdefault(change.group, set()).add(change.name)
        moved = self.moved.setdefault(change.group, np.zeros(len(self.points.rest), np.bool_))
        moved[part.rows] |= change.delta[part.rows].any(axis=1)

    def _places(self, values: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Positions as float32 in metres. If the options ask for quantized values, positions are
        int16 multiples of the length `step` instead."""
        if not self.wishes.quantize:
            return np.ascontiguousarray(values, "<f4")
        return np.clip(np.rint(values / self.step), -_STEPS, _STEPS).astype("<i2")

    def _directions(self, values: Doubles, is_change: bool) -> int:
        put = self.glb.changes if is_change else self.glb.vertices
        if not self.wishes.quantize:
            return put(np.ascontiguousarray(values, "<f4"))
        return put(np.rint(np.clip(values, -1, 1) * _TURNED).astype("i1"), normalized=True)

    def _uv(self, values: Doubles) -> int:
        if self.wishes.quantize and values.min() >= 0 and values.max() <= 1:
            return self.glb.vertices(np.rint(values * 65535).astype("<u2"), normalized=True)
        return self.glb.vertices(np.ascontiguousarray(values, "<f4"))

    def _weights(self, values: Doubles) -> int:
        if not self.wishes.quantize:
            return self.glb.vertices(np.ascontiguousarray(values, "<f4"))
        return self.glb.vertices(np.rint(values * 255).astype("u1"), normalized=True)
