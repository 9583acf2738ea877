# SPDX-License-Identifier: GPL-3.0-or-later
"""The data of replacing one file by another in the same objects."""

from __future__ import annotations

from dataclasses import dataclass, field

from ...logic.base import names
from ...logic.character import plans, user_edits
from ..base.blender_types import ArmatureObject
from ..character import build, runtime


@dataclass
class Change:
    """The old and the new file of a replacement.

    Attributes:
        rig: the deforming armature, which stays.
        before, after: Runtimes of the two files.
        old, new: CharacterPlans of the two files.
        old_bones, new_bones: name of the bone of each joint of the old, then of the new file.
        report: sentences.
    """

    rig: ArmatureObject
    before: runtime.Runtime
    after: runtime.Runtime
    old: plans.CharacterPlan
    new: plans.CharacterPlan
    old_bones: list[str] = field(default_factory=list)
    new_bones: list[str] = field(default_factory=list)
    report: list[str] = field(default_factory=list)

    def channel_map(self) -> list[int]:
        """New channel of each old one, -1 if it no longer exists."""
        return user_edits.index_map(
            *(build.channel_labels(r.dna) for r in (self.before, self.after))
        )

    def mesh_map(self) -> list[int]:
        """New mesh of each old one, -1 if it no longer exists."""
        return user_edits.index_map(
            *(names.unique_labels(r.dna.mesh_names) for r in (self.before, self.after))
        )
