# SPDX-License-Identifier: MIT
"""Describes the differences of two rigs in words, with one module per layer.

Elements are matched by name, or without names by the elements that they drive. So an insertion or
another order does not make all later elements differ.
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
# Properties of Dna that Dna.convert can change to match another rig.
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

    If axes or units differ, B is converted to the axes and units of A, with rounding errors. If B
    cannot be converted, this is reported and the numbers are compared unconverted.

    Args:
        a: the face before.
        b: the face after.
        everything: True: list all names; False: shorten long lists.

    Returns:
        The differences, in the order of the layers in the format.
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
    """B converted to A's axes and units, the report, and whether the comparison is bit for bit."""
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
    except ValueError as error:  # also DnaError: invalid axes or units
        report.add("file", "", f"numbers are compared as they stand: {error}")
        return b, report, True
    report.add("file", "", "numbers are compared in the axes and units of A, but for rounding")
    return converted, report, False


def _same_bytes(a: risorius.Dna, b: risorius.Dna) -> bool:
    """Whether the DNA files of both faces have equal bytes. If they differ although no module of
    layers/ reports a difference, a module has missed one."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return a.to_bytes() == b.to_bytes()
