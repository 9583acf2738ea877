# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests that clips are imported as actions, strips or layers, and exported again, at any rate."""

import hashlib
import importlib.util
import os
import shutil
import subprocess
import sys
import wave
import zipfile
from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
import risorius
from mathutils import Euler, Vector
from risorius import speech
from support import scene
from support.layout import Recorder, drawn

JAW, PULL, BROW = (f"CTRL_expressions.{n}" for n in ("jawOpen", "mouthCornerPullL", "browDownL"))


@pytest.fixture
def rig(dna_file):
    return scene.load(dna_file, "LIVE")


def _clip(**changes):
    """A clip from 2 s to 2.5 s at 60 fps: a moving jaw, a constant brow, an unknown curve.

    `changes` replaces `rate` and `start`.
    """
    count = 31
    jaw = 0.5 - 0.5 * np.cos(np.arange(count) / 5)
    curves = [jaw, np.full(count, 0.25), np.linspace(0, 1, count)]
    given = {"rate": 60.0, "start": 2.0, **changes}
    return risorius.Clip([JAW, BROW, "stranger"], np.array(curves, np.float32), **given)


def _made(rig, clip, start=10.0, keep_clock=False, fps=24, fps_base=1.0):
    clips = scene.submodule("scene.animation.clip_actions")
    render = bpy.context.scene.render
    render.fps, render.fps_base = fps, fps_base
    timing = clips.timing_of(clip, bpy.context.scene, start, keep_clock)
    return clips.make_action(rig, clip, timing, "Take 1")


def _curves(action):
    return list(scene.submodule("scene.base.compat").curves_of(action))


def _table(tmp_path):
    path = tmp_path / "take.csv"
    path.write_text(f"time,{JAW}\n0,0\n1,1\n")
    return str(path)


def test_what_an_import_leaves_as_it_was_is_named_and_can_be_brought_to_rest(rig, tmp_path, capfd):
    """Controls that an imported action does not move are reported, and `use_rest` resets them.

    An import as a layer reports nothing, because a layer does not change such controls.
    """

    def bring(**options):
        scene.set_controls(rig, browDownL=0.38, mouthCornerPullL=0.2, jawOpen=0.6)
        capfd.readouterr()
        assert bpy.ops.risorius.import_animation(filepath=_table(tmp_path), **options) == {
            "FINISHED"
        }
        return capfd.readouterr().out

    said = "It leaves these controls as they were: mouthCornerPullL 0.20, browDownL 0.38."
    assert "leaves these" not in bring(target="LAYER")
    assert said in bring()
    report = Recorder()
    panel = scene.submodule("ui.animation.panel").RISORIUS_PT_animation
    panel.draw(type("Panel", (), {"layout": report})(), bpy.context)
    assert said in report.text()
    assert "risorius.rest_others" in report.operators
    assert bpy.ops.risorius.rest_others() == {"FINISHED"}
    assert [scene.face(rig)[n] for n in (BROW, PULL)] == [0.0, 0.0]
    assert bpy.ops.risorius.rest_others() == {"CANCELLED"}
    scene.controls(rig).animation_data.action = None
    assert "2 controls were brought to rest." in bring(target="STRIP", use_rest=True)
    assert [scene.face(rig)[n] for n in (BROW, PULL)] == [0.0, 0.0]


@pytest.mark.parametrize(("fps", "base"), [(24, 1.0), (30, 1.001), (60, 1.0), (25, 1.0)])
def test_keys_lie_at_their_seconds(rig, fps, base):
    clip = _clip()
    report = _made(rig, clip, fps=fps, fps_base=base)
    jaw = next(c for c in _curves(report.action) if "jawOpen" in c.data_path)
    frames = np.array([k.co[0] for k in jaw.keyframe_points])
    wanted = 10.0 + np.arange(31) / 60.0 * fps / base
    np.testing.assert_allclose(frames, wanted, atol=1e-5)
    values = np.array([k.co[1] for k in jaw.keyframe_points], np.float32)
    np.testing.assert_array_equal(values, clip.curve(JAW))
    assert {k.interpolation for k in jaw.keyframe_points} == {"LINEAR"}
    assert report.first == 10.0
    assert report.last == pytest.approx(wanted[-1])


def test_constant_curves_get_one_key_and_strangers_are_named(rig):
    report = _made(rig, _clip())
    keys = {c.data_path: len(c.keyframe_points) for c in _curves(report.action)}
    assert keys == {f'pose.bones["face"]["{JAW}"]': 31, f'pose.bones["face"]["{BROW}"]': 1}
    assert report.unknown == ["stranger"]
    assert report.curves == 2


def test_the_clips_own_clock_can_be_kept(rig):
    report = _made(rig, _clip(), start=1.0, keep_clock=True)
    assert report.first == pytest.approx(1.0 + 2.0 * 24)


