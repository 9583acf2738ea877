# SPDX-License-Identifier: MIT
"""Measures the height of a face, and guesses its unit from the usual height of faces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...controls.regions import region_of
from ..geometry.skeleton import Doubles

# Unit -> its length in mm.
UNITS = {
    "m": 1000.0, "cm": 10.0, "mm": 1.0, "inch": 25.4, "dm": 100.0, "foot": 304.8, "km": 1e6,
    "0.1 mm": 0.1, "0.01 mm": 0.01, "10 m": 1e4,
}  # fmt: skip
SAID = ("m", "cm", "mm", "inch", "dm", "foot")  # units that the user may choose
# Smallest, largest and most usual height of a face in mm, from the chin to the top of the mesh.
_LEAST, _MOST, _USUAL = 180.0, 300.0, 230.0
_ODD = (120.0, 450.0)  # mm, unusual heights that keep the file's unit, with a note
_MOVED = 0.3  # vertices that move less than this fraction of a shape's maximum do not show the chin


def face_height(
    points: Doubles, shapes: Mapping[str, Doubles], controls: Mapping[str, Sequence[str]]
) -> float:
    """The height from the chin to the top of the mesh. A neck or a body does not count.

    The chin is the lowest place that shapes of jawOpen move; without jawOpen, the lowest place that
    shapes of jaw and mouth move.

    Args:
        points: float64[V, 3], y is up.
        shapes: name -> displacements float64[V, 3].
        controls: name -> raw controls without prefix. If no shape belongs to jaw or mouth, all
            shapes count.
    """
    heights = points[:, 1]
    meant = {n: {region_of(c) for c in controls.get(n, ())} for n in shapes}
    jaw = [n for n in shapes if "jawOpen" in controls.get(n, ())]
    lips = [n for n in shapes if meant[n] and meant[n] <= {"mouth", "jaw"}]
    lowest = []
    for name in jaw or lips or shapes:
        delta = shapes[name]
        length = np.linalg.norm(delta, axis=1)
        if length.max(initial=0.0) > 1e-9 * (np.ptp(heights) or 1.0):
            lowest.append(float(np.quantile(heights[length > _MOVED * length.max()], 0.02)))
    chin = min(lowest) if lowest else float(heights.min())
    return float(heights.max()) - chin


def find_unit(height: float, unit: str, *, sure: bool) -> tuple[str, str]:
    """The unit of a face's coordinates, and a note on an unusual height, or "".

    Args:
        height: height of the face in the file's numbers.
        unit: unit that the format or the user states.
        sure: True if the user states the unit; then this unit is returned.
    """
    as_said = height * UNITS[unit]
    usual = f"a face is {_LEAST / 10:.0f} to {_MOST / 10:.0f} cm high"
    if sure or _ODD[0] <= as_said <= _ODD[1] or not height > 0:
        if _LEAST <= as_said <= _MOST:
            return unit, ""
        return unit, f"the face is {in_words(as_said)} high in {unit}, and {usual}: {_MENDS}"
    fits = [u for u in UNITS if _LEAST <= height * UNITS[u] <= _MOST]
    if not fits:
        return unit, (
            f"the face is {in_words(as_said)} high in {unit}, {usual}, and in no unit that is "
            f"known is it so: {_MENDS}"
        )
    # inch and foot are chosen only if no metric unit fits
    best = min(fits, key=lambda u: (u in ("inch", "foot"), abs(np.log(height * UNITS[u] / _USUAL))))
    return best, (
        f"the face would be {in_words(as_said)} high in {unit}, and {usual}: taken as {best}, "
        f"{in_words(height * UNITS[best])}; {_MENDS}"
    )


_MENDS = "height_mm, scale or unit (in Blender: Height) sets another size"


def in_words(mm: float) -> str:
    """A length as text with a suitable unit, for example 24.1 cm or 2.4 m."""
    for least, unit in ((1000.0, "m"), (10.0, "cm")):
        if mm >= least:
            return f"{mm / UNITS[unit]:.3g} {unit}"
    return f"{mm:.3g} mm"


def check_unit(unit: str) -> str:
    """An error message if the user's unit is unknown, or ""."""
    return "" if unit in SAID else f"unit: one of {', '.join(SAID)} was expected, found {unit!r}"
