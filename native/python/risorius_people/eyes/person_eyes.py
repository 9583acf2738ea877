# SPDX-License-Identifier: MIT
"""The eyes of a person: positions of the balls, rest pose of the lids, and their expressions."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..polygons import Floats, Ints
from ..source import BaseMesh
from . import eyeball, lids
from .lids import Lids
from .rings import ROOT, find_rings

# Ages in years, and for each age the height of the upper lids above the eye's middle in radii of
# the iris.
_AGES, _OPEN = (8, 30, 75), (0.78, 0.70, 0.60)
_SIDES = (("l", "L"), ("r", "R"))
_LASH_RINGS = slice(ROOT - 1, ROOT + 1)
Units = dict[str, Floats]
Correctives = dict[tuple[str, str], Floats]


class Eyes:
    """The eyes of a person: their balls, lids and expressions.

    Attributes:
        lids: "l" or "r" -> the lids of this eye.
    """

    def __init__(
        self, base: BaseMesh, groups: dict[str, Ints], positions: Floats, age: float
    ) -> None:
        """Places eyeballs in a face; the lids stay as in the data.

        Args:
            base: the base mesh.
            groups: name of a group of the base mesh -> vertex indices.
            positions: float64[V, 3] in decimetres; the vertices of the eyes are changed.
            age: age of the person in years.
        """
        self._groups = groups
        self.lids: dict[str, Lids] = {}
        rings = find_rings(base, groups)
        for side, _ in _SIDES:
            middle, radius = lids.place_ball(positions, groups, rings[side], side)
            helper = groups[f"helper-{side}-eye"]
            positions[helper] += middle - positions[helper].mean(axis=0)
            eyeball.seat(positions, groups, side, middle, radius)
            openness = float(np.interp(age, _AGES, _OPEN))
            raw = positions.copy()
            self.lids[side] = Lids(side, rings[side], openness, middle, radius, raw, raw.copy())
        for eye in self.lids.values():  # repeated, because now both eyes are placed
            eye.raw, eye.rest = positions.copy(), positions.copy()

    def open(self, positions: Floats, widen: Mapping[str, Floats]) -> None:
        """Opens the lids to their rest pose.

        Args:
            positions: float64[V, 3] of the person in decimetres; changed.
            widen: "L" or "R" -> float64[V, 3], the data's displacement that widens this eye.
        """
        for side, letter in _SIDES:
            eye = self.lids[side]
            opened = lids.open_lids(eye, widen[letter])
            way = self._with_lashes(eye, eye.rest - eye.raw, opened)
            positions += way
        for eye in self.lids.values():
            eye.rest = positions.copy()

    def _with_lashes(self, eye: Lids, way: Floats, before: Floats) -> Floats:
        """The displacement `way`, with lashes that follow the skin at their roots.

        Args:
            eye: lids of the eye.
            way: float64[V, 3], displacement; its rows of the lashes are changed.
            before: float64[V, 3], the part of the skin's displacement that the lashes have already.
        """
        roots = eye.rings[_LASH_RINGS].ravel()
        for number in (1, 2):
            lashes = self._groups[f"helper-{eye.side}-eyelashes-{number}"]
            gaps = np.linalg.norm(eye.raw[lashes][:, None] - eye.raw[roots][None], axis=2)
            near = roots[gaps.argmin(axis=1)]
            way[lashes] += way[near] - before[near]
        return way

    def move(self, units: Units) -> Correctives:
        """Replaces the data's motions of eyes and lids by motions that fit these eyes.

        Args:
            units: raw control -> float64[V, 3]; controls that move eyes or lids are changed.

        Returns:
            Correctives: two raw controls -> float64[V, 3]. A pair of equal controls has the weight
                of the square of the control. The control's own shape must then be smaller by this
                corrective, so that their sum at 1 is its displacement in `units`.
        """
        correctives: Correctives = {}
        for side, letter in _SIDES:
            eye = self.lids[side]
            blink = f"eyeBlink{letter}"
            turns = {f"eyeLook{way}{letter}": lids.look_rotation(way) for way in lids.LOOKS}
            self._looks(eye, units, letter)
            self._pupils(eye, units, letter)
            units[f"eyeWiden{letter}"] = lids.WIDER * units[f"eyeWiden{letter}"]
            for name, before in units.items():
                if name != blink:
                    way = lids.on_the_ball(eye, before, turns.get(name))
                    units[name] = way if way is before else self._with_lashes(eye, way, before)
            closed = self._with_lashes(eye, *lids.closing(eye, units[blink]))
            still = np.zeros_like(closed)
            half = self._with_lashes(eye, lids.between(eye, closed), still)
            for name in lids.partners(units, letter):
                more = lids.stays_closed(eye, closed, units[name], turns.get(name))
                correctives[(blink, name)] = self._with_lashes(eye, more, still)
            for one, other in lids.together(units, letter):
                turn = turns.get(other)
                more = lids.stays_on_the_ball(eye, units[one], units[other], turn)
                correctives[(one, other)] = self._with_lashes(eye, more, still)
            # The control's shape becomes closed + 4 * half. At a value x it gives, together with
            # this corrective, x * closed + 4 * x * (1 - x) * half: all of `half` at x = 0.5, and
            # none of it for open and closed lids.
            correctives[(blink, blink)] = -4 * half
            units[blink] = closed
        return correctives

    def _looks(self, eye: Lids, units: Units, letter: str) -> None:
        """Makes a look rotate the eyeball about its middle; lids follow more than in the data.

        Args:
            eye: lids of the eye.
            units: raw control -> float64[V, 3]; the looks of this eye are changed.
            letter: "L" or "R".
        """
        names = ("helper-{}-eye", "eyeball-{}", "cornea-{}")
        own = np.concatenate([self._groups[name.format(eye.side)] for name in names])
        for way in lids.LOOKS:
            unit = lids.following(eye, way, units[f"eyeLook{way}{letter}"])
            arm = eye.rest[own] - eye.middle
            unit[own] = arm @ lids.look_rotation(way).T - arm
            units[f"eyeLook{way}{letter}"] = unit

    def _pupils(self, eye: Lids, units: Units, letter: str) -> None:
        own = self._groups[f"eyeball-{eye.side}"]
        for name, share in (("eyePupilWide", 0.23), ("eyePupilNarrow", -0.15)):
            unit = np.zeros_like(eye.rest)
            unit[own] = share * eyeball.pupil_wide(eye.radius, eye.side)
            units[f"{name}{letter}"] = unit
