# SPDX-License-Identifier: MIT
"""Measures the time from a phone's packet to the slider of a face, and its cost in Blender.

    python tests/bench/live_latency.py [--seconds 20] [--rate 60] [--dna FILE]

A process sends packets of Live Link Face to this machine; the add-on's timer function is called 60
times a second, as Blender does between its events. Prints medians and 99th percentiles in ms:

    received   from sending to the receiver's newest frame
    written    from sending to the slider; the wait for the timer is most of it
    timer      the timer function itself
    shown      the update of the scene after the timer function, without drawing
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path
from time import monotonic, sleep

import numpy as np

PROJECT = Path(__file__).resolve().parents[2]
_SENDER = """
import math, socket, struct, sys, time
port, rate, seconds = int(sys.argv[1]), float(sys.argv[2]), float(sys.argv[3])
out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
head = bytes([6]) + struct.pack("!I", 36) + b"0" * 36 + struct.pack("!I", 5) + b"bench"
begin = time.monotonic()
for n in range(int(rate * seconds)):
    time.sleep(max(0.0, begin + n / rate - time.monotonic()))
    values = [0.5 + 0.5 * math.sin(n * 0.1 + k) for k in range(61)]
    packet = head + struct.pack("!ifii", n, 0.0, int(rate), 1) + struct.pack("!B61f", 61, *values)
    print(n, time.monotonic())
    out.sendto(packet, ("127.0.0.1", port))
"""


def _prepare(dna):
    """Enable the add-on in an empty file, and load a face. Returns its rig."""
    sys.path.insert(0, str(PROJECT / "blender_tests"))
    import os
    import shutil

    os.environ["BLENDER_USER_RESOURCES"] = tempfile.mkdtemp(prefix="risorius-bench-")
    os.environ["RISORIUS_TEST_USER"] = os.environ["BLENDER_USER_RESOURCES"]
    import bpy  # isort: skip  it puts addon_utils on the path
    import addon_utils
    import conftest

    bpy.ops.wm.read_factory_settings(use_empty=True)
    target = Path(os.environ["RISORIUS_TEST_USER"]) / "extensions" / "user_default" / "risorius"
    shutil.copytree(PROJECT / "addon" / "risorius", target)
    conftest._repository(target)
    assert addon_utils.enable(conftest.MODULE) is not None
    from support import faces, scene

    if dna is None:
        dna = target.parent / "small.dna"
        faces.small_face().save(str(dna))
    return scene.load(dna)


def _measure(rig, options):
    """Send packets to the add-on, and measure the times of each frame, in seconds.

    Returns:
        Frame number -> time of sending; frame number -> (time of arrival, time when the sliders
        were written); the durations of the timer function; the durations of the scene's update.
    """
    import bpy
    from support import scene

    live = scene.submodule("scene.live.capture")
    settings = live.Settings(port=0, everywhere=False)
    session = live.start(rig, settings)
    port = session.receiver.port
    command = [sys.executable, "-c", _SENDER, str(port), str(options.rate), str(options.seconds)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    seen, timer, shown = {}, [], []
    following, rest = monotonic(), monotonic() + 0.5
    while process.poll() is None or monotonic() < rest:
        if process.poll() is None:
            rest = monotonic() + 0.1
        sleep(max(0.0, following - monotonic()))
        begin = monotonic()
        following = begin + live.INTERVAL
        before = session.sequence
        live._tick()
        ended = monotonic()
        if session.sequence == before:
            continue
        frame = session.receiver.latest()
        if frame.sequence == session.sequence:
            seen[round(frame.time * options.rate)] = (frame.arrival, ended)
        timer.append(ended - begin)
        bpy.context.view_layer.update()
        shown.append(monotonic() - ended)
    sent = dict(map(str.split, process.stdout.read().splitlines()))
    live.stop_all()
    return {int(n): float(t) for n, t in sent.items()}, seen, timer, shown


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--rate", type=float, default=60.0)
    parser.add_argument("--dna", type=Path, help="a face; else a small one of the tests")
    options = parser.parse_args()
    rig = _prepare(options.dna)
    sent, seen, timer, shown = _measure(rig, options)
    rows = {
        "received": [arrival - sent[n] for n, (arrival, _) in seen.items()],
        "written": [written - sent[n] for n, (_, written) in seen.items()],
        "timer": timer,
        "shown": shown,
    }
    print(f"{len(sent)} sent, {len(seen)} shown")
    for name, values in rows.items():
        low, high = np.percentile(values, [50, 99]) * 1000
        print(f"{name:<9} {low:7.3f} {high:7.3f}")


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    import os

    os._exit(0)  # Blender as a module sometimes hangs in its destructors
