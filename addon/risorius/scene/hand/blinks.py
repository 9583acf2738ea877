# SPDX-License-Identifier: GPL-3.0-or-later
"""Adds timed blinks, as keys of the lid sliders or in a layer over these sliders."""

from __future__ import annotations

from dataclasses import dataclass

import bpy

from ..animation import keying, layer_mixing, layer_properties, layers
from ..base import compat, parts
from ..base.blender_types import ArmatureObject
from ..character import armatures, runtime

_MARK = "risorius_blinks"  # custom property of the action of the blink layer


@dataclass(frozen=True)
class Blink:
    """Timing of a blink in frames of the scene.

    Attributes:
        close, hold, open: length of each phase: the lids close, stay closed, and open.
        strength: slider value of the closed lids, 0 to 1.
        offset: delay of the character's right eye; negative: the right eye closes first.
        sides: L, R or both.
    """

    close: float = 3.0
    hold: float = 1.0
    open: float = 5.0
    strength: float = 1.0
    offset: float = 0.0
    sides: str = "LR"

    def begin(self, frame: float, side: str) -> float:
        """The frame at which an eye begins to close.

        Args:
            frame: frame at which the blink begins.
            side: "L" or "R", side of the eye.
        """
        return frame + (self.offset if side == "R" else 0.0)

    def keys(self, begin: float, before: float, after: float) -> list[tuple[float, float]]:
        """Frames and values of the keys of one eye.

        Args:
            begin: frame at which the eye begins to close.
            before, after: slider values at the start and end of the blink.
        """
        shut = begin + self.close
        most = max(self.strength, before, after)  # a blink never opens an eye
        return [
            (begin, before),
            (shut, most),
            *([(shut + self.hold, most)] if self.hold > 0.0 else []),
            (shut + self.hold + self.open, after),
        ]


def sliders(live: runtime.Runtime, sides: str) -> dict[str, str]:
    """Side "L" or "R" -> name of the slider that closes the eye of this side.

    Args:
        live: Runtime of the character.
        sides: "L", "R" or "LR"; a side whose slider the face lacks is left out of the result.
    """
    found = {side: live.lids.get(f"eyeBlink{side}") for side in sides}
    return {side: live.labels[i] for side, i in found.items() if i is not None}


def key(rig: ArmatureObject, frame: float, blink: Blink, rules: keying.Rules) -> int:
    """Key a blink on the lid sliders; existing keys of these sliders during the blink are removed.

    Args:
        rig: the character.
        frame: frame at which the blink begins.
        blink: its timing.
        rules: settings for new keys.

    Returns:
        The number of inserted keys.
    """
    controls, count = parts.controls_there(rig), 0
    face = controls.pose.bones[parts.FACE]
    for side, label in sliders(runtime.there(rig), blink.sides).items():
        path = parts.property_path(label)
        curve = next(iter(keying.curves_by_path(controls).get(path, ())), None)
        now = float(face[label])
        begin = blink.begin(frame, side)
        end = begin + blink.close + blink.hold + blink.open
        ends = [curve.evaluate(at) if curve else now for at in (begin, end)]
        if curve is not None:
            within = [k for k in curve.keyframe_points if begin - 1e-3 < k.co.x < end + 1e-3]
            for point in reversed(within):
                curve.keyframe_points.remove(point)
        for at, value in blink.keys(begin, *ends):
            face[label] = value
            count += keying.insert(controls, [label], (), at, rules)
        face[label] = now
    return count


def layer_of(controls: ArmatureObject) -> layer_properties.RISORIUS_PG_layer | None:
    """The blink layer of a character, or None."""
    found = (y for y in layers.of(controls) if y.action is not None and y.action.get(_MARK))
    return next(found, None)


def add_to_layer(rig: ArmatureObject, frame: float, blink: Blink, name: str) -> None:
    """Add a blink to the blink layer, which can only close the eyes further than the sliders.

    Keys of the layer during the blink are replaced.

    Args:
        rig: the character.
        frame: frame at which the blink begins.
        blink: its timing.
        name: name of the layer if there is none yet.
    """
    controls = parts.controls_there(rig)
    layer = layer_of(controls)
    if layer is None:
        action = bpy.data.actions.new(f"{rig.name.removesuffix('_rig')} blinks")
        action[_MARK] = True
        compat.add_curves(action, controls)
    else:
        action = layer.action
    bag = compat.bag_for(action, controls)
    assert bag is not None
    for side, label in sliders(runtime.there(rig), blink.sides).items():
        path = parts.property_path(label)
        curve = bag.fcurves.find(path)
        if curve is None:
            curve = bag.fcurves.new(path)
            title = armatures.key_group(label)
            curve.group = bag.groups.get(title) or bag.groups.new(title)
        keys = blink.keys(blink.begin(frame, side), 0.0, 0.0)
        for point in [k for k in curve.keyframe_points if keys[0][0] <= k.co.x <= keys[-1][0]][
            ::-1
        ]:
            curve.keyframe_points.remove(point)
        for at, value in keys:
            curve.keyframe_points.insert(at, value, options={"FAST"})
        curve.update()
    if layer is None:
        layers.add(controls, "ACTION", name, action=action, blend="MAXIMUM", extend="NOTHING")
        layer = layer_of(controls)
    assert layer is not None
    layer.start = action.frame_range[0]
    layer_mixing.note_edits([action])  # Blender reports no edit of an action that no object plays
    controls.update_tag()
