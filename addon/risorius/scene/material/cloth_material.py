# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds the material of cloth: threads in two directions, and a soft sheen at the edges."""

from __future__ import annotations

from .look import Look
from .nodes import Graph

_COLOR = (0.055, 0.065, 0.08)  # linear: a dark jersey
_THREADS = 150.0  # radians of the thread pattern per eye distance
_NEAR, _FAR = 7.0, 14.0  # camera distances in eye distances: threads begin to fade, and are gone


def build(graph: Graph, look: Look) -> None:
    """Build the node tree of a cloth material.

    Args:
        graph: Graph of the material.
        look: Look of the mesh.
    """
    points = graph.rest_points(look.extent)
    picture = look.image("color")
    worn = graph.noise(points, 5.0 / look.unit, detail=4.0)
    color = graph.image(picture, label="Colour").outputs["Color"] if picture else _COLOR
    shade = graph.ramp(worn, (0.3, (0.86,) * 3), (0.7, (1.0,) * 3))
    graph.set(Base_Color=graph.mix(1.0, color, shade, blend="MULTIPLY"), Roughness=0.85)
    graph.set(Specular_Ior_Level=0.25)
    if look.simple:
        return
    graph.set(Sheen_Weight=0.25, Sheen_Roughness=0.5)
    x, y, z = graph.split(points)
    turns = _THREADS / look.unit
    across = graph.math("SINE", graph.math("MULTIPLY", graph.math("ADD", x, y), turns))
    along = graph.math("SINE", graph.math("MULTIPLY", z, turns))
    # The threads fade with distance, because threads smaller than a pixel would flicker.
    away = graph.node("CameraData").outputs["View Distance"]
    span = (_FAR - _NEAR) * look.unit
    near = graph.math("DIVIDE", graph.math("SUBTRACT", _FAR * look.unit, away), span, clamp=True)
    height = graph.math("MULTIPLY", graph.math("MULTIPLY", across, along), near)
    graph.set(Normal=graph.bump(height, look.unit * 0.006, None, 0.35))
