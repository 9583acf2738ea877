# SPDX-License-Identifier: GPL-3.0-or-later
"""Holds the old and the new data while a character's DNA file is replaced."""

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
        before, after: Runtimes of the old and the new file.
        old, new: CharacterPlans of the old and the new file.
        old_bones, new_bones: bone names by joint index of the old and the new file.
        report: sentences for the user.
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
        """New index of each old blend shape channel; -1 if the new file lacks it."""
        return user_edits.index_map(
            *(build.channel_labels(r.dna) for r in (self.before, self.after))
        )

    def mesh_map(self) -> list[int]:
        """New index of each old mesh; -1 if the new file lacks it."""
        return user_edits.index_map(
            *(names.unique_labels(r.dna.mesh_names) for r in (self.before, self.after))
        )