def test_samples_that_are_no_numbers_are_left_out(rig):
    clip = _clip()
    curves = clip.curves.copy()
    curves[0, 3:6] = np.nan
    report = _made(rig, clip.replaced(curves=curves))
    jaw = next(c for c in _curves(report.action) if "jawOpen" in c.data_path)
    assert len(jaw.keyframe_points) == 28
    assert "3 samples" in report.notes[0]


def test_a_clip_for_another_thing_is_refused(rig):
    logic = scene.submodule("logic.animation.clip_units")
    clip = _clip().selected(["stranger"])
    with pytest.raises(logic.ClipError, match="none of its 1 curves"):
        _made(rig, clip)
    with pytest.raises(logic.ClipError, match="beyond what Blender can play"):
        _made(rig, _clip(start=1e6), keep_clock=True)
    assert not bpy.data.actions


def test_a_minute_of_a_whole_face_has_all_its_keys(tmp_path):
    """A clip with random values of eight controls at 3600 frames gives 3600 keys for each."""
    from support.faces import CONTROLS, small_face

    random = np.random.default_rng(3)
    rig = scene.load(_saved(small_face(), tmp_path))
    clip = risorius.Clip([n for n in CONTROLS[:8]], random.random((8, 3600), np.float32))
    report = _made(rig, clip)
    assert [len(c.keyframe_points) for c in _curves(report.action)] == [3600] * 8


def _saved(dna, tmp_path):
    path = tmp_path / "face.dna"
    dna.save(str(path))
    return path


def _back(rig, action, frames):
    clips, live = (
        scene.submodule("scene.animation.clip_actions"),
        scene.submodule("scene.character.runtime").of(rig),
    )
    clip = clips.clip_of_action(scene.controls(rig), live, action, frames, 24.0)
    return clip.replaced(names=clips.dna_names(live, clip.names))


def _played(rig, frame):
    bpy.context.scene.frame_set(int(frame), subframe=float(frame % 1))
    seen = scene.controls(rig).evaluated_get(bpy.context.evaluated_depsgraph_get())
    return seen.pose.bones["face"]


def test_it_plays_as_the_active_action(rig):
    clips = scene.submodule("scene.animation.clip_actions")
    clip = _clip()
    first = _made(rig, clip).action
    assert clips.play(rig, first) is None
    for frame in (10.0, 14.0, 17.0):
        wanted = clip.sample(2.0 + (frame - 10.0) / 24)[0]
        assert _played(rig, frame)[JAW] == pytest.approx(wanted[0], abs=1e-6)
        assert _played(rig, frame)[BROW] == pytest.approx(0.25)
    second = _made(rig, clip).action
    assert clips.play(rig, second) == first
    assert first.use_fake_user


def test_it_plays_as_a_strip_where_its_keys_are(rig):
    clips = scene.submodule("scene.animation.clip_actions")
    clip = _clip()
    strip = clips.add_strip(rig, _made(rig, clip, start=10.4).action)
    assert strip.frame_start == pytest.approx(10.4)
    for frame in (11.0, 13.5, 20.0):
        wanted = clip.sample(2.0 + (frame - 10.4) / 24)[0, 0]
        assert _played(rig, frame)[JAW] == pytest.approx(wanted, abs=2e-6)
    assert _played(rig, 60)[JAW] == pytest.approx(clip.curve(JAW)[-1])  # held after the last key


@pytest.mark.parametrize("rotation_mode", ["QUATERNION", "XYZ", "ZYX", "AXIS_ANGLE"])
def test_the_head_turns_as_the_clip_says(rig, rotation_mode):
    clips, place = (
        scene.submodule("scene.animation.clip_actions"),
        scene.submodule("scene.character.rig_placement"),
    )
    controls = scene.controls(rig)
    controls.pose.bones["head"].rotation_mode = rotation_mode
    yaw, pitch, roll = np.linspace(0, 0.9, 25), np.linspace(0, 0.4, 25), np.linspace(0, -0.5, 25)
    clip = risorius.Clip(["head.yaw", "head.pitch", "head.roll"], [yaw, pitch, roll], 24.0)
    clips.play(rig, _made(rig, clip, start=0.0).action)
    _played(rig, 12)
    seen = controls.evaluated_get(bpy.context.evaluated_depsgraph_get())
    turn = place.own_turn(seen, seen.pose.bones["head"])
    # The expected rotation at frame 12 by an independent formula: roll about y, then pitch about x,
    # then yaw about z, in Blender's axes.
    wanted = Euler((-0.2, -0.25, 0.45), "YXZ").to_quaternion()
    assert turn.rotation_difference(wanted).angle < 1e-3  # in the bone's interpolation
    nose, crown = turn @ Vector((0, -1, 0)), turn @ Vector((0, 0, 1))
    assert nose.x > 0.3  # to the face's left
    assert nose.z > 0.1  # up
    assert crown.x < 0.3


