# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that sets to rest all controls that no animation moves."""

from collections.abc import Collection

from ...scene.character import standing
from ..blender_types import Context, Operator
from ..common import face_rig
from ..hand.base import HandOperator
from ..words import say


class RISORIUS_OT_rest_others(HandOperator, Operator):
    """Set controls to 0 that no key, layer or driver moves"""

    bl_idname = "risorius.rest_others"
    bl_label = "Bring to Rest"

    def move(self, context: Context) -> Collection[str] | None:
        rig = face_rig(context)
        found = standing.beside(rig)
        count = len(found.sliders) + len(found.handles)
        if not count:
            self.report({"INFO"}, say("All controls without keys are at rest."))
            return None
        standing.bring_to_rest(rig, found)
        self.report({"INFO"}, say("{count} controls were brought to rest.", count=count))
        return list(found.sliders)


CLASSES = (RISORIUS_OT_rest_others,)
