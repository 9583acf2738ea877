# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests that risorius.Mixer equals Blender's NLA at every frame, for settings that both have."""

import bpy
import numpy as np
import pytest
from risorius import Clip, Layer, Mixer

RATE = 24.0
NAMES = ("a", "b", "c", "d")
FRAMES = 20  # frames of each clip
BASE = np.float32([0.1, 0.2, 0.3, 0.4])


def clip(names=NAMES, seed=1, high=0.5):
    curves = np.random.default_rng(seed).uniform(0.0, high, (len(names), FRAMES))
    return Clip(names, curves, RATE)


def new_curve(action, path, index=0):
    """Make an F-curve of an action, also in Blender 4.4 and later, in which actions have slots."""
    if not hasattr(action, "slots"):
        return action.fcurves.new(path, index=index)
    if not action.slots:
        action.slots.new(id_type="OBJECT", name="Face")
        action.layers.new("Layer").strips.new(type="KEYFRAME")
    bag = action.layers[0].strips[0].channelbag(action.slots[0], ensure=True)
    return bag.fcurves.new(path, index=index)


def keys(curve, frames, values):
    """Replace all keyframes of an F-curve by linear keyframes."""
    curve.keyframe_points.clear()
    curve.keyframe_points.add(len(frames))
    pairs = np.column_stack([frames, values]).ravel()
    curve.keyframe_points.foreach_set("co", pairs)
    for point in curve.keyframe_points:
        point.interpolation = "LINEAR"
    curve.update()


def action_of(source):
    """Make an action with the curves of a clip; sample 0 of the clip is at frame 0."""
    action = bpy.data.actions.new("Clip")
    for name, values in zip(source.names, source.curves, strict=True):
        keys(new_curve(action, f'["{name}"]'), np.arange(FRAMES), values)
    return action


def strip_of(face, source, settings):
    """Add an NLA strip with a clip on a new top track.

    Args:
        face: the object.
        source: the clip.
        settings: properties of the strip by Blender's names; besides, "influence_curve" and
            "time_curve" are (frames, values) of keys, and "ends" is (start, end) of the strip.
    """
    settings = dict(settings)
    track = face.animation_data.nla_tracks.new()
    action = action_of(source)
    strip = track.strips.new("Clip", 0, action)
    if hasattr(strip, "action_slot") and strip.action_slot is None:
        strip.action_slot = action.slots[0]
    strip.use_auto_blend = False
    influence = settings.pop("influence_curve", None)
    strip_time = settings.pop("time_curve", None)
    ends = settings.pop("ends", None)
    for name in ("action_frame_start", "action_frame_end", "scale", "repeat"):
        if name in settings:
            setattr(strip, name, settings.pop(name))
    if "frame_start" in settings:
        length = strip.frame_end - strip.frame_start
        start = settings.pop("frame_start")
        strip.frame_end = start + length + 1000.0  # a strip may not end before it starts
        strip.frame_start = start
        strip.frame_end = start + length
    if ends is not None:
        strip.frame_end, strip.frame_start = ends[1], ends[0]
    for name, value in settings.items():
        setattr(strip, name, value)
    if influence is not None:
        strip.use_animated_influence = True
        keys(strip.fcurves.find("influence"), *influence)
    if strip_time is not None:
        strip.use_animated_time = True
        keys(strip.fcurves.find("strip_time"), *strip_time)
    return strip


def new_face():
    face = bpy.data.objects.new("Face", None)
    bpy.context.scene.collection.objects.link(face)
    for name, value in zip(NAMES, BASE, strict=True):
        face[name] = float(value)
        face.id_properties_ui(name).update(min=-10, max=10, default=float(value))
    face.animation_data_create()
    return face


