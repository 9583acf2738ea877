# SPDX-License-Identifier: MIT
"""Differences of layer bhvr: controls, blend shape channels and animated maps."""

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


def compare(faces: Comparison) -> None:
    place = Place(faces, "behavior")
    table(
        place.at("gui_to_raw", "GUI to raw"),
        faces.gui,
        faces.raw,
        faces.a.gui_to_raw,
        faces.b.gui_to_raw,
    )
    value(place.at("psd_count", "correctives"), faces.a.psd_count, faces.b.psd_count)
    _psds(faces, place.at("psds"))
    _channels(faces, place.at("blend_shape_channels"))
    maps = place.at("animated_maps", "animated maps")
    rows_per_lod(maps.at("lods"), faces.a.animated_maps.lods, faces.b.animated_maps.lods)
    a, b = faces.a.animated_maps.conditionals, faces.b.animated_maps.conditionals
    table(maps.at("conditionals"), faces.controls, faces.maps, a, b)


def table(
    place: Place, inputs: Space, outputs: Space, a: risorius.Conditionals, b: risorius.Conditionals
) -> None:
    """Report differences of a conditional table, whose rows are matched by input and output.

    Args:
        place: where the difference is reported.
        inputs: elements that the rows read.
        outputs: elements that the rows write.
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
    for i in np.flatnonzero(place.faces.changed(x, y)).tolist():
        at = pairs.a[i]
        read, written = inputs.label(int(rows[0][at])), outputs.label(int(rows[1][at]))
        place.say(f"row from {read} to {written}: {noun} {x[i]!s} -> {y[i]!s}")


def _psds(faces: Comparison, place: Place) -> None:
    only_in(place, faces.psds, faces.psds.pairs)
    order(place, faces.psds.pairs, faces.psds.plural)
    a, b = faces.a.psds, faces.b.psds
    rows_a = (faces.controls.in_a(a.rows), faces.controls.in_a(a.columns))
    rows_b = (faces.controls.in_b(b.rows), faces.controls.in_b(b.columns))
    pairs = pair_rows(rows_a, rows_b)
    named = faces.controls.pairs
    for side, left, rows, gone in (
        ("A", pairs.only_a, rows_a, faces.controls.a[named.only_a]),
        ("B", pairs.only_b, rows_b, faces.controls.b[named.only_b]),
    ):
        # Factors of correctives that only one face has are skipped, because `only_in` reports
        # these correctives.
        left = left[~np.isin(rows[0][left], gone)]  # noqa: PLW2901
        both = zip(
            faces.controls.labels(rows[0][left]), faces.controls.labels(rows[1][left]), strict=True
        )
        for row, column in both:
            place.at("columns").say(f"{row}: factor {column} only in {side}")
    order(place.at("rows"), pairs, "factors of correctives")
    x, y = a.values[pairs.a], b.values[pairs.b]
    for i in np.flatnonzero(faces.changed(x, y)).tolist():
        row, column = (faces.controls.label(int(numbers[pairs.a[i]])) for numbers in rows_a)
        real(place.at("values", f"{row}: factor {column}"), x[i], y[i])


def _channels(faces: Comparison, place: Place) -> None:
    a, b = faces.a.blend_shape_channels, faces.b.blend_shape_channels
    rows_per_lod(place.at("lods", "blend shape channels"), a.lods, b.lods)
    outputs_a, outputs_b = (
        faces.channels.in_a(a.output_indices),
        faces.channels.in_b(b.output_indices),
    )
    pairs = pair(outputs_a, outputs_b)
    for side, left, numbers in (("A", pairs.only_a, outputs_a), ("B", pairs.only_b, outputs_b)):
        if len(left):
            listed = faces.report.listed(faces.channels.labels(numbers[left]))
            text = f"{counted(len(left), 'channel')} driven only in {side}: {listed}"
            place.at("output_indices").say(text)
    order(place.at("output_indices"), pairs, "driven channels")
    inputs_a, inputs_b = faces.controls.in_a(a.input_indices), faces.controls.in_b(b.input_indices)
    x, y = inputs_a[pairs.a], inputs_b[pairs.b]
    for i in np.flatnonzero(x != y).tolist():
        channel = faces.channels.label(int(outputs_a[pairs.a[i]]))
        new, old = faces.controls.label(int(y[i])), faces.controls.label(int(x[i]))
        place.at("input_indices").say(f"channel {channel} is driven by {new} instead of {old}")
