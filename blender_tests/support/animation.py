# SPDX-License-Identifier: GPL-3.0-or-later
"""Animates a face with keys on some controls and on the head."""

from . import scene


def animate(rig, with_head=True):
    """Insert keys on three controls and the head bone from frame 1 to 10. Returns the controls."""
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
