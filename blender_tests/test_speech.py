# SPDX-License-Identifier: GPL-3.0-or-later
"""A voice's keys: as few as its curves need, and every one where it was asked for."""

import bpy
import numpy as np
import pytest
from risorius import speech
from risorius.speech.audio import RATE
from risorius.speech.phones import Phoneme
from support import scene

JAW = "CTRL_expressions.jawOpen"
SAID = "SIL HH.hello AH L OW SIL B.bob AA B SIL W.why AY SIL".split()
LENGTH = 0.1  # seconds of each sound


def heard():
    """What a voice of 1.3 s says: two words, rest, one more."""
    phones = []
    for i, said in enumerate(SAID):
        name, _, word = said.partition(".")
        phones.append(Phoneme(i * LENGTH, (i + 1) * LENGTH, name, word=word))
    time = np.arange(int(len(SAID) * LENGTH * RATE)) / RATE
    loud = 0.3 * np.sin(2 * np.pi * 150 * time) * (0.6 + 0.4 * np.sin(9 * time))
    return speech.Heard(phones, loud.astype(np.float32), True, [])


@pytest.fixture
def rig(dna_file, monkeypatch):
    """A face in a scene of 24 frames a second, and a recogniser that always hears the same."""

    class Task:
        error = None

        def __init__(self, path, transcript, *, rate, seed, intensity, blinks, accents):
            self.result = speech.animate(
                heard(), rate=rate, seed=seed, intensity=intensity, blinks=blinks, accents=accents
            )

        def run(self):
            pass

    listening = scene.submodule("scene.animation.speech_task")
    monkeypatch.setattr(listening, "has_recogniser", lambda: True)
    monkeypatch.setattr(listening, "SpeechTask", Task)
    face = scene.load(dna_file, "LIVE")
    bpy.context.scene.render.fps = 24
    return face


def speak(**options):
    """The action of the voice, spoken from frame 11 on."""
    options = {"target": "ACTION", "start": 11.0, "use_sound": False, **options}
    assert bpy.ops.risorius.speak(filepath="bob.wav", **options) == {"FINISHED"}
    return bpy.context.object.animation_data.action


def curves(action):
    found = scene.submodule("scene.base.compat").curves_of(action)
    return {(c.data_path, c.array_index): c for c in found}


def test_a_voice_has_as_few_keys_as_its_curves_need(rig):
    every = curves(speak(use_every_frame=True))
    frames = np.arange(11, 11 + 40)
    wanted = {path: [c.evaluate(f) for f in frames] for path, c in every.items()}
    count = sum(len(c.keyframe_points) for c in every.values())
    straight = {k.interpolation for c in every.values() for k in c.keyframe_points}
    assert straight == {"LINEAR"}
    few = curves(speak())
    assert few.keys() == every.keys()
    for path, curve in few.items():
        tolerance = 0.005 if "CTRL_" in path[0] else 0.0005
        found = [curve.evaluate(frame) for frame in frames]
        assert np.abs(np.subtract(found, wanted[path])).max() <= tolerance, path
        assert all(k.co.x == round(k.co.x) for k in curve.keyframe_points)
    assert count > 3.5 * sum(len(c.keyframe_points) for c in few.values())
    coarse = curves(speak(tolerance=0.02))
    assert sum(len(c.keyframe_points) for c in coarse.values()) < 0.85 * sum(
        len(c.keyframe_points) for c in few.values()
    )


def test_a_layer_shows_the_voice_at_every_frame(rig):
    """What mixes, exports and bakes reads curves with handles as it reads straight lines."""
    wanted = speech.animate(heard(), rate=24.0).curve(JAW)
    bpy.ops.risorius.speak(filepath="bob.wav", target="LAYER", start=11.0, use_sound=False)
    (layer,) = scene.controls(rig).risorius_layers
    layer.fade_in = layer.fade_out = 0.0
    present = scene.submodule("scene.why.present")
    for frame in (14, 19, 23, 30, 37):
        bpy.context.scene.frame_set(frame)
        now = present.of(rig)
        jaw = now.raw[now.live.labels.index(JAW)]
        assert jaw == pytest.approx(wanted[frame - 11], abs=0.006)
