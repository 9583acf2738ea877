# SPDX-License-Identifier: GPL-3.0-or-later
"""The capture range of a face: learned, edited, saved in the file, and applied to captures."""

import bpy
import numpy as np
import pytest
from support import scene
from support.layout import Recorder, drawn
from test_live import choose, free_port, packet, send, session_of, tick_until

JAW, PULL = "CTRL_expressions.jawOpen", "CTRL_expressions.mouthCornerPullL"
RATE = 30


def bump(count, at, height):
    """A curve of `count` frames that rises from 0, stays at a height, and falls to 0.

    It rises in 15 frames, is at `height` for 5 frames with the frame `at` in the middle, and falls
    in 15 frames.
    """
    distance = np.clip(np.abs(np.arange(count) - at) - 2.0, 0.0, 15.0)
    return height * (0.5 + 0.5 * np.cos(np.pi * distance / 15.0))


def table(path, **curves):
    rows = np.array(list(curves.values())).T
    lines = ["time," + ",".join(curves)]
    lines += [
        f"{n / RATE:.6f}," + ",".join(map("{:.6f}".format, row)) for n, row in enumerate(rows)
    ]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.fixture(scope="module")
def rom(tmp_path_factory):
    """A CSV file with a capture in which a person shows the extremes of jaw and smile.

    The jaw goes from 0 to 0.8, the smiles from 0.05 to 0.7. A brow reaches only 0.05.
    """
    smile = 0.05 + bump(150, 110, 0.65)
    return table(
        tmp_path_factory.mktemp("rom") / "rom.csv",
        JawOpen=bump(150, 40, 0.8),
        MouthSmileLeft=smile,
        MouthSmileRight=smile,
        BrowDownLeft=bump(150, 70, 0.05),
    )


@pytest.fixture
def rig(dna_file):
    return scene.load(dna_file, "LIVE")


def rows(rig):
    return {row.name: row for row in scene.controls(rig).risorius_ranges}


def imported(rig, path, **options):
    """Import a clip. Returns the highest key values of jaw and smile, and the import report."""
    assert bpy.ops.risorius.import_animation(filepath=str(path), **options) == {"FINISHED"}
    action = scene.controls(rig).animation_data.action
    tops = {}
    for curve in scene.submodule("scene.base.compat").curves_of(action):
        for name in (JAW, PULL):
            if name in curve.data_path:
                tops[name] = max(key.co[1] for key in curve.keyframe_points)
    return tops[JAW], tops[PULL], action["risorius_report"]


def test_captures_reach_the_extremes_by_the_range_of_the_face(rig, rom):
    assert imported(rig, rom)[:2] == pytest.approx((0.8, 0.7))
    bpy.ops.ed.undo_push(message="before")
    assert bpy.ops.risorius.learn_range(filepath=str(rom)) == {"FINISHED"}
    bpy.ops.ed.undo_push(message="learned")
    found = rows(rig)
    assert tuple(getattr(found[JAW], n) for n in ("neutral", "extreme")) == pytest.approx((0, 0.8))
    assert found[PULL].used
    assert found[PULL].neutral == pytest.approx(0.05)
    brow = found["CTRL_expressions.browDownL"]
    assert (brow.used, brow.reason) == (False, "hardly moves")
    jaw, smile, report = imported(rig, rom)
    assert (jaw, smile) == (1.0, 1.0)
    assert "3 controls are stretched by the range." in report
    raw = table(rom.with_name("raw.csv"), **{JAW: bump(150, 40, 0.8), PULL: bump(150, 40, 0.7)})
    assert imported(rig, raw)[:2] == pytest.approx((0.8, 0.7))  # may be stretched already
    found[JAW].used = False
    assert imported(rig, rom)[0] == pytest.approx(0.8)
    assert imported(rig, rom, capture_range="NONE")[1] == pytest.approx(0.7)
    scene.controls(rig).risorius_use_range = False
    assert imported(rig, rom)[1] == pytest.approx(0.7)
    name = rig.name
    bpy.ops.ed.undo()
    assert rows(bpy.data.objects[name]) == {}


def test_the_range_of_a_take_alone_leaves_the_face_as_it_is(rig, tmp_path):
    jaw = sum(bump(400, at, 0.75) for at in (60, 160, 260, 340))
    smile = bump(400, 200, 0.7)
    take = table(tmp_path / "take.csv", JawOpen=jaw, MouthSmileLeft=smile, MouthSmileRight=smile)
    # The jaw reaches the same height four times, so this is its extreme and becomes 1. The smile
    # reaches its height only once, which shows no extreme, so it stays unchanged.
    assert imported(rig, take, capture_range="TAKE")[:2] == pytest.approx((1.0, 0.7))
    assert rows(rig) == {}
    short = table(tmp_path / "short.csv", JawOpen=[0.0, 1.0])
    with pytest.raises(RuntimeError, match=r"short\.csv: a take of at least 2 s was expected"):
        bpy.ops.risorius.import_animation(filepath=str(short), capture_range="TAKE")
    with pytest.raises(RuntimeError, match=r"short\.csv: a take of at least 2 s was expected"):
        bpy.ops.risorius.learn_range(filepath=str(short))


