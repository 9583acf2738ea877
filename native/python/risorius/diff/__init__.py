# SPDX-License-Identifier: MIT
"""What differs between two rigs, in words: one module per layer.

Elements are matched by name, or by what they drive where they have none, so that an insertion or
another order does not make everything after it differ.
"""

from __future__ import annotations

import warnings

import risorius

from .layers import (
    container,
    controls,
    definition,
    descriptor,
    geometry,
    joint_groups,
    networks,
    operations,
    rbf,
    rotations,
)
from .pairing.comparison import Comparison
from .pairing.report import Difference, Report

__all__ = ["Difference", "compare"]

_LAYERS = (
    definition,
    controls,
    joint_groups,
    geometry,
    networks,
    operations,
    rbf,
    rotations,
)
# The properties of Dna that Dna.convert takes to another rig's system.
_SYSTEM = {
    "axes": "coordinate_system",
    "rotation_sequence": "rotation_sequence",
    "rotation_signs": "rotation_signs",
    "face_winding_order": "face_winding_order",
    "translation_unit": "translation_unit",
    "rotation_unit": "rotation_unit",
}


def compare(a: risorius.Dna, b: risorius.Dna, everything: bool = False) -> list[Difference]:
    """Everything that differs between two faces; an empty list says that both hold the same.

    Faces of different axes or units are compared in those of A, so only but for rounding. Where B
    cannot be converted to them, that is reported and the numbers are compared as they stand.

    Args:
        a: the face before.
        b: the face after.
        everything: lists of names are spelled out in full; otherwise long ones are shortened.

    Returns:
        Differences in the order of the layers of the format.
    """
    report = Report(everything)
    as_they_are = Comparison(a, b, report)
    container.compare(as_they_are)
    descriptor.compare(as_they_are)
    comparison = Comparison(a, *_in_system(a, b, report))
    for layer in _LAYERS:
        layer.compare(comparison)
    if not report.differences and not _same_bytes(a, b):
        report.add("file", "", "something differs that has no words here")
    return report.differences


def _in_system(
    a: risorius.Dna, b: risorius.Dna, report: Report
) -> tuple[risorius.Dna, Report, bool]:
    """B in the axes and units of A, and whether it is exact."""
    target = {
        argument: getattr(a, name)
        for argument, name in _SYSTEM.items()
        if getattr(a, name) != getattr(b, name)
    }
    if not target:
        return b, report, True
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            converted = b.convert(**target)
    except ValueError as error:  # DnaError as well: axes or units that make no sense
        report.add("file", "", f"numbers are compared as they stand: {error}")
        return b, report, True
    report.add("file", "", "numbers are compared in the axes and units of A, but for rounding")
    return converted, report, False


def _same_bytes(a: risorius.Dna, b: risorius.Dna) -> bool:
    """What the words above might have missed."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return a.to_bytes() == b.to_bytes()
