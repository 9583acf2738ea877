# SPDX-License-Identifier: GPL-3.0-or-later
"""Live capture: a program sends faces through this machine's network, and the viewport follows."""

import json
import math
import socket
import sys
from pathlib import Path
from time import monotonic, sleep

import bpy
import limits
import numpy as np
import pytest
import risorius.live
from mathutils import Euler
from support import layout, scene
from support.faces import CONTROLS, HEAD

SENDER = Path(__file__).resolve().parents[2] / "tests" / "python" / "support" / "face_sender.py"
PHONE = "6F0F5B52-8E3C-4E7B-9D42-0123456789AB"
JAW, SMILE_LEFT, BROW_LEFT, YAW = 17, 23, 41, 52  # indices in a packet of Live Link Face
JAW_OPEN = "CTRL_expressions.jawOpen"


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def choose(port):
    chosen = bpy.context.window_manager.risorius_live
    chosen.source, chosen.port = "livelink", port
    chosen.everywhere, chosen.smoothing, chosen.subject = False, 0.0, ""
    return port


@pytest.fixture
def port():
    return choose(free_port())


@pytest.fixture(autouse=True)
def no_recordings_of_other_tests(addon):
    module = scene.submodule("scene.live.recordings")
    for recording in module.waiting():
        module.discard(recording)


def packet(frame, subject="iPhone", rate=60, **places):
    values = [0.0] * 61
    for place, value in places.items():
        values[int(place[1:])] = value
    return ["v6", PHONE, subject, frame, 0.0, rate, 1, values]


def send(port, *steps):
    """Run the program that sends packets to the port, with these steps, and wait for its end."""
    lines = "".join(json.dumps(step) + "\n" for step in steps)
    command = [sys.executable, str(SENDER), str(port)]
    limits.run(command, 60, input=lines).check_returncode()


def session_of(rig):
    return scene.submodule("scene.live.sessions").of(scene.controls(rig))


def tick_until(rig, frames):
    """Wait until this number of frames of the captured person has arrived, then apply the newest.

    The frame is applied by one call of the function that Blender's timer calls.
    """
    module, ends = scene.submodule("scene.live.capture"), monotonic() + 20.0
    session = session_of(rig)
    while True:
        newest = session.receiver.latest(session.subject)
        if newest is not None and newest.sequence >= frames:
            break
        assert monotonic() < ends, session.receiver.status()
        sleep(0.005)
    module._tick()
    bpy.context.view_layer.update()


def raw(**values):
    found = np.zeros(len(CONTROLS), np.float32)
    for end, value in values.items():
        found[next(i for i, name in enumerate(CONTROLS) if name.endswith(end))] = value
    return found


def test_the_viewport_follows(mode, dna_file, port):
    rig = scene.load(dna_file, mode)
    scene.set_controls(rig, browDownL=0.25, eyeLookUpL=0.5)
    before, still = dict(scene.face(rig).items()), scene.snapshot(rig)
    assert bpy.ops.risorius.live_start() == {"FINISHED"}
    send(port, packet(1, _17=0.1), packet(2, _17=0.6, _23=0.4))
    tick_until(rig, 2)
    wanted = raw(jawOpen=0.6, mouthCornerPullL=0.4)
    assert scene.error_against_oracle(rig, dna_file, wanted) < scene.TOLERANCE
    assert np.abs(scene.snapshot(rig) - still).max() > 0.01  # the pose differs from rest
    assert scene.controls(rig).animation_data is None
    assert bpy.ops.risorius.live_stop() == {"FINISHED"}
    bpy.context.view_layer.update()
    assert dict(scene.face(rig).items()) == before
    assert np.allclose(scene.snapshot(rig), still, atol=1e-6)


def test_only_new_faces_are_written(dna_file, port):
    rig = scene.load(dna_file)
    bpy.ops.risorius.live_start()
    send(port, packet(1, _17=0.5))
    tick_until(rig, 1)
    scene.face(rig)[JAW_OPEN] = 0.75  # set by the user, while the phone sends nothing
    module = scene.submodule("scene.live.capture")
    assert module._tick() == module.INTERVAL
    assert scene.face(rig)[JAW_OPEN] == 0.75
    assert module.show(session_of(rig), scene.controls(rig)) is False


