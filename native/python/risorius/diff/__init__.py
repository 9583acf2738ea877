# SPDX-License-Identifier: MIT
"""Describes the differences of two rigs in words: one module per layer.

Elements are matched by name, or by the things that they drive if they have no name, so that an
insertion or another order does not make everything after it differ.
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
# The properties of Dna that Dna.convert can change to another rig's.
_SYSTEM = {
    "axes": "coordinate_system",
    "rotation_sequence": "rotation_sequence",
    "rotation_signs": "rotation_signs",
    "face_winding_order": "face_winding_order",
    "translation_unit": "translation_unit",
    "rotation_unit": "rotation_unit",
}


def compare(a: risorius.Dna, b: risorius.Dna, everything: bool = False) -> list[Difference]:
    """All differences of two faces; an empty list means that both are equal.

    Faces with different axes or units are compared in those of A, up to rounding. If B cannot be
    converted, this is reported and the numbers are compared unconverted.

    Args:
        a: the face before.
        b: the face after.
        everything: list all names; otherwise long lists are shortened.

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
    """B in the axes and units of A, and whether the comparison is exact."""
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
    except ValueError as error:  # DnaError too: invalid axes or units
        report.add("file", "", f"numbers are compared as they stand: {error}")
        return b, report, True
    report.add("file", "", "numbers are compared in the axes and units of A, but for rounding")
    return converted, report, False


def _same_bytes(a: risorius.Dna, b: risorius.Dna) -> bool:
    """Whether the files are equal, as a check for differences that the modules missed."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return a.to_bytes() == b.to_bytes()
