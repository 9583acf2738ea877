# SPDX-License-Identifier: MIT
"""Reports faults of expressions (gaps, cuts, stretched polygons) before and after the repair."""

from __future__ import annotations

from dataclasses import dataclass, field

MM = 10.0  # mm per unit of the target


@dataclass(frozen=True)
class Faults:
    """Faults of a pose.

    Attributes:
        lid_gap: mm, largest vertical extent of the visible part of an eye that the pose closes; 0
            in other poses.
        cut: mm, largest depth to which a lid's outer surface enters an eye.
        lip_gap: mm, widest gap between the lips if the pose closes the mouth; 0 in other poses.
        lip_cut: largest depth in mm of one lip in the other, minus this depth in the rest pose, if
            the pose closes the mouth; 0 in other poses.
        volume: mm3 of skin deeper in teeth and gums than in the rest pose.
        stretched: number of polygons with more than 2.5 times their area in the rest pose.
    """

    lid_gap: float = 0.0
    cut: float = 0.0
    lip_gap: float = 0.0
    lip_cut: float = 0.0
    volume: float = 0.0
    stretched: int = 0


@dataclass
class Report:
    """Faults of each pose before and after the repair.

    Attributes:
        rows: by pose (its controls, joined by +), for poses with faults and for all poses that
            close eyes or mouth.
        notes: sentences for the user.
    """

    rows: dict[str, tuple[Faults, Faults]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def worst(self) -> Faults:
        """The largest remaining fault of each kind over all poses."""
        after = [row[1] for row in self.rows.values()] or [Faults()]
        return Faults(
            max(f.lid_gap for f in after),
            max(f.cut for f in after),
            max(f.lip_gap for f in after),
            max(f.lip_cut for f in after),
            max(f.volume for f in after),
            max(f.stretched for f in after),
        )