@pytest.mark.parametrize("rotation_mode", ["QUATERNION", "XYZ", "AXIS_ANGLE"])
def test_an_action_comes_back_as_the_clip_it_was(rig, rotation_mode):
    scene.controls(rig).pose.bones["head"].rotation_mode = rotation_mode
    angles = np.random.default_rng(5).uniform(-0.7, 0.7, (3, 13)).astype(np.float32)
    sliders = np.random.default_rng(6).random((2, 13), np.float32)
    names = [JAW, PULL, "head.yaw", "head.pitch", "head.roll"]
    clip = risorius.Clip(names, np.concatenate([sliders, angles]), 24.0)
    action = _made(rig, clip, start=0.0).action
    back = _back(rig, action, np.arange(13.0))
    assert back.names == clip.names
    np.testing.assert_allclose(back.curves[:2], clip.curves[:2], atol=1e-7)
    np.testing.assert_allclose(back.curves[2:], clip.curves[2:], atol=2e-6)


def test_names_that_are_cut_or_stand_twice_find_their_sliders(rig):
    long = "CTRL_expressions." + "x" * 90
    clip = risorius.Clip([long, "twice", "twice.001"], [[0.5], [0.25], [0.75]])
    report = _made(rig, clip)
    assert not report.unknown
    back = _back(rig, report.action, [1.0])
    assert dict(zip(back.names, back.curves[:, 0], strict=True)) == {
        long: 0.5,
        "twice": 0.25,
        "twice.001": 0.75,
    }


SHAPES = ("jawOpen", "mouthSmileLeft", "browDownLeft", "eyeLookUpLeft")
EXPECTED = (JAW, PULL, BROW, "CTRL_expressions.eyeLookUpL")


@pytest.fixture
def capture(tmp_path):
    """A CSV file in the format of Live Link Face, in which row 3 of rows 0 to 39 is missing.

    The file has 30 rows per second, but its timecodes count 60 frames per second.
    """
    names = ["JawOpen", "MouthSmileLeft", "BrowDownLeft", "EyeLookUpLeft", "TongueOut", "HeadYaw"]
    lines = [",".join(["Timecode", "BlendShapeCount", *names, "Surprise"])]
    for row in [0, 1, 2, 4, *range(5, 40)]:
        frame = 56 + row * 2
        stamp = f"12:21:{59 + frame // 60:02d}:{frame % 60:02d}.000".replace("12:21:60", "12:22:00")
        stamp = stamp.replace("12:21:61", "12:22:01")
        values = [row / 100, 0.5, 0.02 * row, 0.25, 0.0, row / 200, 0.7]
        lines.append(",".join([stamp, "61", *(f"{v:.10f}" for v in values)]))
    path = tmp_path / "take 1.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def _import(filepath, **options):
    return bpy.ops.risorius.import_animation(filepath=str(filepath), start=1.0, **options)


def test_a_capture_lands_on_the_face_at_its_timecodes(rig, capture):
    bpy.context.scene.render.fps = 24
    assert _import(capture, rate_mode="TIME") == {"FINISHED"}
    action = scene.controls(rig).animation_data.action
    assert action.name == "take 1"
    jaw = next(c for c in _curves(action) if "jawOpen" in c.data_path)
    frames = [k.co[0] for k in jaw.keyframe_points]
    rows = np.array([0, 1, 2, 4, *range(5, 40)])
    np.testing.assert_allclose(frames, 1 + rows / 30 * 24, atol=1e-4)
    np.testing.assert_allclose([k.co[1] for k in jaw.keyframe_points], rows / 100, atol=1e-6)
    report = action["risorius_report"]
    assert "Surprise" in report
    assert "tongueOut" in report
    _played(rig, 25)
    turn = scene.controls(rig).pose.bones["head"].matrix_basis.to_quaternion()
    assert turn.angle == pytest.approx(30 / 200, abs=1e-3)


@pytest.mark.parametrize(("fps", "fps_base"), [(24, 1.0), (60, 1.001)])
def test_a_capture_lands_on_whole_frames_of_the_scene(rig, capture, fps, fps_base):
    bpy.context.scene.render.fps, bpy.context.scene.render.fps_base = fps, fps_base
    assert _import(capture) == {"FINISHED"}
    action = scene.controls(rig).animation_data.action
    curves = list(_curves(action))
    assert len(curves) == 8  # four sliders, and the head's quaternion
    for curve in curves:
        frames = np.array([k.co[0] for k in curve.keyframe_points])
        assert np.array_equal(frames, np.rint(frames))
        assert (np.diff(frames) > 0).all()
        assert len(frames) <= 2 * 39
    # At whole frames the jaw's F-curve has the values of straight lines between the rows of the
    # CSV file. The F-curve is constant before the first row and after the last row.
    rows = np.array([0, 1, 2, 4, *range(5, 40)])
    jaw = next(c for c in curves if "jawOpen" in c.data_path)
    for frame in range(-1, int(40 / 30 * fps) + 3):
        row = (frame - 1) / fps * fps_base * 30
        wanted = np.interp(row, rows, rows / 100)
        assert jaw.evaluate(frame) == pytest.approx(wanted, abs=1e-5)
    _played(rig, 11)
    turn = scene.controls(rig).pose.bones["head"].matrix_basis.to_quaternion()
    assert turn.angle == pytest.approx(10 / fps * fps_base * 30 / 200, abs=1e-3)


