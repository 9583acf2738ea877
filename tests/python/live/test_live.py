# SPDX-License-Identifier: MIT
"""Tests live capture with a program that sends packets through this machine's network."""

import json
import math
import os
import signal
import socket
import subprocess
import sys
from collections import deque
from pathlib import Path
from time import monotonic, sleep

import limits
import numpy as np
import pytest
import risorius
from risorius.importing import load_mapping
from risorius.live import Frame, LiveError, Receiver, Shaper, livelink, osc, shaping

PATIENCE = 600.0  # seconds until a packet counts as missing, for busy machines
SENDER = Path(__file__).parents[1] / "support" / "face_sender.py"
PHONE, OTHER = "6F0F5B52-8E3C-4E7B-9D42-0123456789AB", "0AA94E16-1111-4222-8333-BA9876543210"
JAW, SMILE_LEFT, YAW, PITCH, ROLL = 17, 23, 52, 53, 54  # indices in a packet of Live Link Face


def face(count=61, **at):
    values = [0.0] * count
    for place, value in at.items():
        values[int(place[1:])] = value
    return values


def v6(frame, values, subject="iPhone", device=PHONE, sub_frame=0.0, rate=60):
    return ["v6", device, subject, frame, sub_frame, rate, 1, values]


def send(port, *steps):
    """Run the sender program with these steps and wait for its end."""
    lines = "".join(json.dumps(step) + "\n" for step in steps)
    command = [sys.executable, str(SENDER), str(port)]
    limits.run(command, 60, input=lines).check_returncode()


def heard(receiver, packets):
    """Wait until a receiver has got this number of packets. Returns the receiver's status."""
    ends = monotonic() + PATIENCE
    while monotonic() < ends:
        status = receiver.status()
        if status.packets >= packets:
            return status
        sleep(0.005)
    raise AssertionError(f"only {receiver.status().packets} of {packets} packets came")


def record(source, *steps, shaper=None):
    """Receive and record the packets of some steps. Returns the clip and the receiver's status."""
    with Receiver(source, 0) as receiver:
        take = receiver.record()
        send(receiver.port, *steps)
        heard(receiver, sum(step[0] != "wait" for step in steps))
        receiver.stop()  # also completes the face that waits for further messages
        return receiver.finish(take).clip(shaper), receiver.status()


def test_frames_of_live_link_face_arrive_with_their_times():
    frames = [v6(3600 * 60 + 2 * n, face(i17=n / 10.0), sub_frame=0.25) for n in range(8)]
    clip, status = record("livelink", *frames)
    assert np.allclose(clip.times, np.arange(8) / 30.0, atol=1e-9)
    wanted = (np.arange(8) / 10.0).astype(np.float32)
    assert np.array_equal(clip.curve("CTRL_expressions.jawOpen"), wanted)
    assert clip.rate == 30.0
    assert clip.metadata["subject"] == "iPhone"
    assert (status.frames, status.refused, status.lost, status.late) == (8, 0, 0, 0)


def test_every_curve_of_a_packet_has_its_name():
    # Checks the order of values in a packet; the first 52 are ARKit's blend shapes.
    units = risorius.controls.arkit.mapping()
    assert sorted(livelink.NAMES[:52]) == sorted(units)
    assert livelink.NAMES[15:17] == ("jawLeft", "jawRight")
    assert livelink.NAMES[51:54] == ("tongueOut", "head.yaw", "head.pitch")
    assert livelink.NAMES[60] == "eyeR.roll"
    values = [(n + 1) / 100.0 for n in range(61)]
    packet = livelink.decode(packed(v6(1, values)))
    assert np.allclose(packet.values[:52], values[:52])
    # In the app, a positive angle turns the head to its right, nods it down, or tilts it to its
    # left shoulder.
    assert np.allclose(packet.values[52:55], [-0.53, -0.54, 0.55])


def packed(step):
    """The bytes of the packet of a step, made by the sender program's code."""
    sys.path.insert(0, str(SENDER.parent))
    try:
        import face_sender
    finally:
        sys.path.pop(0)
    return face_sender.PACKERS[step[0]](*step[1:])


@pytest.mark.parametrize(
    ("step", "time"),
    [
        (["v1", "iPad", 12.5, 7, face(52, i17=0.5)], 12.5),
        (["v5", PHONE, "iPad", [10, 20, 30, 15], 30, face(51, i17=0.5)], 37230.5),
        (v6(1800, face(i17=0.5), "iPad", rate=30, sub_frame=0.5), 1800.5 / 30),
        (["v6", PHONE, "iPad", 90, 0.0, 30000, 1001, face(i17=0.5)], 90 * 1001 / 30000),
    ],
)
def test_versions_of_the_packet(step, time):
    packet = livelink.decode(packed(step))
    assert packet.subject == "iPad"
    assert packet.time == pytest.approx(time, abs=1e-6)
    assert packet.values[JAW] == 0.5


