# SPDX-License-Identifier: MIT
"""A mesh of the sample at one LOD, and the operators that carry values to it from the base mesh."""

from __future__ import annotations

from dataclasses import dataclass

from .polygons import Floats, Operator, Polygons


@dataclass
class Part:
    """One mesh at one LOD."""

    name: str
    polygons: Polygons
    operators: list[Operator]  # from vertices of the base mesh to vertices of this mesh, in order
    rests: bool = False  # whether expressions move it by joints alone

    def carry(self, values: Floats) -> Floats:
        for operator in self.operators:
            values = operator.apply(values)
        return values
