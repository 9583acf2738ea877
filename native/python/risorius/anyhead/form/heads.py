# SPDX-License-Identifier: MIT
"""Loads the statistical head model: a mean head, its main variations and some expressions."""

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
    """A linear regression from the skin to the lower teeth, over the heads of the model.

    Its 12 results are the centre of the teeth in cm, and row by row the matrix [3, 3] that maps the
    teeth of the mean head to the teeth of this head.

    Attributes:
        vertices: int64[n], vertices of the skin that the regression reads.
        ways: float64[12, n, 3], change of the results if a vertex moves 1 cm from the mean.
        usual: float64[12], results for the mean skin.
        mean, spread: float64[12], mean and standard deviation over all heads.
    """

    vertices: Ints
    ways: Doubles
    usual: Doubles
    mean: Doubles
    spread: Doubles


@dataclass(frozen=True)
class HeadForm:
    """A mean head plus weighted principal components (parts), in cm, y up, face towards +z. The
    origin is midway between the eyes.

    The last four vertices belong to no triangle: the centre and the foremost point of the left
    eyeball, then of the right eyeball.

    Attributes:
        mean: float64[V, 3], vertex positions of the mean head.
        parts: float64[K, V, 3], principal displacements of one standard deviation.
        expressions: float64[E, V, 3], displacements of expressions, for weights from 0 to 1.
        expression_names: the names of the expressions.
        triangles: int64[T, 3], vertex indices of the skin's triangles.
        weights: float64[V], weight of each vertex in a fit, 0 to 1.
        places: the vertex index of each landmark by name.
        teeth: the regression from the skin to the lower teeth.
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
        """The number of skin vertices, which precede the four eye vertices."""
        return len(self.mean) - 4

    def shaped(self, parts: Doubles, expressions: Doubles) -> Doubles:
        """float64[V, 3]: vertex positions of a head with given weights.

        Args:
            parts: float64[K], weights of the principal components in standard deviations.
            expressions: float64[E], weights of the expressions.
        """
        out = self.mean + np.tensordot(parts, self.parts, 1)
        return np.asarray(out + np.tensordot(expressions, self.expressions, 1))


@cache
def head_form() -> HeadForm:
    """The statistical head model, loaded from the data file of this package."""
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
