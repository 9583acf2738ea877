# SPDX-License-Identifier: GPL-3.0-or-later
"""Transforms vertices of the drag solver from file space to world space.

File space has the axes and the unit of the DNA file. The transforms include the rotations of neck
and head bones, edits of joints that the evaluator does not write, and the rig's object transform.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from mathutils import Matrix, Quaternion, Vector
from numpy.typing import NDArray

from ..base import parts, saved
from ..base.blender_types import ArmatureObject, Depsgraph
from ..character import runtime
from ..skinning import conditions, direct

Float = NDArray[np.float64]

_STRAIGHT = np.eye(4)  # matrix without motion
_LAST = (0.0, 0.0, 0.0, 1.0)  # last row of an affine matrix


class HeadTurns:
    """Head and joint motions that the raw controls do not contain, at one moment.

    The instance refers to Blender objects, so it must not outlive the operator that creates it.
    """

    def __init__(
        self,
        rig: ArmatureObject,
        live: runtime.Runtime,
        turns: Mapping[str, Quaternion],
        depsgraph: Depsgraph,
    ) -> None:
        """Read the joints of a face.

        Args:
            rig: the original (not evaluated) deforming armature.
            live: Runtime of the character.
            turns: rotations by the neck and head bones and the body: "neck" and "head" ->
                Quaternion in the armature's axes.
            depsgraph: graph in which the rig was evaluated.
        """
        seen = rig.evaluated_get(depsgraph)
        self._live, self._bones, self._rests = live, seen.pose.bones, rig.data.bones
        plan = conditions.known(rig)
        frame = direct.shown(rig) if plan is not None and not plan.posed else None
        self._places = frame.bones.names if frame is not None else {}
        self._posed = frame.matrices() if frame is not None else None
        self._channels = frame.bone_channels() if frame is not None else {}
        numbers = ((saved.whole(b, parts.JOINT, -1), b.name) for b in rig.data.bones)
        self._names = {joint: name for joint, name in numbers if joint >= 0}
        self._place = np.array(seen.matrix_world)
        self._parts: dict[int, Matrix] = {}
        neck, head = live.anchors.neck, live.anchors.head
        for joint in neck if "neck" in turns else ():
            part = Quaternion().slerp(turns["neck"], 1.0 / len(neck))
            self._parts[joint] = part.to_matrix().to_4x4()
        if head is not None and "head" in turns:
            self._parts[head] = turns["head"].to_matrix().to_4x4()
        self._known: dict[int, Float] = {}

    def at(self, mesh: int, vertices: NDArray[np.int64]) -> Float:
        """float64[V, 4, 4]: affine transforms of vertices from file space to world space.

        Args:
            mesh: index of the mesh in the DNA file.
            vertices: int64[V], indices of vertices of the mesh.
        """
        data, space = self._live.dna.meshes[mesh], self._live.space
        offsets = np.asarray(data.skin_offsets)
        joints, weights = np.asarray(data.skin_joint_indices), np.asarray(data.skin_weights)
        maps = np.empty((len(vertices), 4, 4))
        for row, vertex in enumerate(vertices.tolist()):
            held = slice(int(offsets[vertex]), int(offsets[vertex + 1]))
            mixed = np.zeros((4, 4))
            for joint, weight in zip(joints[held].tolist(), weights[held].tolist(), strict=True):
                mixed += weight * self.of_joint(joint)
            maps[row] = mixed if held.stop > held.start else _STRAIGHT
        return self._place @ maps @ _file_matrix(space.axes, space.scale)

    def positions(self, mesh: int, points: NDArray[np.float32]) -> Float:
        """float64[V, 3]: all vertices of a mesh in world space.

        Args:
            mesh: index of the mesh in the DNA file.
            points: float32[V, 3], vertices of the evaluated face in file space.
        """
        data, space = self._live.dna.meshes[mesh], self._live.space
        count = len(points)
        owner = np.repeat(np.arange(count), np.diff(np.asarray(data.skin_offsets, np.int64)))
        joints, weights = np.asarray(data.skin_joint_indices), np.asarray(data.skin_weights)
        zones: dict[bytes, tuple[Float, list[int]]] = {}
        for joint in np.unique(joints).tolist():
            turn = self.of_joint(joint)
            zones.setdefault(turn.tobytes(), (turn, []))[1].append(joint)
        whole = np.concatenate([space.points(points), np.ones((count, 1))], axis=1)
        result = np.zeros((count, 4))
        for turn, held in zones.values():
            there = np.isin(joints, held)
            share = np.bincount(owner[there], weights[there].astype(np.float64), count)
            result += share[:, None] * (whole @ turn.T)
        bare = np.diff(np.asarray(data.skin_offsets, np.int64)) == 0
        result[bare] = whole[bare]
        return (result @ self._place.T)[:, :3]

    def of_joint(self, joint: int) -> Float:
        """float64[4, 4]: matrix in armature space, applied to a joint's posed vertices (v' = M v).

        It contains motions of the joint and its parents that the raw controls do not contain.
        """
        if joint not in self._known:
            parent = int(self._live.dna.joint_parents[joint])
            above = _STRAIGHT if parent == joint else self.of_joint(parent)
            self._known[joint] = self._added(joint, parent, above)
        return self._known[joint]

    def _added(self, joint: int, parent: int, above: Float) -> Float:
        name = self._names.get(joint)
        if name is None or (joint not in self._parts and joint in self._live.owned):
            return above
        carrier = Matrix() if parent == joint else self._skin(parent)
        if joint in self._parts:
            pivot = self._rests[name].matrix_local @ self._location(name)
            about = Matrix.Translation(pivot) @ self._parts[joint] @ Matrix.Translation(-pivot)
            return np.array(carrier @ about @ carrier.inverted_safe()) @ above
        return np.array(self._skin(joint) @ carrier.inverted_safe()) @ above

    def _location(self, name: str) -> Vector:
        if self._posed is None:
            return self._bones[name].location
        return Vector(self._channels["location"][self._places[name]].tolist())

    def _skin(self, joint: int) -> Matrix:
        name = self._names.get(joint)
        if name is None:
            return Matrix()
        if self._posed is not None:  # in Direct mode the native bones have the pose
            return Matrix([*self._posed[self._places[name]].tolist(), _LAST])
        return self._bones[name].matrix @ self._rests[name].matrix_local.inverted_safe()


def _file_matrix(axes: Float, scale: float) -> Float:
    matrix = np.eye(4)
    matrix[:3, :3] = axes * scale
    return matrix