def test_a_long_pause_makes_no_keys(rig, tmp_path):
    path = tmp_path / "pause.csv"
    path.write_text(f"time,{JAW}\n0.01,0.25\n0.5,0.5\n40000.0,0.75\n", encoding="utf-8")
    assert _import(path) == {"FINISHED"}
    (curve,) = _curves(scene.controls(rig).animation_data.action)
    frames = [1, 2, 13, 40000 * 24 + 1]  # each sample gives keys on the frames before and after it
    assert [k.co[0] for k in curve.keyframe_points] == frames
    path.write_text(f"time (s),{JAW}\n0,0.25\n1e12,0.5\n", encoding="utf-8")
    with pytest.raises(RuntimeError, match="beyond what Blender can play"):
        _import(path)


@pytest.mark.parametrize(
    ("choice", "before", "after"),
    [
        ({}, (5, 250), (5, 250)),
        ({}, (5, 20), (5, 51)),
        ({"scene_range": "FIT"}, (5, 250), (18, 51)),
        ({"scene_range": "KEEP"}, (5, 20), (5, 20)),
    ],
)
def test_the_scenes_range_is_extended_fitted_or_kept(rig, capture, choice, before, after):
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = before
    bpy.context.scene.render.fps = 24
    # The capture lasts 39/30 s, which are 31.2 frames at 24 fps. It begins at frame 18.9 and ends
    # at frame 50.1, so the range that contains it is 18 to 51.
    done = bpy.ops.risorius.import_animation(filepath=str(capture), start=18.9, **choice)
    assert done == {"FINISHED"}
    assert (bpy.context.scene.frame_start, bpy.context.scene.frame_end) == after


def test_a_fault_of_the_program_is_no_sentence_about_the_file(
    rig, capture, monkeypatch, tracebacks
):
    def fail(*_arguments, **_options):
        raise ValueError("operands could not be broadcast")

    importing = scene.submodule("native").part("importing")
    monkeypatch.setattr(importing, "import_file", fail)
    with pytest.raises(RuntimeError, match="Traceback"):
        _import(capture)
    assert [text.splitlines()[-1] for text in tracebacks] == [
        "ValueError: operands could not be broadcast"
    ]
    tracebacks.clear()


def test_options_of_an_import(rig, capture):
    render = bpy.context.scene.render
    assert _import(capture, gain=0.5, gains=f"{JAW}=2", rate_mode="SCENE") == {"FINISHED"}
    assert render.fps / render.fps_base == pytest.approx(30)
    assert _played(rig, 11)[JAW] == pytest.approx(0.10, abs=1e-5)
    assert _played(rig, 11)[PULL] == pytest.approx(0.25, abs=1e-5)
    assert _import(capture, use_neutral=True, rate_mode="FRAMES") == {"FINISHED"}
    assert _played(rig, 11)[PULL] == pytest.approx(0.0, abs=1e-6)
    curve = next(c for c in _curves(bpy.data.actions["take 1.001"]) if "jawOpen" in c.data_path)
    assert all(abs(k.co[0] - round(k.co[0])) < 1e-4 for k in curve.keyframe_points)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"gains": "jaw"}, "name=factor was expected, found jaw"),
        ({"use_neutral": True, "neutral_first": 900}, "frames from 0"),
        ({"mapping": "FILE", "mapping_file": "/nowhere.toml"}, "nowhere.toml"),
    ],
)
def test_what_cannot_be_is_said_in_a_sentence(rig, capture, options, words):
    with pytest.raises(RuntimeError, match=words):
        _import(capture, **options)
    assert not bpy.data.actions


def _last_jaw(rig):
    """Frame and value of the jaw's last key, as a pair that equals others within 0.001."""
    action = scene.controls(rig).animation_data.action
    key = next(c for c in _curves(action) if "jawOpen" in c.data_path).keyframe_points[-1]
    return pytest.approx((key.co[0], key.co[1]), abs=1e-3)