# Name of a test case -> its layers, the lowest first. A layer is (seed of the random clip, settings
# of Blender's strip, settings of risorius.Layer).
STACKS = {
    "replace": [(1, {}, {})],
    "add": [
        (1, {}, {}),
        (
            2,
            {"blend_type": "ADD", "influence_curve": ([0], [0.6])},
            {"blend": "additive", "weight": 0.6},
        ),
    ],
    "half": [(1, {}, {}), (2, {"influence_curve": ([0], [0.35])}, {"weight": 0.35})],
    "influence curve": [
        (1, {}, {}),
        (
            2,
            {"influence_curve": ([2, 9, 15], [0.0, 0.9, 0.25])},
            {"weight": (np.array([2, 9, 15]) / RATE, [0.0, 0.9, 0.25])},
        ),
    ],
    "moved and scaled": [
        (1, {"frame_start": 5.0, "scale": 1.75}, {"start": 5 / RATE, "scale": 1.75})
    ],
    "repeated": [
        (
            1,
            {"frame_start": 3.0, "scale": 0.5, "repeat": 2.5},
            {"start": 3 / RATE, "scale": 0.5, "repeat": 2.5},
        )
    ],
    "whole repeats": [(1, {"scale": 0.5, "repeat": 2.0}, {"scale": 0.5, "repeat": 2})],
    "trimmed": [
        (
            1,
            {"action_frame_start": 4.0, "action_frame_end": 13.0, "frame_start": 6.0},
            {"clip_range": (4 / RATE, 13 / RATE), "start": 6 / RATE},
        )
    ],
    "reversed": [
        (1, {"use_reverse": True, "frame_start": 2.0}, {"reverse": True, "start": 2 / RATE})
    ],
    "reversed repeats": [
        (
            1,
            {"use_reverse": True, "scale": 0.8, "repeat": 2.3},
            {"reverse": True, "scale": 0.8, "repeat": 2.3},
        )
    ],
    "blend in and out": [
        (1, {}, {}),
        (
            2,
            {"frame_start": 4.0, "blend_in": 5.0, "blend_out": 7.0},
            {"start": 4 / RATE, "fade_in": 5 / RATE, "fade_out": 7 / RATE},
        ),
    ],
    "holds forward": [
        (
            1,
            {"frame_start": 8.0, "extrapolation": "HOLD_FORWARD"},
            {"start": 8 / RATE, "extend": "hold_forward"},
        )
    ],
    "nothing outside": [
        (
            1,
            {"frame_start": 8.0, "extrapolation": "NOTHING"},
            {"start": 8 / RATE, "extend": "nothing"},
        )
    ],
    "warped": [
        (
            1,
            {"ends": (3.0, 21.0), "time_curve": ([3, 8, 14, 21], [0.0, 17.0, 5.0, 6.5])},
            {"warp": (np.array([3, 8, 14, 21]) / RATE, np.array([0, 17, 5, 6.5]) / RATE)},
        )
    ],
    "muted": [(1, {}, {}), (2, {"mute": True}, {"mute": True})],
    "everything": [
        (1, {"scale": 1.5}, {"scale": 1.5}),
        (
            2,
            {
                "blend_type": "ADD",
                "frame_start": 4.0,
                "scale": 0.5,
                "repeat": 3.0,
                "influence_curve": ([4, 20], [0.8, 0.2]),
            },
            {
                "blend": "additive",
                "start": 4 / RATE,
                "scale": 0.5,
                "repeat": 3,
                "weight": (np.array([4, 20]) / RATE, [0.8, 0.2]),
            },
        ),
        (
            3,
            {
                "frame_start": 10.0,
                "use_reverse": True,
                "blend_in": 3.0,
                "blend_out": 4.0,
                "extrapolation": "NOTHING",
            },
            {
                "start": 10 / RATE,
                "reverse": True,
                "fade_in": 3 / RATE,
                "fade_out": 4 / RATE,
                "extend": "nothing",
            },
        ),
    ],
}
# Seed of a clip -> channels that the action of the NLA strip lacks. The mask of the risorius.Layer
# excludes these channels, too.
LACKS = {2: ("b",), 3: ("a", "d")}


@pytest.mark.parametrize("stack", STACKS)
def test_mixer_equals_nla(stack):
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base = int(RATE), 1.0
    face = new_face()
    layers = []
    for seed, strip_settings, layer_settings in STACKS[stack]:
        whole = clip(seed=seed, high=0.5 if seed == 1 else 0.3)
        kept = [name for name in NAMES if name not in LACKS.get(seed, ())]
        strip_of(face, whole.selected(kept), strip_settings)
        layers.append(Layer(whole, mask={name: 1.0 for name in kept}, **layer_settings))
    mixer = Mixer(NAMES, layers)
    times = [n + part for n in range(-3, 45) for part in (0.0, 0.37)]
    wanted = []
    for time in times:
        scene.frame_set(int(np.floor(time)), subframe=time - np.floor(time))
        now = face.evaluated_get(bpy.context.evaluated_depsgraph_get())
        wanted.append([now[name] for name in NAMES])
    assert np.ptp(wanted, axis=0).max() > 0.05  # Blender has played an animation
    found = mixer.evaluate_batch(np.array(times) / RATE, BASE)
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-6)
