# SPDX-License-Identifier: MIT
"""What is wrong with expressions by contact, before and after the repair."""

from __future__ import annotations

from dataclasses import dataclass, field

MM = 10.0  # of a unit of the target


@dataclass(frozen=True)
class Faults:
    """What is wrong with a pose.

    Attributes:
        lid_gap: mm, the widest place at which an eye is seen that is to be closed; 0 elsewhere.
        cut: mm, how deep the outside of lids lies in an eye.
        lip_gap: mm, the widest gap between lips that are to meet; 0 elsewhere.
        lip_cut: mm, how deep such lips are in each other beyond rest.
        volume: mm3 of skin in teeth and gums, beyond rest.
        stretched: polygons of more than 2.5 times their area.
    """

    lid_gap: float = 0.0
    cut: float = 0.0
    lip_gap: float = 0.0
    lip_cut: float = 0.0
    volume: float = 0.0
    stretched: int = 0


@dataclass
class Report:
    """Faults of each pose, before and after; poses are written with + between their controls.

    Attributes:
        rows: by pose, of those in which something is or was wrong, and of all that close.
        notes: a sentence each.
    """

    rows: dict[str, tuple[Faults, Faults]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def worst(self) -> Faults:
        """Of each kind the largest that is left."""
        after = [row[1] for row in self.rows.values()] or [Faults()]
        return Faults(
            max(f.lid_gap for f in after),
            max(f.cut for f in after),
            max(f.lip_gap for f in after),
            max(f.lip_cut for f in after),
            max(f.volume for f in after),
            max(f.stretched for f in after),
        )