def test_a_timecode_with_a_byte_for_drop_frame():
    data = packed(["v5", PHONE, "iPad", [1, 0, 0, 1], 60, face(i17=0.5)])
    place = 1 + 4 + len(PHONE) + 4 + len("iPad") + 16
    packet = livelink.decode(data[:place] + b"\x01" + data[place:])
    assert packet.time == pytest.approx(3600 + 1 / 60)
    assert packet.values[JAW] == 0.5


def test_gaps_are_kept_late_packets_left_out_and_losses_counted():
    numbers = [0, 1, 2, 3, 4, 5, 6, 12, 11, 13]  # 7 to 10 are lost, 11 arrives late
    steps = [v6(n, face(i17=n / 100.0)) for n in numbers]
    clip, status = record("livelink", *steps)
    kept = [n for n in numbers if n != 11]
    assert np.allclose(clip.times, np.array(kept) / 60.0, atol=1e-9)
    wanted = np.array(kept, np.float32) / np.float32(100.0)
    assert np.allclose(clip.curve("CTRL_expressions.jawOpen"), wanted)
    assert (status.late, status.lost) == (1, 5)


def test_midnight_and_a_clock_that_is_set():
    day = 24 * 3600 * 60
    steps = [v6(n % day, face()) for n in (day - 2, day - 1, day, day + 1)]
    steps += [v6(500_000 + n, face()) for n in range(3)]
    steps += [v6(100 + n, face()) for n in range(3)]
    clip, status = record("livelink", *steps)
    assert clip.frame_count == 10
    for part in (clip.times[:4], clip.times[4:7], clip.times[7:]):
        assert np.allclose(np.diff(part), 1 / 60, atol=1e-6)
    for leap in (clip.times[4] - clip.times[3], clip.times[7] - clip.times[6]):
        assert 0.0 < leap < 1.0  # with the distance of their arrival
    assert status.late == 0


def test_two_phones_are_told_apart():
    steps = []
    for n in range(5):
        steps.append(v6(n, face(i17=0.1 * n), "Ada"))
        steps.append(v6(1000 + n, face(i17=1.0 - 0.1 * n), "Bob", OTHER))
        steps.append(v6(n, face(i17=0.5), "Ada", OTHER))  # another phone that uses an existing name
    with Receiver("livelink", 0) as receiver:
        takes = [receiver.record("Bob"), receiver.record("Ada")]
        send(receiver.port, *steps)
        status = heard(receiver, len(steps))
        assert status.subjects == ("Ada", "Bob", f"Ada ({OTHER[:8]})")
        bob, ada = (receiver.finish(take).clip() for take in takes)
        jaw = "CTRL_expressions.jawOpen"
        assert np.allclose(ada.curve(jaw), 0.1 * np.arange(5))
        assert np.allclose(bob.curve(jaw), 1.0 - 0.1 * np.arange(5))
        assert receiver.latest("Bob").values[JAW] == np.float32(0.6)
        assert receiver.latest("Cid") is None


def hostile():
    """Packets with invalid content, as bytes."""
    good = packed(v6(1, face(i17=0.5)))
    bad = [good[:n] for n in range(0, len(good), 7)] + [good + b"\0", b"\xff" * 300]
    bad.append(good.replace(b"\0\0\0\x24", b"\xff\xff\xff\xff", 1))
    bad += [packed(v6(1, face(i17=v))) for v in (math.nan, math.inf, -math.inf, 1e30)]
    bad.append(good[: good.rindex(bytes([61]) + b"\0\0")] + bytes([255]) + good[-244:])
    return bad


def test_hostile_packets_are_counted_and_change_nothing():
    junk = hostile()
    steps = [v6(1, face(i17=0.25))]
    steps += [["hex", data.hex()] for data in junk]
    steps += [["none", PHONE, "iPhone"], v6(2, face(i17=0.75))]
    clip, status = record("livelink", *steps)
    assert clip.curve("CTRL_expressions.jawOpen").tolist() == [0.25, 0.75]
    assert (status.frames, status.faceless) == (2, 1 + faceless(junk))
    assert status.refused == len(junk) - faceless(junk)
    assert status.reasons
    assert not any("Error" in reason for reason, _ in status.reasons)  # all faults are foreseen
    with pytest.raises(LiveError, match="subject of 300 bytes"):
        livelink.decode(packed(v6(1, face(), "x" * 300)))


def faceless(junk):
    """The number of truncated packets that equal packets of a phone which sees no face."""
    head = 1 + 4 + len(PHONE) + 4 + len("iPhone")
    return sum(len(data) in (head, head + 16) for data in junk if data[:1] == b"\x06")


def test_a_flood_is_bounded():
    steps = [["hex", "00"]] * 2000 + [["wait", 0.3]] + [v6(n, face(i17=0.5)) for n in range(3)]
    with Receiver("livelink", 0) as receiver:
        send(receiver.port, *steps)
        ends = monotonic() + PATIENCE
        while receiver.latest() is None and monotonic() < ends:
            sleep(0.01)
        status = receiver.status()
        assert receiver.latest() is not None
        assert status.floods > 0
        take = receiver.record(limit=2)
        send(receiver.port, *[v6(10 + n, face()) for n in range(4)])
        heard(receiver, status.packets + 4)
        assert (len(take), take.full) == (2, 2)


