# SPDX-License-Identifier: MIT
"""Copies the face board and the animated maps of a template to a face whose controls have the same
names.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from .. import AnimatedMaps, Conditionals, Dna
from ..author.geometry.skeleton import Ints

# The name of a raw control; for a corrective, the sorted names and factors of its raw controls.
_Key = str | tuple[tuple[str, float], ...]
_Entry = TypeVar("_Entry")


def copy_board(template: Dna, dna: Dna) -> None:
    """Copy from a template the GUI controls that drive raw controls of the face.

    Args:
        template: a face with GUI controls.
        dna: the face that gets the GUI controls; it is changed.
    """
    names = {name.rpartition(".")[2]: i for i, name in enumerate(dna.raw_control_names)}
    table = template.gui_to_raw
    led = [template.raw_control_names[int(c)].rpartition(".")[2] for c in table.output_indices]
    kept = np.flatnonzero([name in names for name in led])
    used = sorted({int(table.input_indices[row]) for row in kept})
    place = {gui: at for at, gui in enumerate(used)}
    dna.gui_control_names = [template.gui_control_names[gui] for gui in used]
    dna.gui_to_raw = _rows(
        table,
        kept,
        [place[int(table.input_indices[row])] for row in kept],
        [names[led[row]] for row in kept],
    )


def copy_maps(template: Dna, dna: Dna) -> None:
    """Copy the animated maps of a template, and the rows of their table, to a face.

    A row is left out if the face lacks its raw control, or lacks a corrective with the same raw
    controls and factors. Each LOD gets the maps and the rows of the template's LOD with the same
    number, or of the template's last LOD.

    Args:
        template: a face with animated maps.
        dna: the face that gets the maps; it is changed unless all rows are left out. Its LODs and
            correctives must be final, because later changes do not update the copied table.
    """
    place = {key: control for control, key in _keys(dna).items()}
    known, table = _keys(template), template.animated_maps.conditionals
    found = {
        row: place[known[control]]
        for row, control in enumerate(map(int, table.input_indices))
        if known.get(control) in place
    }
    if not found:
        return
    kept = np.array(list(found), np.int64)
    mapping = template.lod_animated_map_mapping
    listed = [[int(i) for i in mapping[lod]] for lod in range(len(mapping))]
    levels = max(1, dna.lod_count)
    dna.animated_map_names = list(template.animated_map_names)
    dna.lod_animated_map_mapping = _repeated(listed, levels)
    counts = [int((kept < rows).sum()) for rows in template.animated_maps.lods]
    outputs = [int(i) for i in np.asarray(table.output_indices)[kept]]
    dna.animated_maps = AnimatedMaps(
        lods=_repeated(counts, levels),
        conditionals=_rows(table, kept, list(found.values()), outputs),
    )


def _keys(dna: Dna) -> dict[int, _Key]:
    """Control -> its key, which is the same in another face with other indices. Correctives that
    read other correctives, networks or solvers are left out."""
    names = [name.rpartition(".")[2] for name in dna.raw_control_names]
    factors: dict[int, list[tuple[str, float]]] = {}
    other: set[int] = set()
    psds = dna.psds
    for row, column, value in zip(psds.rows, psds.columns, psds.values, strict=True):
        if column < len(names):
            factors.setdefault(int(row), []).append((names[column], float(value)))
        else:
            other.add(int(row))
    out: dict[int, _Key] = dict(enumerate(names))
    out |= {row: tuple(sorted(parts)) for row, parts in factors.items() if row not in other}
    return out


def _repeated(rows: Sequence[_Entry], levels: int) -> list[_Entry]:
    """The entries of the first `levels` LODs; further LODs get the last entry."""
    return [rows[min(lod, len(rows) - 1)] for lod in range(levels)] if rows else []


def _rows(
    table: Conditionals, kept: Ints, inputs: Sequence[int], outputs: Sequence[int]
) -> Conditionals:
    """Some rows of a table, with new inputs and outputs."""

    def part(values: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
        return np.asarray(values)[kept]

    return Conditionals(
        input_indices=inputs,
        output_indices=outputs,
        from_values=part(table.from_values),
        to_values=part(table.to_values),
        slope_values=part(table.slope_values),
        cut_values=part(table.cut_values),
    )
