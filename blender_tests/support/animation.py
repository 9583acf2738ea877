# SPDX-License-Identifier: GPL-3.0-or-later
"""Sets keyframes of a few controls and of the head bone of a face."""

from . import scene


def animate(rig, with_head=True):
    """Set keyframes of three controls and, if `with_head`, the head bone at frames 1, 5 and 10.

    Returns the control armature.
    """
    controls, bone = scene.controls(rig), scene.face(rig)
    for frame, jaw, pull, turn in ((1, 0.0, 1.0, 0.0), (5, 1.0, 0.2, 0.4), (10, 0.3, 0.6, -0.3)):
        for end, value in (("jawOpen", jaw), ("mouthCornerPullL", pull), ("eyeLookUpL", jaw)):
            name = f"CTRL_expressions.{end}"
            bone[name] = value
            bone.keyframe_insert(f'["{name}"]', frame=frame, group="Test")
        head = controls.pose.bones["head"]
        if not with_head:
            continue
        head.rotation_mode = "XYZ"
        head.rotation_euler = (turn, 0, turn / 2)
        head.keyframe_insert("rotation_euler", frame=frame)
    return controls
