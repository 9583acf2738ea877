# SPDX-License-Identifier: GPL-3.0-or-later
"""Layers above the sliders: Blender shows what the Mixer computes, and what its own NLA says."""

import bpy
import numpy as np
import pytest
from support import scene

PREFIX = "CTRL_expressions."
JAW, PULL, BROW = (PREFIX + n for n in ("jawOpen", "mouthCornerPullL", "browDownL"))


@pytest.fixture
def rig(dna_file):
    bpy.context.scene.render.fps = 24
    rig = scene.load(dna_file, "LIVE")
    scene.controls(rig).risorius_layer_rules = False
    return rig


def _layers():
    return scene.submodule("scene.layers")


def _action(rig, name="Wave", interpolation="BEZIER", **curves):
    """An action with keys: control -> {frame: value}."""
    controls, bone = scene.controls(rig), scene.face(rig)
    data = controls.animation_data_create()
    before = data.action
    data.action = action = bpy.data.actions.new(name)
    for short, keys in curves.items():
        for frame, value in keys.items():
            bone[PREFIX + short] = value
            bone.keyframe_insert(f'["{PREFIX}{short}"]', frame=frame)
        bone[PREFIX + short] = 0.0
    for curve in scene.curves(controls):
        for key in curve.keyframe_points:
            key.interpolation = interpolation
    data.action = before
    return action


def _wave(rig, **options):
    return _action(
        rig,
        jawOpen={1: 0.0, 7: 0.9, 12: 0.2, 21: 0.6},
        mouthCornerPullL={3: 0.7, 15: 0.1},
        browDownL={1: 0.3, 21: 1.0},
        **options,
    )


def _raw(rig, frame):
    """What the evaluator gets at a frame: float32[controls]."""
    bpy.context.scene.frame_set(int(np.floor(frame)), subframe=float(frame % 1))
    live = scene.submodule("scene.runtime").of(rig)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    seen = scene.controls(rig).evaluated_get(depsgraph)
    return scene.submodule("scene.inputs").read_inputs(seen, live, depsgraph)[0]


def _value(rig, frame, name):
    live = scene.submodule("scene.runtime").of(rig)
    return _raw(rig, frame)[live.labels.index(name)]


def _strip(rig, action, track="Track", **settings):
    """A strip of Blender's own NLA."""
    data = scene.controls(rig).animation_data_create()
    new = data.nla_tracks.new()
    strip = new.strips.new(track, 1, action)
    if hasattr(strip, "action_slot"):
        strip.action_slot = action.slots[0]
    first, last = action.frame_range
    strip.action_frame_start, strip.action_frame_end = first, last
    for name, value in settings.items():
        setattr(strip, name, value)
    return strip


FRAMES = [-3.0, 1.0, 2.0, 5.0, 6.0, 9.0, 12.0, 17.0, 20.0, 27.0, 33.0, 41.0, 60.0]


@pytest.mark.parametrize("interpolation", ["LINEAR", "BEZIER", "CONSTANT"])
@pytest.mark.parametrize(
    ("layer", "strip"),
    [
        ({}, {"blend_type": "REPLACE", "extrapolation": "HOLD"}),
        ({"blend": "ADD"}, {"blend_type": "ADD", "extrapolation": "HOLD"}),
        (
            {"start": 5.0, "scale": 1.5, "extend": "NOTHING"},
            {"frame_start": 5.0, "frame_end": 35.0, "scale": 1.5, "extrapolation": "NOTHING"},
        ),
        (
            {"start": 2.0, "scale": 0.37, "repeat": 4.5, "extend": "HOLD_FORWARD"},
            {"frame_start": 2.0, "scale": 0.37, "repeat": 4.5, "extrapolation": "HOLD_FORWARD"},
        ),
        (
            {"fade_in": 4.0, "fade_out": 7.0, "extend": "NOTHING", "blend": "ADD"},
            {
                "use_auto_blend": False,
                "blend_in": 4.0,
                "blend_out": 7.0,
                "extrapolation": "NOTHING",
                "blend_type": "ADD",
            },
        ),
        ({"weight": 0.4}, {"use_animated_influence": True, "influence": 0.4}),
        ({"reverse": True, "scale": 1.25}, {"use_reverse": True, "scale": 1.25}),
    ],
)
def test_a_layer_is_what_the_nla_makes_of_it(rig, layer, strip, interpolation):
    action = _wave(rig, interpolation=interpolation)
    base = _action(rig, "Base", jawOpen={1: 0.1, 40: 0.8}, browDownL={1: 0.5}, eyeLookUpL={1: 0.25})
    made = _strip(rig, base, "Base", extrapolation="HOLD")
    assert made is not None
    entry = _layers().add_action(scene.controls(rig), action)
    for name, value in layer.items():
        setattr(entry, name, value)
    ours = np.array([_raw(rig, f) for f in FRAMES])
    entry.mute = True
    without = np.array([_raw(rig, f) for f in FRAMES])
    made = _strip(rig, action, **{"extrapolation": "HOLD", **strip})
    if made.use_animated_influence:
        made.influence = layer["weight"]
        made.fcurves[0].keyframe_points.insert(1, layer["weight"])
    theirs = np.array([_raw(rig, f) for f in FRAMES])
    np.testing.assert_allclose(ours, theirs, atol=1e-6)
    assert np.abs(ours - without).max() > 0.1
