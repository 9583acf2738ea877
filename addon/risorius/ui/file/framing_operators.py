# SPDX-License-Identifier: GPL-3.0-or-later
"""An operator that lets the view show the face, whatever is selected."""

from ..blender_types import Context, Operator, Result
from ..common import FaceOperator, face_rig
from ..words import say
from . import framing


class RISORIUS_OT_frame_face(FaceOperator, Operator):
    """Show the whole head in the view; outlines and the face board do not count"""

    bl_idname = "risorius.frame_face"
    bl_label = "Frame Face"
    bl_options = {"REGISTER"}
    whole_face = False
    baked_too = True

    def execute(self, context: Context) -> Result:
        if not framing.show_whole(context, face_rig(context)):
            text = "No view can be moved: each one follows an object or the 3D cursor."
            self.report({"WARNING"}, say(text))
            return {"CANCELLED"}
        return {"FINISHED"}


CLASSES = (RISORIUS_OT_frame_face,)
