# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""The base class of operators that change controls by hand and insert keyframes."""

from collections.abc import Collection

import bpy

from ...logic.base.errors import FaceError
from ...scene.animation import keying
from ...scene.frame import evaluate
from ..blender_types import Context, Result
from ..common import FaceOperator, face_rig
from ..words import of_error

MOMENTS = (
    (
        "NOW",
        "Current Frame",
        (
            "Change the current frame; keys are inserted as Blender's "
            "auto-key and keying set require"
        ),
    ),
    ("SELECTED", "Selected Keys", "Change each frame that has a selected key of this face"),
)


class HandOperator(FaceOperator):
    """Base of all operators that move sliders or control bones.

    Subclasses define `move`; the base class inserts keyframes.
    """

    at: bpy.props.EnumProperty(
        name="At", description="Frames to change", items=MOMENTS, options={"SKIP_SAVE"}
    )

    def move(self, context: Context) -> Collection[str] | None:
        """Move the controls from their current values.

        Returns:
            Names of the changed sliders; None if no control was moved and the reason was reported.
        """
        raise NotImplementedError

    def stand_at(self, frame: float) -> None:
        """Prepare for a frame; called before `move` is called for this frame.

        The base class does nothing here.
        """

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