def test_the_head_turns(dna_file, port):
    rig = scene.load(dna_file, "LIVE")
    bone = scene.controls(rig).pose.bones["head"]
    bone.rotation_mode = "XYZ"
    bone.rotation_euler = (0.1, 0.2, 0.3)
    bpy.ops.risorius.live_start()
    send(port, packet(1, _52=-0.4, _53=-0.3))  # to the face's left and up, with the app's signs
    tick_until(rig, 1)
    head = next(b for b in rig.pose.bones if b.bone["dna_joint"] == HEAD)
    turn = head.matrix.to_3x3() @ head.bone.matrix_local.to_3x3().inverted()
    ahead = np.array(turn)[:, 1] * -1.0  # the face looks along -y, its left is +x
    up = math.sin(0.3)
    wanted = [math.sin(0.4) * math.cos(0.3), -math.cos(0.4) * math.cos(0.3), up]
    assert np.allclose(ahead, wanted, atol=1e-5)
    turned = tuple(bone.rotation_euler)
    bpy.context.window_manager.risorius_live.head_gain = 0.0
    send(port, packet(2, _52=0.8))
    tick_until(rig, 2)
    assert tuple(bone.rotation_euler) == turned  # after that it is not changed
    bpy.ops.risorius.live_stop()
    assert tuple(bone.rotation_euler) == pytest.approx((0.1, 0.2, 0.3))


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("XYZ", "QUATERNION"),
        ("XYZ", "AXIS_ANGLE"),
        ("XYZ", "ZXY"),
        ("QUATERNION", "AXIS_ANGLE"),
        ("QUATERNION", "XYZ"),
        ("AXIS_ANGLE", "QUATERNION"),
        ("AXIS_ANGLE", "AXIS_ANGLE"),
    ],
)
def test_the_head_comes_back_when_its_rotation_mode_was_changed(dna_file, port, before, after):
    rig = scene.load(dna_file)
    bone = scene.controls(rig).pose.bones["head"]
    turn = Euler((0.5, -0.4, 0.3), "XYZ").to_quaternion()
    bone.rotation_mode = before
    axis, angle = turn.to_axis_angle()
    bone.rotation_quaternion, bone.rotation_axis_angle = turn, (angle, *axis)
    bone.rotation_euler = (0.5, -0.4, 0.3)
    bpy.context.view_layer.update()
    still = bone.matrix.copy()
    bpy.ops.risorius.live_start()
    send(port, packet(1, _52=-0.6, _53=0.3))
    tick_until(rig, 1)
    assert not np.allclose(bone.matrix, still, atol=0.1)
    bone.rotation_mode = after
    bpy.ops.risorius.live_stop()
    bpy.context.view_layer.update()
    assert bone.rotation_mode == after
    assert np.allclose(bone.matrix, still, atol=1e-5)