def test_it_is_saved_with_the_face_and_as_a_file(rig, rom, tmp_path):
    def panel():
        return drawn(bpy.types.RISORIUS_PT_ranges)

    assert "no range was learned" in panel().text()
    assert not bpy.ops.risorius.save_range.poll()
    bpy.ops.risorius.learn_range(filepath=str(rom))
    shown = panel()
    assert {"risorius.save_range", "risorius.forget_range"} <= set(shown.operators)
    assert "risorius_use_range" in shown.properties
    assert "Gain 1.25" in shown.text()
    scene.controls(rig).risorius_ranges_index = list(rows(rig)).index("CTRL_expressions.browDownL")
    assert "As captured: hardly moves." in panel().text()
    line = Recorder()
    kind, row = bpy.types.RISORIUS_UL_ranges, rows(rig)[JAW]
    kind.draw_item(None, bpy.context, line, None, row, 0, None, "")
    assert (line.labels, line.properties) == (["jawOpen"], ["used", "neutral", "extreme"])
    rows(rig)[JAW].neutral = 0.75  # the extreme stays above the neutral
    assert rows(rig)[JAW].extreme == pytest.approx(0.85)
    path = tmp_path / "ada.range.toml"
    assert bpy.ops.risorius.save_range(filepath=str(path)) == {"FINISHED"}
    assert f'"{JAW}" = {{ neutral = 0.75, extreme = 0.85 }}' in path.read_text()
    kept = {n: (r.used, r.neutral, r.extreme, r.reason) for n, r in rows(rig).items()}
    blend, name = tmp_path / "face.blend", rig.name
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    rig = bpy.data.objects[name]
    assert {n: (r.used, r.neutral, r.extreme, r.reason) for n, r in rows(rig).items()} == kept
    assert bpy.ops.risorius.forget_range() == {"FINISHED"}
    assert rows(rig) == {}
    assert bpy.ops.risorius.load_range(filepath=str(path)) == {"FINISHED"}
    assert {n: (r.used, r.neutral, r.extreme, r.reason) for n, r in rows(rig).items()} == kept
    path.write_text(path.read_text().replace("extreme = 0.85", "extreme = 0.76"))
    with pytest.raises(RuntimeError, match=r"jawOpen\.extreme: 0\.85 to 2\.65 was expected"):
        bpy.ops.risorius.load_range(filepath=str(path))
    assert rows(rig)[JAW].extreme == pytest.approx(0.85)


def test_live_capture_follows_the_range_and_teaches_it(rig, rom):
    port = choose(free_port())
    assert not bpy.ops.risorius.learn_range_live.poll()
    bpy.ops.risorius.learn_range(filepath=str(rom))
    bpy.ops.risorius.live_start()
    send(port, packet(1, _17=0.8))
    tick_until(rig, 1)
    assert scene.face(rig)[JAW] == 1.0
    rows(rig)[JAW].used = False
    tick_until(rig, 1)  # the change is visible without a new face
    assert scene.face(rig)[JAW] == pytest.approx(0.8)
    rows(rig)[JAW].used = True
    bpy.ops.risorius.live_record()
    send(port, packet(2, _17=0.4), packet(3, _17=0.8))
    tick_until(rig, 3)
    assert bpy.ops.risorius.live_record() == {"FINISHED"}
    curves = scene.curves(scene.controls(rig))
    jaw = next(curve for curve in curves if "jawOpen" in curve.data_path)
    assert jaw.keyframe_points[1].co[1] == 1.0
    with pytest.raises(RuntimeError, match="a take of at least 2 s was expected"):
        bpy.ops.risorius.learn_range_live()
    # A new range is learned from the received values, not from the values that the present range
    # has stretched.
    session, frame = session_of(rig), session_of(rig).recent[-1]
    session.recent.clear()
    for n, height in enumerate(bump(150, 60, 0.65)):
        values = frame.values.copy()
        values[17] = height
        now = frame.time + n / RATE
        session.recent.append(frame._replace(time=now, arrival=now, values=values))
    assert bpy.ops.risorius.learn_range_live() == {"FINISHED"}
    assert rows(rig)[JAW].extreme == pytest.approx(0.65, abs=0.002)
    assert bpy.ops.risorius.live_stop() == {"FINISHED"}
