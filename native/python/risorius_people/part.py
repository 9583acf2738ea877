# SPDX-License-Identifier: MIT
"""One mesh of the sample at one LOD, and how values reach it from the base mesh."""

from __future__ import annotations

from dataclasses import dataclass

from .polygons import Floats, Operator, Polygons


@dataclass
class Part:
    """One mesh at one LOD."""

    name: str
    polygons: Polygons
    operators: list[Operator]  # from the base mesh's vertices to this mesh's, in order
    rests: bool = False  # whether no expression moves it but by its joints

    def carry(self, values: Floats) -> Floats:
        for operator in self.operators:
            values = operator.apply(values)
        return values
