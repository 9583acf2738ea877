# SPDX-License-Identifier: GPL-3.0-or-later
# Blender takes properties where Python has annotations:
# pyright: reportInvalidTypeForm=false
"""The base class of operators that move controls as the animator's hand does."""

from collections.abc import Collection

import bpy

from ...logic.base.errors import FaceError
from ...scene.animation import keying
from ...scene.frame import evaluate
from ..blender_types import Context, Result
from ..common import FaceOperator, face_rig
from ..words import of_error

MOMENTS = (
    ("NOW", "Current Frame", "Insert keys as auto-key and the keying set of Blender require"),
    ("SELECTED", "Selected Keys", "At each frame that has a selected key of this face"),
)


class HandOperator(FaceOperator):
    """Base of all operators that move sliders or control bones.

    They define `move`; keys are inserted by shared code.
    """

    at: bpy.props.EnumProperty(
        name="At", description="Frames to change", items=MOMENTS, options={"SKIP_SAVE"}
    )

    def move(self, context: Context) -> Collection[str] | None:
        """Move the controls from their current values.

        Returns:
            The handled sliders; None if it did nothing and reported the reason.
        """
        raise NotImplementedError

    def stand_at(self, frame: float) -> None:
        """Called with the frame before each move."""

    def execute(self, context: Context) -> Result:
        rig, done = face_rig(context), []

        def move() -> Collection[str] | None:
            touched = self.move(context)
            done.append(touched is not None)
            return touched

        try:
            keying.by_hand(context, rig, move, self.at == "SELECTED", self.stand_at)
        except FaceError as error:
            self.report({"ERROR"}, of_error(error))
            return {"CANCELLED"}
        evaluate.bring_up(context, rig)
        return {"FINISHED"} if any(done) else {"CANCELLED"}
