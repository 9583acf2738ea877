# SPDX-License-Identifier: MIT
"""Headings and captions of the drawings, used by the page and the sheet."""

from __future__ import annotations

from .facts import Facts, human_bytes

FACE = "The face at rest"
MATRIX = "Joint matrix"
LODS = "Levels of detail"
SIZES = "Size of each part"


def face(lod: int) -> str:
    return (
        f"The meshes of LOD {lod} in the neutral pose; each dot is a joint in the colour of its "
        "face region, thin lines are bones."
    )


def matrix(facts: Facts) -> str:
    if not facts.stored:
        return "A matrix from control inputs to joint attributes would stand here."
    return (
        "Each speck is a coefficient: how far a control (column) moves a joint attribute (row). "
        "Most of the sparse matrix is empty; put together group by group, the rows of neighbouring "
        "joints make dense blocks, and only these are stored and evaluated. Colour: the region "
        "of most joints in the group."
    )


def lods() -> str:
    return (
        "A coarser level keeps fewer joints, and so evaluates fewer coefficients, channels and "
        "maps: a face far from the camera costs less."
    )


def sizes(facts: Facts) -> str:
    largest = max(facts.layers, key=lambda layer: layer.size)
    share = largest.size / max(facts.file_size, 1)
    return (
        f"Bytes of each part, read from the file's own index; they add up to the file. The largest "
        f"is {largest.title} with {human_bytes(largest.size)}, {share:.1%}."
    )