@pytest.mark.parametrize(
    ("text", "sentence", "mends"),
    [
        ("time,jawOpen\n0,0\n500,0.5\n1000,1\n", "Time Unit in Blender", {"time_unit": "MS"}),
        ("time (frames),jawOpen\n0,0\n24,1\n", "File Rate in Blender", {"file_rate": 24.0}),
        (
            "time,jawOpen\n0,0\n0,0.5\n0,1\n",
            r"2 of 3 frames whose time is not after .* rows",
            {"time_unit": "ROWS", "file_rate": 2.0},
        ),
        (
            "Timecode,BlendShapeCount,JawOpen\n01:00:00:05,1,0\n01:00:01:05,1,1\n",
            "Timecode Rate in Blender",
            {"timecode_rate": 24.0},
        ),
        ("time,jawOpen\n0,0\n1,100\n", "Full Value in Blender", {"full_value": 100.0}),
        (
            "time,jawOpen,HeadYaw\n0,0,0\n1,1,45\n",
            "Angles in Blender",
            {"angles": "DEGREES"},
        ),
        ("time,A\n0,0\n1,1\n", "Mapping in Blender", {"mapping": "vrm"}),
    ],
    ids=["unit", "frames", "clock", "timecode", "per cent", "degrees", "letters"],
)
def test_a_capture_of_another_scale_is_asked_about_and_an_option_mends_it(
    rig, tmp_path, text, sentence, mends
):
    bpy.context.scene.render.fps = 24
    path = tmp_path / "odd.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(RuntimeError, match=sentence):
        _import(path)
    assert not bpy.data.actions
    assert _import(path, **mends) == {"FINISHED"}
    assert _last_jaw(rig) == (25.0, 0.6 if "mapping" in mends else 1.0)


def test_a_file_of_another_kind_is_called_by_its_kind(rig, tmp_path):
    pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n"
    for name, text, words in (
        ("take.csv", "<!DOCTYPE html><html></html>", "this is a web page: download the file"),
        ("body.txt", "HIERARCHY\nROOT Hips\n", "this is motion of a body"),
        ("face.dna", pointer, "it is a pointer of Git LFS"),
    ):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        bring = bpy.ops.risorius.import_dna if path.suffix == ".dna" else _import
        with pytest.raises(RuntimeError, match=words):
            bring(filepath=str(path))
    assert not bpy.data.actions


@pytest.mark.parametrize("name", ["voice.wav", "voice.csv", "voice.MP3"])
def test_a_sound_is_sent_to_where_sounds_are_taken(rig, tmp_path, name):
    path = tmp_path / name
    with wave.open(str(path), "wb") as sound:
        sound.setparams((1, 2, 16000, 0, "NONE", ""))
        sound.writeframes(b"\x86\x00" * 100)
    with pytest.raises(RuntimeError, match=rf"{name}: this is a sound: use Speak from Audio\."):
        _import(path)
    assert not bpy.data.actions


def test_a_file_that_is_none(rig, tmp_path):
    path = tmp_path / "noise.csv"
    path.write_bytes(b"\xff\x00 not a table")
    with pytest.raises(RuntimeError, match=r"noise\.csv"):
        _import(path)


@pytest.mark.parametrize("target", ["STRIP", "LAYER"])
def test_a_capture_as_a_strip_or_a_layer(rig, capture, target):
    bpy.context.scene.render.fps = 30
    scene.face(rig)[JAW] = 0.9
    scene.controls(rig).risorius_layer_rules = False
    assert _import(capture, target=target) == {"FINISHED"}
    assert scene.controls(rig).animation_data is None or (
        scene.controls(rig).animation_data.action is None
    )
    bpy.context.scene.frame_set(21)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    live = scene.submodule("scene.character.runtime").of(rig)
    seen = scene.controls(rig).evaluated_get(depsgraph)
    raw, turns = scene.submodule("scene.frame.inputs").read_inputs(seen, live, depsgraph)
    assert raw[0] == pytest.approx(0.20, abs=1e-5)
    assert turns["head"].angle == pytest.approx(0.1, abs=1e-5)


def _arkit_rig():
    """A triangle that stands for a rig of another tool.

    Its shape keys with ARKit's names have keyframes; its shape key `hat` has none.
    """
    mesh = bpy.data.meshes.new("Other")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    item = bpy.data.objects.new("Other", mesh)
    bpy.context.scene.collection.objects.link(item)
    for name in ("Basis", *SHAPES, "hat"):
        item.shape_key_add(name=name).value = 0.0
    blocks = mesh.shape_keys.key_blocks
    for frame in (1, 11, 21):
        for number, name in enumerate(SHAPES):
            blocks[name].value = (number + 1) * frame / 100
            blocks[name].keyframe_insert("value", frame=frame)
    blocks["hat"].value = 0.5
    return item