def test_a_flood_of_large_packets_is_bounded_too():
    with Receiver("osc", 0) as receiver:
        large = ["bundle", [["/VMC/Ext/OK", [1]]] * 2000]
        send(receiver.port, *[large] * 12, ["wait", 0.5], ["osc", "/jawOpen", [0.5]])
        ends = monotonic() + PATIENCE
        while receiver.latest() is None and monotonic() < ends:
            sleep(0.01)
        status = receiver.status()
        assert receiver.latest() is not None
        assert status.floods > 0
        assert status.packets < 1000  # not their number stopped them


def vmc(values, head=(0.0, 0.0, 0.0, 1.0)):
    steps = [["/VMC/Ext/OK", [1]], ["/VMC/Ext/T", [1.5]]]
    steps.append(["/VMC/Ext/Bone/Pos", ["Head", 0.0, 0.0, 0.0, *head]])
    steps.append(["/VMC/Ext/Bone/Pos", ["Hips", 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]])
    steps += [["/VMC/Ext/Blend/Val", [name, value]] for name, value in values.items()]
    return [*steps, ["/VMC/Ext/Blend/Apply", []]]


def test_vmc_applies_a_whole_face_at_once():
    one = vmc({"A": 0.5, "Blink_L": 1.0}, (0.0, math.sin(0.2), 0.0, math.cos(0.2)))
    two = vmc({"A": 1.0, "Blink_L": 0.0, "unheardOf": 0.5})
    # The first face is sent as a bundle, the second as single messages with a pause before the
    # message Apply, the third in two bundles.
    steps = [["bundle", one], *[["osc", *m] for m in two[:-1]], ["wait", 0.05], ["osc", *two[-1]]]
    steps += [["bundle", one[:5]], ["bundle", one[5:]]]
    clip, status = record("osc", *steps)
    assert status.frames == 3
    assert np.allclose(clip.curve("CTRL_expressions.jawOpen"), [0.3, 0.6, 0.3])
    assert np.allclose(clip.curve("CTRL_expressions.eyeBlinkL"), [1.0, 0.0, 1.0])
    yaw = [-0.4, 0.0, -0.4]  # to the face's right in Unity
    assert np.allclose(clip.curve("head.yaw"), yaw, atol=1e-6)
    assert status.subjects == ("127.0.0.1",)
    plan = shaping.Plan(("A", "unheardOf"), load_mapping("arkit"))
    assert plan.unmapped == ("unheardOf",)


def test_units_of_perfect_sync_are_not_doubled_by_vrm():
    units = {n: 0.0 for n in list(risorius.controls.arkit.mapping())[:20]} | {"JawOpen": 0.5}
    clip, _ = record("osc", ["bundle", vmc({**units, "A": 0.8, "mouthSmile_L": 0.25})])
    assert clip.curve("CTRL_expressions.jawOpen").tolist() == [0.5]
    assert clip.curve("CTRL_expressions.mouthCornerPullL").tolist() == [0.25]


def test_face_cap_and_plain_messages():
    # The test uses no receiver, because a receiver also ends a face after a pause, and a busy
    # machine makes pauses.
    decoder, packets = osc.Decoder(), []
    for n in range(3):
        face = [["osc", "/HR", [10.0 * n, 20.0, 0.0]], ["osc", "/W", [24, n / 4.0]]]
        face += [["osc", "/W", [0, 0.5]], ["osc", "/avatar/parameters/v2/MouthSmileLeft", [0.125]]]
        for message in face:
            packets += decoder.feed(packed(message), "here", 0.0)
        assert len(packets) == n  # the first message of the next face completes the face
        assert decoder.pending()
    packets += decoder.flush()
    assert not decoder.pending()
    for n, packet in enumerate(packets):
        values = dict(zip(packet.names, packet.values.tolist(), strict=True))
        assert values == pytest.approx(
            {
                "head.yaw": math.radians(20.0),
                "head.pitch": -math.radians(10.0 * n),
                "head.roll": 0.0,
                "jawOpen": n / 4.0,
                "browInnerUp": 0.5,
                "mouthSmileLeft": 0.125,
            }
        )
    assert len(packets) == 3


def faces_of(*messages):
    """Decode messages. Returns the values of the faces, and the errors of invalid messages."""
    decoder, refused = osc.Decoder(), []
    for address, values in messages:
        try:
            decoder.feed(packed(["osc", address, values]), "here", 0.0)
        except LiveError as error:
            refused.append(str(error))
    return [dict(zip(p.names, p.values.tolist(), strict=True)) for p in decoder.flush()], refused


