# SPDX-License-Identifier: MIT
"""The model of form: a mean head, the ways in which heads differ, and what some expressions add."""

from __future__ import annotations

import io
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np

from ...author.geometry.skeleton import Doubles, Ints

FILE_NAME = "heads.npz"  # made by packaging/ship/make_head_form.py


@dataclass(frozen=True)
class TeethForm:
    """What the skin tells of the lower teeth: a linear regression over the drawn heads.

    It tells the middle of the teeth, three numbers, and then row by row the matrix [3, 3] that
    makes the mean head's teeth those of this head.

    Attributes:
        vertices: int64[n] of the skin, those that tell them.
        ways: float64[12, n, 3]: what a shift of each vertex by 1 cm from the mean adds.
        usual: float64[12], of the mean skin.
        mean, spread: float64[12], of all heads.
    """

    vertices: Ints
    ways: Doubles
    usual: Doubles
    mean: Doubles
    spread: Doubles


@dataclass(frozen=True)
class HeadForm:
    """Heads as a mean plus weighted parts, in cm, 0 between the eyes, standing.

    The last four vertices belong to no triangle: the middle and the foremost place of the left
    eyeball, then those of the right one.

    Attributes:
        mean: float64[V, 3].
        parts: float64[K, V, 3], each as large as one standard deviation.
        expressions: float64[E, V, 3]; each is added 0 to 1 times.
        expression_names: of these.
        triangles: int64[T, 3].
        weights: float64[V], how much each vertex says of where a face is, 0 to 1.
        places: vertex of each landmark by name.
        teeth: what the skin tells of the lower teeth.
    """

    mean: Doubles
    parts: Doubles
    expressions: Doubles
    expression_names: tuple[str, ...]
    triangles: Ints
    weights: Doubles
    places: dict[str, int]
    teeth: TeethForm

    @property
    def skin(self) -> int:
        """How many vertices are of the skin; those of the eyes follow."""
        return len(self.mean) - 4

    def shaped(self, parts: Doubles, expressions: Doubles) -> Doubles:
        """float64[V, 3], a head.

        Args:
            parts: float64[K].
            expressions: float64[E].
        """
        out = self.mean + np.tensordot(parts, self.parts, 1)
        return np.asarray(out + np.tensordot(expressions, self.expressions, 1))


@cache
def head_form() -> HeadForm:
    """The model that the package brings."""
    data = files(__package__).joinpath(FILE_NAME).read_bytes()
    with np.load(io.BytesIO(data), allow_pickle=False) as packed:
        form = packed["form"] * packed["form_scale"][:, None, None]
        parts = packed["parts"] * packed["part_scale"][:, None, None]
        places = zip(packed["names"].tolist(), packed["places"].tolist(), strict=True)
        vertices = packed["teeth_vertices"].astype(np.int64)
        ways = packed["teeth_ways"] * packed["teeth_scale"][:, None]
        teeth = TeethForm(
            vertices, ways.reshape(-1, len(vertices), 3), packed["teeth_usual"],
            packed["teeth_mean"], packed["teeth_spread"],
        )  # fmt: skip
        return HeadForm(
            form[0], parts, form[1:], tuple(packed["expressions"].tolist()),
            packed["triangles"].astype(np.int64), packed["weights"] / 255.0, dict(places),
            teeth,
        )  # fmt: skip
