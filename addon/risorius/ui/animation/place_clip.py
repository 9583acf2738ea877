# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Places a clip on the active face as an action, strip or layer, and stores its report."""

from collections.abc import Sequence

import bpy

from ... import native
from ...logic.animation.clip_units import ClipError
from ...logic.base.names import printable
from ...scene.animation import actions, board_keys, clip_actions, layers
from ...scene.base import saved
from ...scene.base.blender_types import ArmatureObject
from ...scene.character import standing
from ...scene.frame import evaluate
from ..blender_types import Context, UILayout
from ..common import FaceOperator, face_controls, face_rig
from ..words import say

TARGETS = (
    ("ACTION", "Action", "As the active action of the face; the earlier action is kept"),
    ("STRIP", "NLA Strip", "As a strip on a new NLA track"),
    ("LAYER", "Layer", "As a layer above the existing animation"),
)
RANGES = (
    ("EXTEND", "Extend", "Extend the scene to the end of the animation"),
    (
        "FIT",
        "Fit",
        "Set the start and end of the scene to the first and last frame of the animation",
    ),
    ("KEEP", "Keep", "Keep the range of the scene"),
)
_REPORT = "risorius_report"  # property of an action: the report of its import
_SHOWN = 6


class PlacesClip(FaceOperator):
    """Properties and methods of all operators that place a clip on the active face."""

    target: bpy.props.EnumProperty(
        name="As",
        description="Where the animation is stored: an action, an NLA strip or a layer",
        items=TARGETS,
    )
    start: bpy.props.FloatProperty(
        name="Start Frame",
        description=(
            "Frame of the scene for time 0 of the animation, which is its first "
            "frame or the start of its sound"
        ),
        default=1.0,
    )
    scene_range: bpy.props.EnumProperty(
        name="Scene Range",
        description="Choose whether the frame range of the scene changes",
        items=RANGES,
    )

    use_rest: bpy.props.BoolProperty(
        name="Bring to Rest",
        description=(
            "Set controls to 0 that the animation does not move. Off: they "
            "keep their values, and the report names them"
        ),
        options={"SKIP_SAVE"},
    )

    def start_with(self, scene: bpy.types.Scene) -> None:
        """Set `start` to the first frame of the scene, unless a caller has already set `start`."""
        if not self.properties.is_property_set("start"):
            self.start = float(scene.frame_start)

    def place(
        self,
        context: Context,
        clip: "native.Clip",
        name: str,
        notes: Sequence[str] = (),
        with_eyes: bool = True,
        whole: bool = False,
        tolerance: float = 0.0,
    ) -> bpy.types.Action:
        """Place a clip on the active face and store the report.

        Args:
            context: context with the face and the scene.
            clip: the clip.
            name: name of the action.
            notes: sentences with which the report begins.
            with_eyes: True: the clip also rotates the eye bones.
            whole: True: keys are on whole frames only.
            tolerance: largest difference between a slider's value in the clip and on the Bezier
                curve that is fitted to the clip; 0: no curve is fitted, and each sample of the
                clip becomes a linear key.

        Returns:
            The new action.

        Raises:
            ClipError: the face is in the tweak mode of the NLA editor, no curve of the clip fits
                this face, or frames lie outside of Blender's range.
        """
        rig = face_rig(context)
        trouble = actions.busy(face_controls(context))
        if trouble:
            raise ClipError(trouble)
        timing = clip_actions.timing_of(
            clip, context.scene, self.start, keep_clock=True, whole=whole
        )
        made = clip_actions.make_action(rig, clip, timing, name, with_eyes, tolerance)
        notes = [*notes, *made.notes]
        if self.target != "LAYER":
            notes += [say(note) for note in board_keys.onto_leader(rig, made.action)]
        if self.target == "ACTION":
            before = clip_actions.play(rig, made.action)
            layers.keep_weights(face_controls(context), before)
            if before is not None:
                notes.append(f"The action {before.name} was kept.")
        elif self.target == "STRIP":
            clip_actions.add_strip(rig, made.action)
        else:
            layers.add_action(face_controls(context), made.action, **self.layer_settings(context))
        if self.target != "LAYER":  # a layer leaves controls that it does not animate unchanged
            notes += self._others(rig)
        clip_actions.set_range(context.scene, made, self.scene_range)
        evaluate.bring_up(context, rig)
        self._report_on(made, notes)
        return made.action

    def _others(self, rig: ArmatureObject) -> list[str]:
        """Set to rest all controls that the animation does not move, if `use_rest` is on.

        Returns:
            One sentence for the report: the number of controls that were set to rest, or with
            `use_rest` off the names of the controls that keep their values. Empty if all these
            controls were at rest.
        """
        found = standing.beside(rig)
        sentence = found.sentence
        if sentence is None:
            return []
        if not self.use_rest:
            return [say(sentence)]
        standing.bring_to_rest(rig, found)
        count = len(found.sliders) + len(found.handles)
        return [say("{count} controls were brought to rest.", count=count)]

    def layer_settings(self, context: Context) -> dict[str, object]:
        """Properties of the layer that plays the clip, by name; subclasses override the empty dict.

        Args:
            context: context with the scene, which has the frame rate.
        """
        return {}

    def _report_on(self, made: clip_actions.Report, notes: list[str]) -> None:
        if made.unknown:
            notes.append(f"No control of this face: {', '.join(made.unknown)}.")
        made.action[_REPORT] = "\n".join(printable(note, 4000) for note in notes)
        for note in notes[:_SHOWN]:
            self.report({"INFO"}, printable(note))
        if len(notes) > _SHOWN:
            self.report(
                {"INFO"},
                say("and {count} more lines in the panel Animation", count=len(notes) - _SHOWN),
            )
        self.report({"INFO"}, say(made.summary()))

    def draw_place(self, layout: UILayout) -> None:
        """Draw the properties of this class in a dialog."""
        for name in ("target", "start", "scene_range", "use_rest"):
            layout.prop(self, name)


def report_of(action: bpy.types.Action | None) -> list[str]:
    """The lines of the import report of an action; empty without a report."""
    text = saved.text(action, _REPORT) if action is not None else ""
    return text.split("\n") if text else []