def test_a_recording_is_an_action(dna_file, port):
    rig = scene.load(dna_file)
    bpy.context.scene.render.fps = 24
    bpy.context.scene.frame_set(11)
    scene.set_controls(rig, jawOpen=0.9)
    bpy.ops.risorius.live_start()
    assert bpy.ops.risorius.live_record() == {"FINISHED"}
    numbers = [0, 1, 2, 3, 9, 10]  # the phone sends nothing for a while
    faces = [packet(600 + n, _17=n / 16.0, _41=0.5, _52=-0.02 * n) for n in numbers]
    send(port, *faces)
    tick_until(rig, len(numbers))
    live_value = scene.face(rig)[JAW_OPEN]
    assert bpy.ops.risorius.live_stop() == {"FINISHED"}
    assert live_value == pytest.approx(10 / 16.0)
    bpy.context.view_layer.update()
    seen = scene.controls(rig).evaluated_get(bpy.context.evaluated_depsgraph_get())
    assert seen.pose.bones["face"][JAW_OPEN] == 0.0  # the recording's first, not the 0.9 of before
    curves = {c.data_path: c for c in scene.curves(scene.controls(rig)) if c.array_index == 0}
    jaw = curves[f'pose.bones["face"]["{JAW_OPEN}"]']
    keys = np.array([tuple(k.co) for k in jaw.keyframe_points])
    assert np.allclose(keys[:, 0], [11 + n / 60 * 24 for n in numbers], atol=1e-4)
    assert np.allclose(keys[:, 1], [n / 16.0 for n in numbers], atol=1e-7)
    # The faces were received between whole frames of the scene. At whole frames the action gives
    # interpolated values.
    for frame in (11, 13, 15):
        bpy.context.scene.frame_set(frame)
        at = np.interp((frame - 11) / 24 * 60, numbers, np.array(numbers) / 16.0)
        wanted = raw(jawOpen=at, browDownL=0.5)
        seen = scene.controls(rig).evaluated_get(bpy.context.evaluated_depsgraph_get())
        assert seen.pose.bones["face"][JAW_OPEN] == pytest.approx(at, abs=1e-5)
        assert seen.pose.bones["head"].matrix_basis.to_quaternion().angle > 0 or frame == 11
        assert wanted[3] == pytest.approx(scene.face(rig)["CTRL_expressions.browDownL"])


def test_keys_do_not_hold_the_face_and_come_back(dna_file, port):
    rig = scene.load(dna_file)
    bone = scene.face(rig)
    for frame, value in ((1, 0.2), (21, 0.4)):
        bone[JAW_OPEN] = value
        bone.keyframe_insert(f'["{JAW_OPEN}"]', frame=frame)
    bpy.context.scene.frame_set(11)
    bpy.ops.risorius.live_start()
    send(port, packet(1, _17=0.875))
    tick_until(rig, 1)
    assert scene.error_against_oracle(rig, dna_file, raw(jawOpen=0.875)) < scene.TOLERANCE
    action = scene.controls(rig).animation_data.action
    assert [len(c.keyframe_points) for c in scene.curves(scene.controls(rig))] == [2]
    bpy.ops.risorius.live_stop()
    bpy.context.view_layer.update()
    assert scene.controls(rig).animation_data.action == action
    assert scene.error_against_oracle(rig, dna_file, raw(jawOpen=0.3)) < scene.TOLERANCE


def test_two_faces_follow_two_phones_on_one_port(dna_file, port):
    rigs = [scene.load(dna_file), scene.load(dna_file)]
    chosen = bpy.context.window_manager.risorius_live
    for rig, name in zip(rigs, ("Ada", "Bob"), strict=True):
        bpy.context.view_layer.objects.active = scene.controls(rig)
        chosen.subject = name
        assert bpy.ops.risorius.live_start() == {"FINISHED"}
    assert session_of(rigs[0]).receiver._reserved == {"Ada", "Bob"}  # no flood takes their places
    send(port, packet(1, "Ada", _17=0.25), packet(7, "Bob", _17=0.5), packet(2, "Ada", _17=0.75))
    tick_until(rigs[0], 2)
    tick_until(rigs[1], 1)
    assert [scene.face(rig)[JAW_OPEN] for rig in rigs] == [0.75, 0.5]
    assert session_of(rigs[0]).receiver is session_of(rigs[1]).receiver
    bpy.context.view_layer.objects.active = scene.controls(rigs[0])
    bpy.ops.risorius.live_stop()
    assert session_of(rigs[1]).receiver.status().subjects == ("Ada", "Bob")
    assert session_of(rigs[1]).receiver._reserved == {"Bob"}


