# SPDX-License-Identifier: MIT
"""Finds the lower teeth of a head, and corrects the predicted change of its jaw by them."""

from __future__ import annotations

import numpy as np

from ... import Dna
from ...author.geometry.skeleton import Doubles
from ..form.teeth import JawChange, shown_by
from .fitted import JAW, TEETH, Fittings
from .sorting import sort_parts
from .template_parts import template_parts


def lower_teeth(fittings: Fittings) -> Doubles | None:
    """float64[n, 3]: vertices of the lower teeth; None unless upper and lower teeth are separate.

    Args:
        fittings: the meshes of a head.
    """
    rows = fittings.of(TEETH)
    lower = [row.part.mesh.positions for row in rows if row.hangs == JAW]
    if not lower or len(lower) == len(rows):
        return None
    return np.concatenate(lower)


def jaw_by_teeth(told: JawChange, template: Dna, found: Fittings) -> JawChange:
    """The change of the jaw from a template to a head, corrected if both have lower teeth.

    Args:
        told: the change that the statistical head model predicts from the skin.
        template: a face of a DNA file.
        found: the meshes of the head.
    """
    after = lower_teeth(found)
    if after is None:
        return told
    before = lower_teeth(sort_parts(template_parts(template)[1]))
    return told if before is None else shown_by(told, before, after)