def test_a_head_as_a_quaternion_is_not_overruled_by_degrees():
    half = math.radians(30.0) / 2.0
    turned = [0.0, math.sin(half), 0.0, math.cos(half)]  # ARKit: about up, to the own left
    (face,), _ = faces_of(["/HRQ", turned], ["/HR", [40.0, 40.0, 40.0]])
    angles = {"head.yaw": math.radians(30.0), "head.pitch": 0.0, "head.roll": 0.0}
    # The app's angles in degrees and its quaternion describe the same rotation.
    (degrees,), _ = faces_of(["/HR", [0.0, 30.0, 0.0]])
    assert face == pytest.approx(angles, abs=1e-6)
    assert degrees == pytest.approx(angles, abs=1e-6)


def test_eyes_of_both_apps():
    (face,), _ = faces_of(["/ELR", [10.0, 20.0]], ["/ERR", [-10.0, 5.0]])
    wanted = {"eyeL.yaw": 20.0, "eyeL.pitch": -10.0, "eyeR.yaw": 5.0, "eyeR.pitch": 10.0}
    assert face == pytest.approx({k: math.radians(v) for k, v in wanted.items()}, abs=1e-6)
    half = math.radians(12.0) / 2.0
    turned = [0.0, 0.0, 0.0, 0.0, math.sin(half), 0.0, math.cos(half)]
    (face,), _ = faces_of(["/VMC/Ext/Bone/Pos", ["LeftEye", *turned]])
    assert {name: abs(v) for name, v in face.items()} == pytest.approx(
        {"eyeL.yaw": math.radians(12.0), "eyeL.pitch": 0.0}, abs=1e-6
    )


@pytest.mark.parametrize(
    ("address", "values", "sentence"),
    [
        ("/jawOpen", [200.0], "jawOpen: a value of a face was expected, found 200.0"),
        ("/jawOpen", [1e9], "numbers of a face were expected, found (1000000000.0,)"),
        ("/VMC/Ext/Blend/Val", ["A"], "a name and a value were expected"),
        ("/VMC/Ext/Blend/Val", ["A" * 999, 1.0], "a name of at most"),
        ("/VMC/Ext/Bone/Pos", [1.0] * 8, "a bone's name and seven numbers were expected"),
        ("/HRQ", [0.0, 0.0, 0.0, 0.0], "a rotation was expected, found a quaternion of zeros"),
        ("/HR", [1.0, 2.0], "3 numbers were expected, found 2"),
        ("/HR", [1.0, "x", 2.0], "numbers of a face were expected"),
        ("/W", [999, 1.0], "an index below 52 and a value were expected"),
    ],
)
def test_a_message_that_no_face_sends_is_one_sentence(address, values, sentence):
    faces, (said,) = faces_of([address, values])
    assert faces == []
    assert sentence in said


def test_raw_controls_by_their_own_names():
    clip, _ = record("osc", ["osc", "/CTRL_expressions.noseWrinkleL", [0.75]])
    assert clip.names == ("CTRL_expressions.noseWrinkleL",)
    assert clip.curves.tolist() == [[0.75]]


def test_hostile_osc():
    bundle = packed(["bundle", [["/jawOpen", [0.5]]]])
    size = bundle.index(b"/jawOpen") - 4
    endless = bundle[:size] + b"\xff\xff\xff\xfc" + bundle[size + 4 :]  # a part of -4 bytes
    deep = bundle
    for _ in range(300):
        deep = bundle[:16] + len(deep).to_bytes(4, "big") + deep
    junk = [
        endless,
        deep,
        bundle[:-2],
        bundle[:18],
        b"/",
        b"/x\0\0",
        b"",
        b"\xff" * 64,
        b"/a,f\0\0\0",
    ]
    junk += [b"/W\0\0,if\0" + bytes([0, 0, 0, 200]) + b"\0\0\0\0", b"/W\0\0,[[[[[[\0"]
    steps = [["hex", data.hex()] for data in junk if data]
    steps += [["osc", "/jawOpen", [math.nan]], ["osc", "/VMC/Ext/Bone/Pos", ["Head", 1.0]]]
    steps += [["osc", "/VMC/Ext/Bone/Pos", ["Head"] + [0.0] * 7], ["osc", "/x" * 80, [1.0]]]
    steps += [["osc", "/jawOpen", [0.25]]]
    clip, status = record("osc", *steps)
    assert clip.curve("CTRL_expressions.jawOpen")[-1] == 0.25
    # At most four of these messages are valid OSC, for example one with an odd name, and the last.
    assert status.refused >= len(steps) - 4
    for data, words in ((deep, "too deep"), (b"/x\0\0,q\0\0", "a message of OSC was expected")):
        with pytest.raises(LiveError, match=words):
            osc.Decoder().feed(data, "here")