def test_vmc_and_neutral_now(dna_file, port):
    from pythonosc.osc_message_builder import OscMessageBuilder  # must be there: no skipping

    chosen = bpy.context.window_manager.risorius_live
    chosen.source = "osc"
    assert chosen.port == 39539
    chosen.port = port
    rig = scene.load(dna_file)
    assert bpy.ops.risorius.live_start() == {"FINISHED"}
    with pytest.raises(RuntimeError, match="No face was received yet"):
        bpy.ops.risorius.live_neutral()
    steps = []
    for address, *arguments in (
        ("/VMC/Ext/Blend/Val", "JawOpen", 0.2),
        ("/VMC/Ext/Blend/Apply",),
        ("/VMC/Ext/Blend/Val", "JawOpen", 0.6),
        ("/VMC/Ext/Blend/Apply",),
    ):
        message = OscMessageBuilder(address)
        for argument in arguments:
            message.add_arg(argument)
        steps.append(["hex", message.build().dgram.hex()])
    send(port, *steps[:2])
    tick_until(rig, 1)
    assert scene.face(rig)[JAW_OPEN] == pytest.approx(0.2)
    assert bpy.ops.risorius.live_neutral() == {"FINISHED"}
    tick_until(rig, 1)
    assert scene.face(rig)[JAW_OPEN] == 0.0
    send(port, *steps[2:])
    tick_until(rig, 2)
    assert scene.face(rig)[JAW_OPEN] == pytest.approx(0.4 / 0.8)
    bpy.ops.risorius.live_neutral(forget=True)
    tick_until(rig, 2)
    assert scene.face(rig)[JAW_OPEN] == pytest.approx(0.6)