@pytest.mark.parametrize("as_strip", [False, True])
def test_another_rigs_shape_keys_move_the_face(rig, as_strip):
    item = _arkit_rig()
    keys = item.data.shape_keys
    bpy.context.scene.frame_end = 30
    if as_strip:
        data = keys.animation_data
        action, data.action = data.action, None
        strip = data.nla_tracks.new().strips.new("Take", 1, action)
        if hasattr(strip, "action_slot"):
            strip.action_slot = action.slots[0]
        strip.influence, strip.use_animated_influence = 1.0, False
    bpy.context.view_layer.update()
    wanted = {}
    for frame in (1, 6, 15, 21):
        bpy.context.scene.frame_set(frame)
        seen = keys.evaluated_get(bpy.context.evaluated_depsgraph_get())
        wanted[frame] = [seen.key_blocks[name].value for name in SHAPES]
    bpy.context.view_layer.objects.active = scene.controls(rig)
    done = bpy.ops.risorius.import_arkit_rig(source="Other", start=0.0)
    assert done == {"FINISHED"}
    for frame, values in wanted.items():
        found = [_played(rig, frame)[name] for name in EXPECTED]
        np.testing.assert_allclose(found, values, atol=1e-6)
    assert "hat" in scene.controls(rig).animation_data.action["risorius_report"]


WORDS = "Hello, my name is Bob."


@pytest.fixture
def voice(tmp_path):
    """A WAV file in which espeak-ng speaks the sentence WORDS."""
    program = shutil.which("espeak-ng")
    if program is None or importlib.util.find_spec("pocketsphinx") is None:
        pytest.skip("EXTRA NOT RUN: speech needs the program espeak-ng and PocketSphinx")
    path = tmp_path / "voice.wav"
    subprocess.run([program, "-w", str(path), WORDS], check=True)
    return path


def _is_heard_from(frame):
    (strip,) = scene.submodule("scene.base.compat").strips_of(bpy.context.scene)
    assert strip.type == "SOUND"
    assert strip.frame_final_start == frame


def test_a_face_speaks_and_is_heard(rig, voice):
    bpy.context.scene.render.fps = 24
    text = bpy.data.texts.new("Lines")
    text.write(WORDS)
    done = bpy.ops.risorius.speak(
        filepath=str(voice), transcript_text="Lines", start=31.0, target="LAYER"
    )
    assert done == {"FINISHED"}
    if bpy.app.build_options.audaspace:
        _is_heard_from(31)
    layer = scene.controls(rig).risorius_layers[0]
    assert layer.start == pytest.approx(31.0, abs=1e-4)
    clip = speech.speak(str(voice), WORDS, rate=24.0)
    jaw = next(c for c in _curves(layer.action) if "jawOpen" in c.data_path)
    assert all(key.co[0] == round(key.co[0]) for key in jaw.keyframe_points)
    loudest = clip.frame_times()[int(np.argmax(clip.curve(JAW)))]
    assert jaw.evaluate(31.0 + loudest * 24) == pytest.approx(clip.curve(JAW).max(), abs=1e-3)
    assert clip.curve(JAW).max() > 0.1
    _gives_the_face_back(rig, last=round(layer.action.frame_range[1]))


def _gives_the_face_back(rig, last):
    """Check that the face shows the slider values before and after a voice, but not during it.

    Args:
        rig: face with a layer of a voice that starts at frame 31.
        last: last frame of the voice.
    """
    scene.set_controls(rig, mouthCornerPullL=0.6)
    present = scene.submodule("scene.see_why.present")
    shown = {}
    for frame in (5, 31 + 12, last + 20):
        bpy.context.scene.frame_set(frame)
        now = present.of(rig)
        shown[frame] = dict(zip(now.live.labels, now.raw.tolist(), strict=True))
    smile = "CTRL_expressions.mouthCornerPullL"
    for frame in (5, last + 20):
        assert shown[frame][smile] == pytest.approx(0.6)
        assert shown[frame][JAW] == 0.0
    assert shown[43][JAW] != 0.0 or shown[43][smile] != pytest.approx(0.6)


def test_speech_beside_blender_is_the_same_and_can_be_cancelled(rig, voice, tmp_path):
    listening = scene.submodule("scene.animation.speech_task")
    task = listening.SpeechTask(str(voice), WORDS, seed=3)
    task.start()
    task.wait()
    clip = speech.speak(str(voice), WORDS, seed=3)
    assert task.error is None
    np.testing.assert_array_equal(task.result.curves, clip.curves)
    ended = listening.SpeechTask(str(voice), WORDS)
    ended.cancel()
    ended.run()
    assert type(ended.error).__name__ == "CancelledError"
    assert ended.result is None
    # This pipe never delivers data. The process that reads it must still end when the task is
    # cancelled.
    os.mkfifo(tmp_path / "endless.wav")
    stuck = listening.SpeechTask(str(tmp_path / "endless.wav"), WORDS)
    stuck.start()
    assert stuck.is_running()
    stuck.cancel()
    assert not stuck.is_running()
    assert type(stuck.error).__name__ == "CancelledError"


