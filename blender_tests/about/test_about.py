# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests of the self-test, of the list of a face's contents, and of the timing overlay."""

import bpy
import numpy as np
import pytest
from support import scene


def test_the_self_test_says_that_the_module_works(monkeypatch):
    about = scene.submodule("ui.about.preferences")
    works, text = about.self_test()
    assert works
    assert "works" in text
    assert "Python 3." in text
    assert "scalar" not in text  # the self-test names it
    words = text.partition(": ")[2].split(", ")
    assert all(w.strip(",") == w != "" for w in words), text

    class Wrong:
        def __init__(self, *_args, **_kwargs):
            pass

        def evaluate(self, _deltas):
            return np.zeros((1, 3)), None, None

    monkeypatch.setattr(scene.submodule("native")._risorius, "BoneSpace", Wrong)
    works, text = about.self_test()
    assert not works
    assert "wrong numbers" in text


def test_the_whole_self_test_goes_to_the_console_and_the_clipboard(capsys, monkeypatch):
    assert bpy.ops.risorius.self_test() == {"FINISHED"}
    said = capsys.readouterr().out
    rows, report = scene.submodule("ui.about.operators").self_test_rows()
    names = [row.name for row in rows]
    assert {"Blender", "evaluate, scalar", "write and read", "time of a frame"} <= set(names)
    assert all(row.passed for row in rows), report
    assert bpy.app.version_string in report
    assert f"all {len(rows)} checks passed" in said

    checks = scene.submodule("native").part("selftest.checks")
    monkeypatch.setattr(checks, "TOLERANCE", -1.0)
    with pytest.raises(RuntimeError, match="checks failed: evaluate, scalar"):
        bpy.ops.risorius.self_test()
    assert "FAIL evaluate, scalar" in capsys.readouterr().out


def test_a_newer_blender_gets_a_notice_and_no_refusal(monkeypatch, capsys):
    compat = scene.submodule("scene.base.compat")
    assert compat.notice() == ""
    older = (bpy.app.version[0], bpy.app.version[1] - 1)
    monkeypatch.setattr(compat, "NEWEST_TRIED", older)
    assert "look for an update" in compat.notice()
    registration = scene.submodule("registration")
    registration.unregister()
    registration.register()
    assert "look for an update" in capsys.readouterr().out
    assert bpy.ops.risorius.self_test.poll()


def test_after_an_update_in_use_it_says_restart(monkeypatch):
    native = scene.submodule("native")
    monkeypatch.setattr(native._risorius, "__version__", "0.0.1")
    assert "restart Blender" in native.problem()
    assert "save your work" in native.problem()
    monkeypatch.setattr(native, "installed_version", lambda: "0.0.1")
    assert "Install the add-on anew" in native.problem()
    assert not bpy.ops.risorius.self_test.poll()


def test_the_manual_of_each_button_is_its_page(monkeypatch):
    from fnmatch import fnmatchcase

    registration = scene.submodule("registration")
    native, manual = scene.submodule("native"), scene.submodule("ui.about.manual")
    before = list(bpy.utils.manual_map())
    assert native.website() == ""
    registration.unregister()
    monkeypatch.setattr(native, "website", lambda: "https://a.example/")
    registration.register()
    assert ("https://a.example/", manual.pages()[1]) in list(bpy.utils.manual_map())
    for cls in registration.CLASSES:
        if issubclass(cls, bpy.types.Operator):
            wanted = f"reference/blender/{cls.bl_idname}.html"
            for asked in (f"bpy.ops.{cls.bl_idname}", f"bpy.types.{cls.__name__.lower()}.x"):
                pages = [page for pattern, page in manual.pages()[1] if fnmatchcase(asked, pattern)]
                assert pages == [wanted]
    registration.unregister()
    monkeypatch.undo()
    registration.register()
    assert list(bpy.utils.manual_map()) == before