def test_names_without_end_do_not_stop_a_sender():
    decoder = osc.Decoder()
    units = packed(["bundle", [[f"/{name}", [0.25]] for name in livelink.NAMES[:52]]])

    def make_up(letter, count):
        for number in range(count):
            made = packed(["bundle", [[f"/{letter}{number}", [0.5]]]])
            (face,) = decoder.feed(made, "here", 1.0)
        return dict(zip(face.names, face.values.tolist(), strict=True))

    make_up("n", 600)
    for letter in "abcdefghij":
        decoder.feed(units, "here", 1.0)
        # Names that are sent again and again are kept, while names that were sent once are dropped.
        values = make_up(letter, 60)
        assert len(values) == 512
        assert [values[name] for name in livelink.NAMES[:52]] == [0.25] * 52


def fed(receiver, step, now, sender="127.0.0.1"):
    """Give a receiver a packet with a chosen time, as its thread does."""
    receiver._take_in(packed(step), sender, now)


def test_made_up_subjects_lock_no_phone_out():
    receiver = Receiver("livelink")
    for n in range(500):
        fed(receiver, v6(n, face(), f"made up {n}", OTHER), 1.0 + n / 500)
    assert len(receiver.status().subjects) == 32
    for n in range(120):  # the phone starts later, while the invented subjects continue
        fed(receiver, v6(n, face(i17=n / 128.0)), 2.0 + n / 60)
        for other in range(3):
            fed(receiver, v6(n, face(), f"again {n} {other}", OTHER), 2.0 + n / 60 + 0.005)
    latest = receiver.latest("iPhone")
    assert (latest.sequence, latest.values[JAW]) == (120, np.float32(119 / 128.0))
    assert len(receiver.status().subjects) == 32
    assert receiver.status().refused == 0


def test_subjects_that_stream_keep_their_places():
    receiver = Receiver("livelink")
    names = [f"phone {k}" for k in range(32)]
    for n in range(10):
        for name in names:
            fed(receiver, v6(n, face(), name), 1.0 + n / 60)
    fed(receiver, v6(0, face(), "one more"), 1.2)
    assert list(receiver.status().subjects) == names
    assert receiver.status().reasons[0][0].startswith("32 subjects are heard at once")
    fed(receiver, v6(0, face(), "one more"), 3.0)  # the others fell silent; names[1] makes room
    assert list(receiver.status().subjects) == [names[0], *names[2:], "one more"]


def flood(receiver, seconds, at, steps=lambda n: ()):
    """Give a receiver 6 packets per second for each of 32 invented subjects.

    After round n of these packets come the packets (step, sender) of steps(n). at(k) is the
    address of subject k.
    """
    for n in range(round(6 * seconds)):
        for k in range(32):
            address = at(k)
            fed(receiver, v6(n, face(), f"made up {k}", OTHER), 10.0 + n / 6 + k / 1000, address)
        for step, sender in steps(n):
            fed(receiver, step, 10.0 + n / 6 + 0.1, sender)


@pytest.mark.parametrize("at", ["127.0.0.1", "10.0.0.66", "10.0.{}.66"])
def test_a_phone_that_was_there_first_keeps_its_place_in_a_flood(at):
    receiver = Receiver("livelink")
    for n in range(10):
        fed(receiver, v6(n, face(i17=0.25)), 9.0 + n / 60)

    def phone(n):  # no packets for 3 s
        return [(v6(n, face(i17=0.75)), "127.0.0.1")] if n > 18 else []

    flood(receiver, 4.0, at.format, phone)
    assert receiver.status().subject == receiver.status().subjects[0] == "iPhone"
    assert receiver.latest().values[JAW] == np.float32(0.75)
    assert len(receiver.status().subjects) == 32


def test_invented_subjects_of_one_address_lock_no_phone_of_another_out():
    receiver = Receiver("livelink")
    for n in range(6):
        fed(receiver, v6(n, face(), "second", OTHER), 9.0 + n / 60, "10.0.0.2")

    def phone(n):  # the second subject of its address, with a pause
        busy = n < 3 or n > 20
        return [(v6(6 * n, face(i17=0.5), f"iPhone {k}"), "10.0.0.1") for k in range(2 * busy)]

    flood(receiver, 5.0, "10.0.0.66".format, phone)
    subjects = receiver.status().subjects
    assert {"second", "iPhone 0", "iPhone 1"} <= set(subjects)
    assert [receiver.latest(f"iPhone {k}").sequence for k in (0, 1)] == [12, 12]
    assert len(subjects) == 32


def test_packets_of_another_address_do_not_move_a_face_that_is_followed():
    receiver = Receiver("livelink")
    take = receiver.record("iPad")
    for n in range(6):  # version 1 lacks the device: only the name identifies
        fed(receiver, ["v1", "iPad", n / 60, n, face(52, i17=0.25)], 1.0 + n / 60, "10.0.0.1")
        fed(receiver, ["v1", "iPad", n / 60, n, face(52, i17=1.0)], 1.0 + n / 60, "10.0.0.66")
        fed(receiver, v6(n, face(i17=1.0), "iPad", PHONE), 1.0 + n / 60, "10.0.0.66")
        twin = PHONE[:8] + OTHER[8:]
        fed(receiver, v6(n, face(i17=1.0), "iPad", twin), 1.0 + n / 60, "10.0.0.66")
    labels = ("iPad", "iPad (10.0.0.66)", f"iPad ({PHONE[:8]})", "iPad (10.0.0.66 2)")
    assert receiver.status().subjects == labels
    jaw = receiver.finish(take).clip().curve("CTRL_expressions.jawOpen")
    assert jaw.tolist() == [0.25] * 6