def test_speech_needs_nothing_of_what_this_blender_has_loaded(rig, voice, monkeypatch):
    """If Blender's process cannot load the recogniser, a separate process still recognises speech.

    A possible reason is that Blender's process has loaded another libpocketsphinx.
    """
    monkeypatch.setitem(sys.modules, "pocketsphinx", None)
    monkeypatch.setattr(
        scene.submodule("scene.animation.speech_task"), "has_recogniser", lambda: True
    )
    assert bpy.ops.risorius.speak(filepath=str(voice), transcript=WORDS, use_sound=False) == {
        "FINISHED"
    }
    jaw = next(c for c in scene.curves(scene.controls(rig)) if "jawOpen" in c.data_path)
    assert max(point.co.y for point in jaw.keyframe_points) > 0.1


def test_speech_without_the_recogniser_says_what_to_do(rig, voice, monkeypatch):
    listening = scene.submodule("scene.animation.speech_task")
    monkeypatch.setattr(listening, "has_recogniser", lambda: False)
    with pytest.raises(RuntimeError, match="PocketSphinx: install it by the button"):
        bpy.ops.risorius.speak(filepath=str(voice))


def test_a_missing_recogniser_is_said_before_a_file_is_chosen(rig, monkeypatch):
    listening = scene.submodule("scene.animation.speech_task")
    operators = scene.submodule("ui.speech.operators")
    panel = scene.submodule("ui.animation.panel").RISORIUS_PT_animation
    opened, said = [], []
    monkeypatch.setattr(
        operators.ImportHelper, "invoke", lambda *_: opened.append(1) or {"RUNNING_MODAL"}
    )
    press = SimpleNamespace(
        wait_beside=lambda: None,
        start_with=lambda _scene: None,
        properties=SimpleNamespace(is_property_set=lambda _name: False),
        report=lambda _kind, text: said.append(text),
    )
    for there in (False, True):
        monkeypatch.setattr(listening, "has_recogniser", lambda found=there: found)
        monkeypatch.setitem(listening._looked, "until", 0.0)
        offers = "risorius.install_speech" in drawn(panel).operators
        done = operators.RISORIUS_OT_speak.invoke(press, bpy.context, None)
        assert (done, bool(opened), bool(said)) == (
            ({"RUNNING_MODAL"}, True, True) if there else ({"CANCELLED"}, False, True)
        )
        assert offers is not there
    assert "install it by the button" in said[0]
    assert len(said) == 1


def test_the_preferences_say_in_words_why_the_button_is_grey(monkeypatch):
    listening = scene.submodule("scene.animation.speech_task")
    monkeypatch.setattr(listening, "has_recogniser", lambda: False)
    layout = Recorder()
    scene.submodule("ui.speech.install").draw_preferences(layout)
    assert layout.operators == ["risorius.install_speech"]
    said = "Allow online access" in layout.text()
    assert said == (not bpy.app.online_access)
    if said:
        with pytest.raises(RuntimeError, match="Allow online access first"):
            bpy.ops.risorius.install_speech()


@pytest.fixture
def shelf(tmp_path, monkeypatch):
    """A folder from which pip installs packages during the test, instead of from the network."""
    folder = tmp_path / "shelf"
    folder.mkdir()
    for name in [name for name in os.environ if name.startswith("PIP_")]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("PIP_CONFIG_FILE", os.devnull)
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_FIND_LINKS", str(folder))
    listening = scene.submodule("scene.animation.speech_task")
    monkeypatch.setattr(listening, "packages_folder", lambda: tmp_path / "packages")
    return folder


def put_wheel(shelf):
    """Put an empty package with the name of PocketSphinx into the folder `shelf`.

    Returns the SHA-256 of the package's file.
    """
    info = "pocketsphinx-5.1.1.dist-info"
    path = shelf / "pocketsphinx-5.1.1-py3-none-any.whl"
    with zipfile.ZipFile(path, "w") as wheel:
        wheel.writestr("pocketsphinx/__init__.py", "")
        wheel.writestr(
            f"{info}/METADATA", "Metadata-Version: 2.1\nName: pocketsphinx\nVersion: 5.1.1\n"
        )
        wheel.writestr(
            f"{info}/WHEEL", "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
        )
        wheel.writestr(f"{info}/RECORD", "")
    return hashlib.sha256(path.read_bytes()).hexdigest()


def test_only_the_files_that_are_known_are_installed(shelf, tmp_path, monkeypatch):
    listening = scene.submodule("scene.animation.speech_task")
    version = f"Python {sys.version_info.major}.{sys.version_info.minor}"
    with pytest.raises(RuntimeError, match=f"there is no file of it for {version} on "):
        listening.install_recogniser()
    digest = put_wheel(shelf)
    with pytest.raises(RuntimeError, match="not the file that this add-on knows"):
        listening.install_recogniser()
    assert not (tmp_path / "packages").exists()
    monkeypatch.setattr(scene.submodule("logic.animation.recogniser"), "HASHES", (digest,))
    listening.install_recogniser()
    assert (tmp_path / "packages" / "pocketsphinx" / "__init__.py").exists()