def test_of_two_copies_one_stays_idle(addon, monkeypatch, capsys):
    import sys
    import types

    registration = scene.submodule("registration")
    registration.unregister()
    other = types.ModuleType("bl_ext.elsewhere.risorius")
    other.__addon_enabled__ = True
    monkeypatch.setitem(sys.modules, other.__name__, other)
    registration.register()
    assert (
        "Another copy of Risorius is in use, of the repository elsewhere" in capsys.readouterr().out
    )
    assert not [n for n in dir(bpy.types) if n.startswith("RISORIUS_")]
    assert scene.submodule("ui.about.preferences").RISORIUS_Idle.is_registered
    assert not [
        h for h in bpy.app.handlers.frame_change_post if "risorius" in getattr(h, "__module__", "")
    ]
    registration.unregister()
    assert not [n for n in dir(bpy.types) if n.startswith("RISORIUS_")]
    other.__addon_enabled__ = False
    registration.register()
    assert bpy.ops.risorius.self_test.poll()


def test_what_a_face_is_made_of(mode, dna_file):
    rig = scene.load(dna_file, mode)
    lines = scene.submodule("ui.about.operators").describe(rig)
    assert "11 controls, 7 joints" in lines[0]
    head = next(line for line in lines if "Small_head" in line)
    real = 6 if mode == "KEYS" else 0
    assert f"168 vertices, 6 channels move it, {real} of them as real keys" in head
    assert bpy.ops.risorius.describe() == {"FINISHED"}


@pytest.mark.parametrize(
    ("item", "state"),
    [("controls", "POSE"), ("rig", "POSE"), ("mesh", "WEIGHT_PAINT"), ("other", "EDIT")],
)
def test_a_slider_moves_the_face_in_every_mode(mode, dna_file, item, state):
    rig = scene.load(dna_file, mode)
    bpy.ops.mesh.primitive_cube_add()
    chosen = {
        "controls": scene.controls(rig),
        "rig": rig,
        "mesh": scene.meshes(rig)[0],
        "other": bpy.context.object,
    }[item]
    bpy.context.view_layer.objects.active = chosen
    bpy.ops.object.mode_set(mode=state)
    scene.set_controls(rig, jawOpen=0.7, mouthCornerPullL=0.3)
    raw = scene.raw_of(rig, dna_file)
    assert scene.error_against_oracle(rig, dna_file, raw) < scene.TOLERANCE
    bpy.ops.object.mode_set(mode="OBJECT")


def test_the_overlay_tells_the_stages_of_the_last_frames(dna_file):
    timing = scene.submodule("scene.frame.timing")
    rigs = [scene.load(dna_file), scene.load(dna_file)]
    timing.frames.clear()
    timing.begin()
    assert timing.lines() == ["Risorius: no frame yet"]
    for rig in rigs:
        face = scene.face(rig)
        for frame, value in ((1, 0.0), (9, 1.0)):
            face["CTRL_expressions.jawOpen"] = value
            face.keyframe_insert('["CTRL_expressions.jawOpen"]', frame=frame)
    for frame in range(2, 8):
        bpy.context.scene.frame_set(frame)
    lines = timing.lines()
    assert lines[0].startswith("Risorius, faces: 2")
    assert [line.split()[0] for line in lines[2:6]] == ["controls", "rig", "bones", "shapes"]
    # The times are read from `timing.frames`, because the lines are rounded to 0.01 ms, and a
    # stage of a small face may take less than 0.005 ms.
    played = [frame for frame in timing.frames if frame.characters]
    assert len(played) == 6
    assert all(frame.stages[stage] > 0 for frame in played for stage in timing.STAGES)
    assert bpy.context.window_manager.risorius_show_timing is False


def test_times_of_a_frame_are_those_of_the_clock(monkeypatch):
    timing = scene.submodule("scene.frame.timing")
    clock = [10.0]
    monkeypatch.setattr(timing, "perf_counter", lambda: clock[0])
    timing.frames.clear()
    timing.begin()
    clock[0] = 10.001
    timing.animated()
    for start in (10.002, 10.020):  # for each of two characters, stages of 1, 2, 3 and 4 ms
        timing.add([start, start + 0.001, start + 0.003, start + 0.006, start + 0.010])
    clock[0] = 10.035
    timing.drawing_begins()
    clock[0] = 10.041
    timing.drawing_ends()
    frame = timing.frames[-1]
    assert [frame.stages[s] for s in timing.STAGES] == pytest.approx([2, 4, 6, 8])
    assert (frame.ours, frame.characters) == (pytest.approx(20), 2)
    assert (frame.animation, frame.deform, frame.drawing) == pytest.approx((1, 5, 6))