def test_a_phone_that_changes_its_address_stays_the_same_subject():
    receiver = Receiver("livelink")
    take = receiver.record()
    fed(receiver, v6(0, face(i17=0.25)), 1.0, "10.0.0.1")
    fed(receiver, v6(0, face(), "Bob", OTHER), 1.0, "10.0.0.2")
    fed(receiver, v6(120, face(i17=0.5)), 3.0, "10.0.0.9")
    assert receiver.status().subjects == ("iPhone", "Bob")
    clip = receiver.finish(take).clip()
    assert clip.curve("CTRL_expressions.jawOpen").tolist() == [0.25, 0.5]
    assert np.allclose(clip.times, [0.0, 2.0])


@pytest.mark.parametrize("way", ["record", "reserve"])
def test_a_named_subject_gets_a_place_in_a_flood_that_came_first(way):
    receiver = Receiver("livelink")
    getattr(receiver, way)("iPhone" if way == "record" else ["iPhone"])

    def phone(n):  # from the address of the flood, with pauses
        return [(v6(10 * n, face(i17=n / 64.0)), "127.0.0.1")] if n > 12 and n % 12 == 1 else []

    flood(receiver, 8.0, "127.0.0.1".format, phone)
    latest = receiver.latest("iPhone")
    assert (latest.sequence, latest.values[JAW]) == (3, np.float32(37 / 64.0))
    receiver.reserve([])
    assert len(receiver.status().subjects) == 32


def test_a_named_sender_of_osc_gets_a_place_in_a_flood_that_came_first():
    receiver, bundle = Receiver("osc"), ["bundle", [["/jawOpen", [0.5]]]]
    receiver.reserve(["10.9.9.9"])
    for n in range(30):
        for k in range(32):
            fed(receiver, bundle, 10.0 + n / 6, f"10.0.0.{k}")
    fed(receiver, bundle, 15.0, "10.8.8.8")
    assert receiver.latest("10.8.8.8") is None
    assert "no room for another that is not named" in receiver.status().reasons[0][0]
    fed(receiver, bundle, 15.0, "10.9.9.9")
    assert receiver.latest("10.9.9.9").sequence == 1


def test_a_subject_is_forgotten_after_a_minute_but_not_while_it_is_recorded():
    receiver = Receiver("livelink")
    fed(receiver, v6(0, face(), "Ada"), 1.0)
    fed(receiver, v6(0, face(), "Bob"), 1.0)
    take = receiver.record("Bob")
    fed(receiver, v6(1, face(), "Bob"), 1.1)
    fed(receiver, v6(0, face(), "Cid"), 61.0)
    assert receiver.status().subjects == ("Ada", "Bob", "Cid")
    fed(receiver, v6(0, face(), "Dan"), 100.0)
    assert receiver.status().subjects == ("Bob", "Cid", "Dan")
    for n in range(500):
        fed(receiver, v6(0, face(), f"made up {n}"), 200.0 + n / 500)
    fed(receiver, v6(60 * 220, face(), "Bob"), 221.0)
    assert np.allclose(receiver.finish(take).clip().times, [0.0, 220.0 - 1 / 60], atol=0.1)


def test_made_up_senders_lock_no_other_out():
    receiver = Receiver("osc")
    bundle = ["bundle", [["/jawOpen", [0.5]]]]
    for n in range(500):
        fed(receiver, bundle, 1.0 + n / 500, f"10.0.{n // 250}.{n % 250}")
    for n in range(60):
        fed(receiver, bundle, 2.0 + n / 60, "10.9.9.9")
        fed(receiver, bundle, 2.0 + n / 60 + 0.001, f"10.1.0.{n}")
    assert receiver.latest("10.9.9.9").sequence == 60
    assert len(receiver.status().subjects) == 32