def test_what_was_installed_for_the_add_on_is_found_and_changes_no_search_path(monkeypatch):
    listening = scene.submodule("scene.animation.speech_task")
    folder = listening.packages_folder()
    assert folder.parts[-4:] == (".user", "user_default", "risorius", "packages")
    assert folder.is_dir()
    outside = [place for place in sys.path if not (Path(place) / "pocketsphinx").is_dir()]
    monkeypatch.setattr(sys, "path", outside)
    assert not listening.has_recogniser()
    (folder / "pocketsphinx").mkdir()
    try:
        (folder / "pocketsphinx" / "__init__.py").touch()
        assert listening.has_recogniser()
    finally:
        shutil.rmtree(folder / "pocketsphinx")
    assert sys.path == outside


def test_without_a_network_the_button_says_so(shelf, monkeypatch):
    monkeypatch.delenv("PIP_NO_INDEX")
    monkeypatch.setenv("PIP_INDEX_URL", "http://127.0.0.1:9/simple")  # no server listens there
    with pytest.raises(RuntimeError, match=r"could not be reached \(Connection refused\)"):
        scene.submodule("scene.animation.speech_task").install_recogniser()


def test_a_file_that_is_no_sound(rig, voice, tmp_path):
    noise = tmp_path / "noise.wav"
    noise.write_bytes(b"RIFF nothing of the kind")
    with pytest.raises(RuntimeError, match=r"noise\.wav"):
        bpy.ops.risorius.speak(filepath=str(noise))
    assert not bpy.data.actions


def test_eye_angles_turn_the_eye_bones_when_asked(rig):
    clips = scene.submodule("scene.animation.clip_actions")
    clip = risorius.Clip(["eyeL.yaw", "eyeL.pitch"], [[0.2, 0.2], [0.1, 0.1]], 24.0)
    timing = clips.timing_of(clip, bpy.context.scene, 1.0)
    logic = scene.submodule("logic.animation.clip_units")
    with pytest.raises(logic.ClipError):
        clips.make_action(rig, clip, timing, "Eyes", with_eyes=False)
    clips.play(rig, clips.make_action(rig, clip, timing, "Eyes").action)
    _played(rig, 1)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    live = scene.submodule("scene.character.runtime").of(rig)
    seen = scene.controls(rig).evaluated_get(depsgraph)
    raw = scene.submodule("scene.frame.inputs").read_inputs(seen, live, depsgraph)[0]
    asked = {n: v for n, v in zip(live.labels, raw, strict=True) if v > 1e-4}
    assert set(asked) == {"CTRL_expressions.eyeLookLeftL", "CTRL_expressions.eyeLookUpL"}
    index = live.labels.index("CTRL_expressions.eyeLookLeftL")
    full = next(yaw for control, yaw, _pitch in live.look["L"] if control == index)
    assert asked["CTRL_expressions.eyeLookLeftL"] == pytest.approx(0.2 / full, rel=0.02)


def test_a_clip_of_our_own_comes_back_bit_for_bit(rig, tmp_path):
    clip = _clip(start=0.0)
    path = tmp_path / "take.rzc"
    clip.save(str(path))
    assert _import(path, rate_mode="TIME") == {"FINISHED"}
    action = scene.controls(rig).animation_data.action
    jaw = next(c for c in _curves(action) if "jawOpen" in c.data_path)
    values = np.array([k.co[1] for k in jaw.keyframe_points], np.float32)
    np.testing.assert_array_equal(values, clip.curve(JAW))
    path.write_bytes(path.read_bytes()[:40])
    with pytest.raises(RuntimeError, match=r"take\.rzc"):
        _import(path)


def test_the_other_rig_is_the_selected_one_or_the_only_one(rig):
    bpy.context.view_layer.objects.active = scene.controls(rig)
    assert not bpy.ops.risorius.import_arkit_rig.poll()
    _arkit_rig()
    bpy.context.view_layer.objects.active = scene.controls(rig)
    assert bpy.ops.risorius.import_arkit_rig() == {"FINISHED"}
    other = _arkit_rig()
    for item in bpy.context.selected_objects:
        item.select_set(False)
    bpy.context.view_layer.objects.active = scene.controls(rig)
    with pytest.raises(RuntimeError, match="Select the object whose shape keys are animated"):
        bpy.ops.risorius.import_arkit_rig()
    other.select_set(True)
    assert bpy.ops.risorius.import_arkit_rig() == {"FINISHED"}
    assert scene.controls(rig).animation_data.action.name.startswith("Other.001")
