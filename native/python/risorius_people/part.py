# SPDX-License-Identifier: MIT
"""Defines a mesh of a sample person at one LOD, computed from the vertices of the base mesh."""

from __future__ import annotations

from dataclasses import dataclass

from .polygons import Floats, Operator, Polygons


@dataclass
class Part:
    """A mesh at one LOD.

    `carry` converts values [V, ...] of the base mesh's vertices to values of this mesh's vertices.
    """

    name: str
    polygons: Polygons
    # applied in order, from vertices of the base mesh to vertices of this mesh
    operators: list[Operator]
    rests: bool = False  # whether the mesh is moved by joints alone, without blend shapes

    def carry(self, values: Floats) -> Floats:
        for operator in self.operators:
            values = operator.apply(values)
        return values