def listens(port):
    """Whether a program uses this UDP port of the computer."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("127.0.0.1", port))
        except OSError:
            return True
    return False


def test_it_ends_with_the_face_the_file_and_the_addon(dna_file, port, tmp_path):
    module = scene.submodule("scene.live.capture")
    rig = scene.load(dna_file)
    bpy.ops.risorius.live_start()
    assert listens(port)
    name = scene.controls(rig).name
    for item in scene.submodule("scene.base.parts").members_of(rig):
        bpy.data.objects.remove(item)
    scene.controls(scene.load(dna_file)).name = name  # another face with the same name
    assert module._tick() is None
    assert not listens(port)
    assert "went away" in module.last_error()

    rig = scene.load(dna_file)
    bpy.ops.risorius.live_start()
    send(port, packet(1, _17=0.5))
    tick_until(rig, 1)
    path = tmp_path / "saved.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    assert listens(port)
    send(port, packet(2, _17=0.625))
    tick_until(rig, 2)
    assert scene.face(rig)[JAW_OPEN] == 0.625  # saving does not end the capture
    bpy.ops.wm.open_mainfile(filepath=str(path))
    assert not listens(port)
    rig = next(o for o in bpy.data.objects if "risorius_controls" in o)
    assert scene.face(rig)[JAW_OPEN] == 0.0  # the file contains the face without the capture

    choose(port)  # settings belong to the window, which the file replaces
    bpy.ops.risorius.live_start()
    assert listens(port)
    module.unregister()
    assert not listens(port)
    assert not bpy.app.timers.is_registered(module._tick)
    module.register()


def sliders(rig):
    return dict(scene.face(rig).items())


def begin_recording(rig, *steps):
    """Start a live capture and a recording, and send these packets to it."""
    assert bpy.ops.risorius.live_start() == {"FINISHED"}
    assert bpy.ops.risorius.live_record() == {"FINISHED"}
    send(bpy.context.window_manager.risorius_live.port, *steps)
    tick_until(rig, len(steps))


def jaw_keys(rig):
    """Frame and value of each key of the jaw, float64[keys, 2]."""
    path = f'pose.bones["face"]["{JAW_OPEN}"]'
    curve = next(c for c in scene.curves(scene.controls(rig)) if c.data_path == path)
    return np.array([tuple(k.co) for k in curve.keyframe_points])


def only_recording(faces):
    """The only waiting recording, which must have this number of captured frames."""
    (recording,) = scene.submodule("scene.live.recordings").waiting()
    assert len(recording.take) == faces
    return recording


def test_an_error_ends_it_and_is_shown(dna_file, port, monkeypatch):
    module = scene.submodule("scene.live.capture")
    rig = scene.load(dna_file)
    scene.set_controls(rig, jawOpen=0.25)
    before = sliders(rig)
    begin_recording(rig, packet(1, _17=0.5), packet(2, _17=0.75))
    assert sliders(rig) != before
    with monkeypatch.context() as broken:
        broken.setattr(module, "show", lambda *_arguments: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            module._tick()
    assert not listens(port)
    assert "the console shows" in drawn()
    assert sliders(rig) == before
    only_recording(2)
    assert "2 faces wait" in drawn()
    assert bpy.ops.risorius.live_finish() == {"FINISHED"}
    assert jaw_keys(rig)[:, 1].tolist() == [0.5, 0.75]
    assert not scene.submodule("scene.live.recordings").waiting()
    assert not bpy.ops.risorius.live_finish.poll()


def test_a_recording_that_cannot_be_finished_waits(dna_file, port):
    rig = scene.load(dna_file)
    bone = scene.face(rig)
    for frame, value in ((1, 0.0), (50, 0.5)):
        bone[JAW_OPEN] = value
        bone.keyframe_insert(f'["{JAW_OPEN}"]', frame=frame)
    data = scene.controls(rig).animation_data
    track = data.nla_tracks.new()
    track.strips.new("own", 1, data.action)
    data.action = None
    bpy.context.scene.frame_set(5)
    before = sliders(rig)
    begin_recording(rig, packet(1, _17=0.5), packet(4, _17=0.75))
    data.use_tweak_mode = True
    assert data.use_tweak_mode
    with pytest.raises(RuntimeError, match="The recording waits"):
        bpy.ops.risorius.live_stop()
    assert not listens(port)
    assert sliders(rig) == before
    data.use_tweak_mode = False
    only_recording(2)
    bpy.context.scene.frame_set(9)  # the recording keeps its own frames
    assert bpy.ops.risorius.live_finish() == {"FINISHED"}
    assert np.allclose(jaw_keys(rig), [(5.0, 0.5), (5.0 + 3 / 60 * 24, 0.75)], atol=1e-4)


def test_a_recording_beyond_the_last_frame_waits(dna_file, port):
    rig = scene.load(dna_file)
    before = sliders(rig)
    bpy.context.scene.frame_set(1_048_570)
    begin_recording(rig, packet(1, _17=0.5), packet(61, _17=0.75))
    with pytest.raises(RuntimeError, match="1048574.*The recording waits"):
        bpy.ops.risorius.live_stop()
    assert sliders(rig) == before
    assert scene.controls(rig).animation_data is None
    only_recording(2)
    with pytest.raises(RuntimeError, match="The recording waits"):
        bpy.ops.risorius.live_finish()
    only_recording(2)
    bpy.context.scene.frame_set(3)
    assert bpy.ops.risorius.live_finish(at_current=True) == {"FINISHED"}
    assert np.allclose(jaw_keys(rig), [(3.0, 0.5), (27.0, 0.75)], atol=1e-4)


def test_the_recording_of_a_face_that_went_away_and_of_a_file_that_was_closed(dna_file, port):
    module = scene.submodule("scene.live.capture")
    rig = scene.load(dna_file)
    begin_recording(rig, packet(1, _17=0.5))
    for item in scene.submodule("scene.base.parts").members_of(rig):
        bpy.data.objects.remove(item)
    assert module._tick() is None
    only_recording(1)
    assert bpy.ops.risorius.live_discard() == {"FINISHED"}
    assert not scene.submodule("scene.live.recordings").waiting()

    rig = scene.load(dna_file)
    begin_recording(rig, packet(1, _17=0.5), packet(2, _17=0.75))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert not listens(port)
    only_recording(2)
    with pytest.raises(RuntimeError, match="There is no recording 1: 1 wait"):
        bpy.ops.risorius.live_discard(index=1)
    rig = scene.load(dna_file)
    assert bpy.ops.risorius.live_finish() == {"FINISHED"}
    assert jaw_keys(rig)[:, 1].tolist() == [0.5, 0.75]


def test_undo_does_not_end_it(dna_file, port):
    rig = scene.load(dna_file)
    bpy.ops.ed.undo_push(message="before")
    bpy.context.scene.frame_end = 77
    bpy.ops.ed.undo_push(message="an edit")
    bpy.ops.risorius.live_start()
    send(port, packet(1, _17=0.5))
    tick_until(rig, 1)
    name = rig.name
    bpy.ops.ed.undo()
    rig = bpy.data.objects[name]
    assert bpy.context.scene.frame_end != 77
    tick_until(rig, 1)
    assert scene.face(rig)[JAW_OPEN] == 0.5
    assert scene.error_against_oracle(rig, dna_file, raw(jawOpen=0.5)) < scene.TOLERANCE


def drawn():
    """The texts that the panel Live Capture draws now, joined by " | "."""
    return layout.drawn(scene.submodule("ui.live.panel").RISORIUS_PT_live).text(" | ")


def test_the_panel_says_what_comes(dna_file, port):
    rig = scene.load(dna_file)
    drawn()
    bpy.ops.risorius.live_start()
    assert f"Port {port}: nothing heard yet" in drawn()
    bpy.ops.risorius.live_record()
    steps = [packet(1, _17=0.5), ["hex", "09"], packet(2, "Bob"), packet(2, _17=0.5), packet(1)]
    send(port, *steps)
    tick_until(rig, 2)
    words, ends = drawn(), monotonic() + 10.0
    while "Late" not in words and monotonic() < ends:
        sleep(0.01)
        words = drawn()
    for part in ("iPhone: 2 a second", "ms ago", "Recording: 2 faces", "Late, Left Out: 1", "Bob"):
        assert part in words
    assert "Packets Refused: 1 | packet version 1, 2, 5 or 6 was" in words  # and on, in more lines
    assert bpy.ops.risorius.live_subject(name="Bob") == {"FINISHED"}
    assert "Bob: 1 a second" in drawn()


def test_the_network_is_heard_only_by_choice_and_the_panel_says_where(dna_file):
    rig = scene.load(dna_file)
    chosen = bpy.context.window_manager.risorius_live
    chosen.port = free_port()
    assert not chosen.everywhere
    assert f"Hears this computer only, at | 127.0.0.1, port {chosen.port}." in drawn()
    bpy.ops.risorius.live_start()
    assert session_of(rig).receiver._socket.getsockname()[0] == "127.0.0.1"
    bpy.ops.risorius.live_stop()
    chosen.everywhere = True
    words = drawn().replace(" | ", " ")
    address = risorius.live.own_address() or "this computer's address"
    assert f"In the app: {address}, port {chosen.port}." in words
    bpy.ops.risorius.live_start()
    assert session_of(rig).receiver._socket.getsockname()[0] == "0.0.0.0"
    bpy.ops.risorius.live_stop()


def test_what_cannot_start_is_one_sentence(dna_file, port):
    scene.load(dna_file)
    with (
        risorius.live.Receiver("livelink", port),
        pytest.raises(RuntimeError, match=f"^Error: Port {port} is in use"),
    ):
        bpy.ops.risorius.live_start()
    assert bpy.ops.risorius.live_start() == {"FINISHED"}
    bpy.ops.risorius.live_stop()
    bpy.context.window_manager.risorius_live.mapping = str(dna_file.with_name("absent.toml"))
    with pytest.raises(RuntimeError, match="^Error: .*absent.toml: cannot read it"):
        bpy.ops.risorius.live_start()
    bpy.context.window_manager.risorius_live.mapping = ""
    assert bpy.ops.risorius.live_start() == {"FINISHED"}
    for operator in ("live_neutral", "live_record", "live_stop"):
        assert getattr(bpy.ops.risorius, operator).poll()
    bpy.ops.risorius.live_stop()
    assert not bpy.ops.risorius.live_stop.poll()
