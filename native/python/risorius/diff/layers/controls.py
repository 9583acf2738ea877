# SPDX-License-Identifier: MIT
"""Layer bhvr: controls, blend shape channels and animated maps."""

from __future__ import annotations

import numpy as np

import risorius

from ...base.words import counted
from ..pairing.amounts import Floats
from ..pairing.common import Place, only_in, order, real, rows_per_lod, value
from ..pairing.comparison import Comparison
from ..pairing.pairs import Ints, Pairs, pair, pair_rows
from ..pairing.spaces import Space

_COLUMNS = ("from_values", "to_values", "slope_values", "cut_values")


def compare(c: Comparison) -> None:
    place = Place(c, "behavior")
    table(place.at("gui_to_raw", "GUI to raw"), c.gui, c.raw, c.a.gui_to_raw, c.b.gui_to_raw)
    value(place.at("psd_count", "correctives"), c.a.psd_count, c.b.psd_count)
    _psds(c, place.at("psds"))
    _channels(c, place.at("blend_shape_channels"))
    maps = place.at("animated_maps", "animated maps")
    rows_per_lod(maps.at("lods"), c.a.animated_maps.lods, c.b.animated_maps.lods)
    a, b = c.a.animated_maps.conditionals, c.b.animated_maps.conditionals
    table(maps.at("conditionals"), c.controls, c.maps, a, b)


def table(
    place: Place, inputs: Space, outputs: Space, a: risorius.Conditionals, b: risorius.Conditionals
) -> None:
    """Report rows of a table of conditionals, matched by what they read and write.

    Args:
        place: where the difference is reported.
        inputs: the controls that the rows read.
        outputs: what the rows write.
        a, b: the table of each face.
    """
    rows_a = (inputs.in_a(a.input_indices), outputs.in_a(a.output_indices))
    rows_b = (inputs.in_b(b.input_indices), outputs.in_b(b.output_indices))
    pairs = pair_rows(rows_a, rows_b)
    for side, left, rows in (("A", pairs.only_a, rows_a), ("B", pairs.only_b, rows_b)):
        both = zip(inputs.labels(rows[0][left]), outputs.labels(rows[1][left]), strict=True)
        for read, written in both:
            place.say(f"a row from {read} to {written} only in {side}")
    order(place, pairs, "rows")
    for name in _COLUMNS:
        _column(place.at(name), inputs, outputs, rows_a, getattr(a, name), getattr(b, name), pairs)


def _column(
    place: Place,
    inputs: Space,
    outputs: Space,
    rows: tuple[Ints, ...],
    a: Floats,
    b: Floats,
    pairs: Pairs,
) -> None:
    noun = place.field.rpartition(".")[2].removesuffix("_values")
    x, y = a[pairs.a], b[pairs.b]
    for i in np.flatnonzero(place.c.changed(x, y)).tolist():
        at = pairs.a[i]
        read, written = inputs.label(int(rows[0][at])), outputs.label(int(rows[1][at]))
        place.say(f"row from {read} to {written}: {noun} {x[i]!s} -> {y[i]!s}")


def _psds(c: Comparison, place: Place) -> None:
    only_in(place, c.psds, c.psds.pairs)
    order(place, c.psds.pairs, c.psds.plural)
    a, b = c.a.psds, c.b.psds
    rows_a = (c.controls.in_a(a.rows), c.controls.in_a(a.columns))
    rows_b = (c.controls.in_b(b.rows), c.controls.in_b(b.columns))
    pairs = pair_rows(rows_a, rows_b)
    named = c.controls.pairs
    for side, left, rows, gone in (
        ("A", pairs.only_a, rows_a, c.controls.a[named.only_a]),
        ("B", pairs.only_b, rows_b, c.controls.b[named.only_b]),
    ):
        left = left[~np.isin(rows[0][left], gone)]  # noqa: PLW2901 whole correctives are said above
        both = zip(c.controls.labels(rows[0][left]), c.controls.labels(rows[1][left]), strict=True)
        for row, column in both:
            place.at("columns").say(f"{row}: factor {column} only in {side}")
    order(place.at("rows"), pairs, "factors of correctives")
    x, y = a.values[pairs.a], b.values[pairs.b]
    for i in np.flatnonzero(c.changed(x, y)).tolist():
        row, column = (c.controls.label(int(numbers[pairs.a[i]])) for numbers in rows_a)
        real(place.at("values", f"{row}: factor {column}"), x[i], y[i])


def _channels(c: Comparison, place: Place) -> None:
    a, b = c.a.blend_shape_channels, c.b.blend_shape_channels
    rows_per_lod(place.at("lods", "blend shape channels"), a.lods, b.lods)
    outputs_a, outputs_b = c.channels.in_a(a.output_indices), c.channels.in_b(b.output_indices)
    pairs = pair(outputs_a, outputs_b)
    for side, left, numbers in (("A", pairs.only_a, outputs_a), ("B", pairs.only_b, outputs_b)):
        if len(left):
            listed = c.report.listed(c.channels.labels(numbers[left]))
            text = f"{counted(len(left), 'channel')} driven only in {side}: {listed}"
            place.at("output_indices").say(text)
    order(place.at("output_indices"), pairs, "driven channels")
    inputs_a, inputs_b = c.controls.in_a(a.input_indices), c.controls.in_b(b.input_indices)
    x, y = inputs_a[pairs.a], inputs_b[pairs.b]
    for i in np.flatnonzero(x != y).tolist():
        channel = c.channels.label(int(outputs_a[pairs.a[i]]))
        new, old = c.controls.label(int(y[i])), c.controls.label(int(x[i]))
        place.at("input_indices").say(f"channel {channel} is driven by {new} instead of {old}")
