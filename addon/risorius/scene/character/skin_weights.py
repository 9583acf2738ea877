# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads and writes all skin weights of a mesh object at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import bmesh
import numpy as np

from ...logic.character import plans
from ..base.blender_types import MeshObject

Weights = dict[str, dict[int, float]]  # bone or vertex group -> vertex -> weight


def file_pairs(mesh_plan: plans.MeshPlan, labels: Sequence[str]) -> Weights:
    """The skin weights of a DNA mesh: {bone name: {vertex: weight}}.

    If a vertex lists a joint more than once, the weights are summed.

    Args:
        mesh_plan: skin weights of the mesh.
        labels: bone names by joint index.
    """
    counts = np.diff(mesh_plan.skin_offsets)
    vertices = np.repeat(np.arange(len(counts)), counts).tolist()
    result = {}
    joints, weights = mesh_plan.skin_joints.tolist(), mesh_plan.skin_weights.tolist()
    for vertex, joint, weight in zip(vertices, joints, weights, strict=True):
        group = result.setdefault(labels[joint], {})
        group[vertex] = float(np.float32(group[vertex] + weight)) if vertex in group else weight
    return result


def read(item: MeshObject) -> Weights:
    """The weights of a mesh object: {vertex group name: {vertex: weight}}."""
    names = [g.name for g in item.vertex_groups]
    result = {name: {} for name in names}
    for vertex in item.data.vertices:
        for element in vertex.groups:
            if element.group < len(names):
                result[names[element.group]][vertex.index] = element.weight
    return result


def write(item: MeshObject, groups: Weights) -> None:
    """Replace the weights of the given vertex groups; other groups keep their weights.

    Args:
        item: mesh object, in object mode.
        groups: {vertex group name: {vertex: weight}}; missing groups are created.
    """
    there = item.vertex_groups
    index_of = {n: (there.get(n) or there.new(name=n)).index for n in groups}
    edit = bmesh.new()
    try:
        edit.from_mesh(item.data)
        layer = edit.verts.layers.deform.verify()
        held: list[Any] = [vertex[layer] for vertex in edit.verts]
        ours = set(index_of.values())
        for weights in held:
            for index in [i for i in weights.keys() if i in ours]:  # noqa: SIM118  no dict
                del weights[index]
        for name, values in groups.items():
            index = index_of[name]
            for vertex, weight in values.items():
                held[vertex][index] = weight
        edit.to_mesh(item.data)
    finally:
        edit.free()


def edited_vertices(present: Weights, wanted: Weights) -> set[int]:
    """The vertices whose weights differ from the DNA file.

    Args:
        present: {group: {vertex: weight}} of the object.
        wanted: {group: {vertex: weight}} of the DNA file; other groups of the object are ignored.
    """
    edited = set()
    for name, values in wanted.items():
        have = present.get(name, {})
        edited.update(v for v in values.keys() ^ have.keys())
        edited.update(v for v in values.keys() & have.keys() if values[v] != have[v])
    return edited