@pytest.mark.parametrize("wrong", [120, 598, 30_000, -30_000, 86_400 * 60, -86_400 * 60 + 100])
@pytest.mark.parametrize("often", [1, 100])
def test_a_wrong_frame_number_does_not_make_a_take_longer_than_it_took(wrong, often):
    receiver, start = Receiver("livelink"), 50_000 * 60
    fed(receiver, v6(start, face()), 1.0)
    take = receiver.record()
    for n in range(1, 600):
        off = wrong if n % (600 // (often + 1)) == 0 else 0
        fed(receiver, v6(start + n + off, face(i17=n / 600.0)), 1.0 + n / 60)
    clip = receiver.finish(take).clip()
    assert clip.frame_count >= 599 - 2 * often
    assert 599 / 60 - 1.0 < clip.duration < 599 / 60 * 1.001 + 2.01


def test_midnight_in_a_pause():
    receiver, day = Receiver("livelink"), 86_400 * 60
    take = receiver.record()
    for number, now in ((day - 60, 1.0), (day - 1, 2.0 - 1 / 60), (60 * 60, 62.0)):
        fed(receiver, v6(number % day, face()), now)
    assert np.allclose(receiver.finish(take).clip().times, [0.0, 59 / 60, 61.0], atol=1e-6)


def test_a_port_in_use_is_one_sentence():
    with Receiver("livelink", 0) as receiver:
        with pytest.raises(LiveError, match=rf"^Port {receiver.port} is in use: [^.]*\.$"):
            Receiver("osc", receiver.port).start()
        port = receiver.port
    with Receiver("livelink", port) as again:
        assert again.port == port


@pytest.fixture
def bound(monkeypatch):
    """A list to which the address of each receiver's socket is added, as the system reports it."""
    from risorius.live import receiver

    found, bind = [], receiver._bound

    def spy(host, port):
        listener = bind(host, port)
        found.append(listener.getsockname()[0])
        return listener

    monkeypatch.setattr(receiver, "_bound", spy)
    return found


def test_nothing_but_this_machine_is_heard_unless_it_is_said(bound, capsys):
    from risorius import cli

    with Receiver("livelink", 0):
        pass
    assert cli.main(["live", "--port", "0", "--seconds", "0.01"]) == 0
    assert bound == ["127.0.0.1", "127.0.0.1"]
    assert "this machine alone" in capsys.readouterr().err
    assert cli.main(["live", "--everywhere", "--port", "0", "--seconds", "0.01"]) == 0
    assert bound[2:] == ["0.0.0.0"]
    words = capsys.readouterr().err
    assert "the network; in the app: " in words
    assert risorius.live.own_address() in words


def test_the_address_for_the_app_is_one_of_this_machine(monkeypatch):
    address = risorius.live.own_address()
    if address:  # only own addresses can be bound
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.bind((address, 0))
    assert not address.startswith("127.")

    class Offline(socket.socket):
        def connect(self, _where):
            raise OSError("Network is unreachable")

    monkeypatch.setattr(socket, "socket", Offline)
    assert risorius.live.own_address() == ""


def frame_of(**values):
    return frame_at(0.0, **values)


def frame_at(time, **values):
    names = tuple(n.replace("__", ".") for n in values)
    return Frame("x", time, time, 1, names, np.array(list(values.values()), np.float32))


def test_neutral_now_and_gains():
    shaper = Shaper(gain=2.0, head_gain=-1.0)
    shaper.capture(frame_of(jawOpen=0.2, head__yaw=0.3, eyeBlinkLeft=0.1))
    got = shaper.apply(frame_of(jawOpen=0.36, head__yaw=0.5, eyeBlinkLeft=0.05))
    values = dict(zip(got.names, got.values.tolist(), strict=True))
    assert values["CTRL_expressions.jawOpen"] == pytest.approx(2.0 * 0.16 / 0.8)
    assert values["head.yaw"] == pytest.approx(-0.2)
    assert values["CTRL_expressions.eyeBlinkL"] == 0.0
    shaper.gains = {"jawOpen": 0.25}
    got = shaper.apply(frame_of(jawOpen=1.0, head__yaw=0.3, eyeBlinkLeft=1.0))
    assert got.values.tolist() == pytest.approx([0.5, 0.0, 1.0])  # clamped; 1 is reached


def test_gains_leave_shut_lips_shut():
    shaper = Shaper(gain=0.5)
    shaper.gains = {"jawOpen": 1.5}
    shaper.capture(frame_of(jawOpen=0.02, mouthClose=0.02))
    for close, share in ((0.51, 1.0), (0.265, 0.5), (0.8, 1.0), (0.0, 0.0)):
        got = shaper.apply(frame_of(jawOpen=0.51, mouthClose=close))
        values = dict(zip(got.names, got.values.tolist(), strict=True))
        assert values["CTRL_expressions.jawOpen"] == pytest.approx(0.375)
        assert values["CTRL_expressions.mouthLipsTogetherUR"] == pytest.approx(share)
    got = shaper.apply(frame_of(jawOpen=0.025, mouthClose=0.03))
    assert 0 < got.values[1] < 1  # near a shut jaw the share is below 1


def test_a_mapping_of_ones_own(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(
        """
        base = "arkit"
        ignore = ["cheekPuff"]
        [rows]
        jawOpen = { "CTRL_expressions.mouthStretchL" = 0.5 }
        glare = { "CTRL_expressions.eyeWidenL" = 1.0 }
        [controls]
        eyeWidenL = { gain = 0.5, offset = 0.25 }
        """
    )
    shaper = Shaper(path)
    got = shaper.apply(frame_of(jawOpen=0.5, glare=0.5, cheekPuff=1.0, other=1.0))
    assert dict(zip(got.names, got.values.tolist(), strict=True)) == {
        "CTRL_expressions.mouthStretchL": 0.25,
        "CTRL_expressions.eyeWidenL": 0.5,
    }
    assert shaper.unmapped == ("other",)
    with pytest.raises(ValueError, match="absent"):
        Shaper(tmp_path / "absent.toml")


def test_eyes_look_where_only_their_bones_are_sent():
    turn = math.radians(15.0)
    shaper = Shaper()
    got = dict(
        zip(*map(list, shaper.apply(frame_of(eyeL__yaw=turn, eyeL__pitch=-turn))), strict=True)
    )
    assert got["CTRL_expressions.eyeLookLeftL"] == pytest.approx(0.5)
    assert got["CTRL_expressions.eyeLookDownL"] == pytest.approx(0.5)
    assert got["CTRL_expressions.eyeLookRightL"] == got["CTRL_expressions.eyeLookUpL"] == 0.0
    # If a frame contains values of ARKit's eyeLook shapes, angles of the eye bones are ignored.
    got = shaper.apply(frame_of(eyeL__yaw=turn, eyeLookOutLeft=0.1))
    assert dict(zip(got.names, got.values, strict=True)) == {
        "CTRL_expressions.eyeLookLeftL": np.float32(0.1)
    }


def test_smoothing_is_the_one_euro_filter():
    """Smoothed values equal the one-euro filter of its paper, written here in plain Python."""
    random = np.random.default_rng(3)
    raw = np.clip(
        0.5 + random.normal(0, 0.02, 200) + np.where(np.arange(200) > 120, 0.4, 0.0), 0, 1
    )
    shaper, past, got, wanted = Shaper(smoothing=1.0), deque(maxlen=1), [], []
    for n, value in enumerate(raw.astype(np.float32)):
        got.append(float(shaper.apply(frame_at(n / 60.0, jawOpen=value)).values[0]))
        wanted.append(plain_one_euro(past, float(value), 1 / 60))
    assert np.allclose(got, wanted, atol=1e-5)
    still = slice(60, 120)
    assert np.std(got[still]) < 0.4 * np.std(raw[still])
    assert np.mean(got[130:140]) > 0.5 + 0.4 * 0.8  # a quick movement passes


def plain_one_euro(past, value, step):
    if not past:
        past.append((value, 0.0))
        return value
    before, speed = past[0]
    share = lambda cutoff: 1 / (1 + (1 / (2 * math.pi * cutoff)) / step)  # noqa: E731
    speed += share(1.0) * ((value - before) / step - speed)
    value = before + share(12.0 * 0.05 + 4.0 * abs(speed)) * (value - before)
    past.append((value, speed))
    return value


def test_a_recording_is_not_smoothed():
    frames = [v6(n, face(i17=float(n % 2))) for n in range(6)]
    clip, _ = record("livelink", *frames, shaper=Shaper(smoothing=1.0))
    assert clip.curve("CTRL_expressions.jawOpen").tolist() == [0.0, 1.0] * 3


def saved(path):
    """Names, times and curves of a written file, .rzc or .csv."""
    if path.suffix == ".rzc":
        clip = risorius.Clip.load(path)
        return list(clip.names), clip.frame_times(), clip.curves
    lines = path.read_text().splitlines()
    rows = np.array([[float(v) for v in line.split(",")] for line in lines[1:]])
    return lines[0].split(",")[1:], rows[:, 0], rows[:, 1:].T


@pytest.mark.parametrize("suffix", [".csv", ".rzc"])
def test_the_command_records_and_saves_on_ctrl_c(tmp_path, suffix):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    out = tmp_path / f"take{suffix}"
    command = [sys.executable, "-m", "risorius", "live", "--port", str(port), "--record", str(out)]
    with subprocess.Popen(
        command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=os.environ
    ) as process:
        assert f"port {port}" in process.stderr.readline()
        send(port, *[v6(n, face(i17=n / 8.0, i52=-0.5)) for n in range(5)], ["wait", 0.2])
        process.send_signal(signal.SIGINT)
        words, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, errors
    assert "5 frames of iPhone" in words
    assert "not mapped" not in errors
    names, times, curves = saved(out)
    assert curves[names.index("CTRL_expressions.jawOpen")].tolist() == [n / 8.0 for n in range(5)]
    assert curves[names.index("head.yaw")].tolist() == [0.5] * 5
    assert times == pytest.approx([n / 60 for n in range(5)], abs=1e-9)
    assert [p.name for p in tmp_path.iterdir()] == [out.name]


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["--record", "take.txt"], 2, "ending in .rzc or .csv"),
        (["--port", "70000"], 2, "0 to 65535"),
        (["--seconds", "0"], 2, "more than 0"),
        (["--port", "0", "--seconds", "0.05", "--record", "x.csv"], 1, "no face came"),
    ],
)
def test_the_command_refuses(arguments, code, words, capsys, tmp_path, monkeypatch):
    from risorius.cli import main

    monkeypatch.chdir(tmp_path)
    assert main(["live", *arguments]) == code
    assert words in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
