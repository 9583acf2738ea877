# SPDX-License-Identifier: MIT
"""Tests the command `risorius clip`: output, written files, exit codes."""

from __future__ import annotations

import numpy as np
import pytest
from animation_files import COLUMNS, capture, live_link_face
from conftest import GOLDEN
from risorius import importing
from risorius.cli import main
from risorius.controls import arkit

RIG = "CTRL_expressions."


@pytest.fixture
def take(tmp_path):
    path = tmp_path / "take.csv"
    path.write_text(live_link_face(capture(90), 3600.0 + np.arange(90) / 30.0))
    return path


def run(*arguments):
    return main(["clip", *map(str, arguments)])


def test_converts_and_says_what_was_left_out(take, tmp_path, capsys):
    out = tmp_path / "out.csv"
    assert run("convert", take, "-o", out, "--rate", 60, "--rotations", "none") == 0
    controls = {control for row in arkit.mapping().values() for control in row}
    # 90 frames are 89 steps of 1/30 s, which equal 178 steps of 1/60 s between 179 frames.
    assert f"{len(controls)} controls, 179 frames, 60 fps" in capsys.readouterr().out
    clip = importing.read(out).clip
    direct, _ = importing.import_file(take, rotations="none")
    np.testing.assert_array_equal(clip.curves, direct.resampled(60.0).curves)


def test_does_what_is_asked_for_in_its_order(take, tmp_path):
    out = tmp_path / "out.json"
    options = ["--neutral", "0:2", "--gain", "jaw*=0.5", "--gain", "jawOpen=2", "--offset",
               "jawOpen=0.25", "--mirror", "--cut", "1:2", "--shift", "-1", "--smooth",
               "gaussian:0.02", "--fill-gaps"]  # fmt: skip
    assert run("convert", take, "-o", out, *options) == 0
    clip = importing.read(out).clip
    assert clip.start == pytest.approx(0.0, abs=1e-3)
    assert clip.duration == pytest.approx(1.0)
    process = importing.process
    want, _ = importing.import_file(take)
    want = process.calibrate(want, 0, 2)
    want = process.adjust(want, {"jaw*": 0.5, "jawOpen": 2.0}, {"jawOpen": 0.25})
    want = process.mirror(process.gaussian(process.fill_gaps(want), 0.02))
    want = process.cut(want, 1, 2)
    np.testing.assert_array_equal(clip.curves, want.curves)


def test_a_clip_of_its_own_goes_in_and_out(take, tmp_path, capsys):
    assert run("convert", take, "-o", tmp_path / "a.rzc") == 0
    assert run("info", tmp_path / "a.rzc") == 0
    assert "clip of Risorius, mapping controls" in capsys.readouterr().out
    assert run("convert", tmp_path / "a.rzc", "-o", tmp_path / "b.json", "--mirror") == 0
    direct, _ = importing.import_file(take)
    want = importing.process.mirror(direct)
    again = importing.read(tmp_path / "b.json").clip
    assert again.names == want.names
    np.testing.assert_array_equal(again.curves, want.curves)


def test_repeated_frames_are_dropped_before_gaps_are_filled(tmp_path):
    (tmp_path / "a.csv").write_text("time,jawOpen\n0,0\n0.1,0\n0.2,1\n0.3,0\n")
    assert run("convert", tmp_path / "a.csv", "-o", tmp_path / "b.csv", "--drop-repeats") == 0
    assert importing.read(tmp_path / "b.csv").clip.curves.tolist() == [[0, 1, 0]]
    options = ["--drop-repeats", "--fill-gaps"]
    assert run("convert", tmp_path / "a.csv", "-o", tmp_path / "b.csv", *options) == 0
    assert importing.read(tmp_path / "b.csv").clip.curves.tolist() == [[0, 0.5, 1, 0]]


def test_reports_by_name_and_keeps_to_the_rig(take, tmp_path, capsys):
    out = tmp_path / "out.csv"
    assert run("convert", take, "-o", out, "--rig", GOLDEN / "core.dna", "--report") == 0
    text = capsys.readouterr().out
    assert "not in the rig: " in text
    assert "RightEyeRoll" in text
    assert importing.read(out).clip.names == (
        RIG + "jawOpen", RIG + "browRaiseOuterL", "head.yaw", "head.pitch", "head.roll",
    )  # fmt: skip


def test_info_names_every_curve(take, capsys):
    assert run("info", take) == 0
    text = capsys.readouterr().out
    assert "Live Link Face CSV, mapping live_link_face" in text
    assert "timecode: 01:00:00:00.000" in text
    assert all(name in text for name in COLUMNS)


def test_mappings_are_listed_copied_and_checked(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run("mappings") == 0
    listed = capsys.readouterr().out
    assert all(name in listed for name in importing.mapping_names())
    assert run("mappings", "--write", "arkit") == 0
    assert (tmp_path / "arkit.toml").read_text() == importing.mapping_text("arkit")
    assert run("mappings", "--write", "arkit") == 2
    assert "it is there already" in capsys.readouterr().err
    (tmp_path / "m.toml").write_text('[rows]\na = { "CTRL_expressions.jawOpen" = 1.0 }\n')
    assert run("check", "m.toml", "--rig", GOLDEN / "core.dna") == 0
    assert run("check", "arkit", "--rig", GOLDEN / "core.dna") == 1
    assert "the rig has no control CTRL_expressions.browDownL" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "code", "sentence"),
    [
        (["convert", "none.csv", "-o", "a.csv"], 1, "none.csv: cannot read it"),
        (["convert", "take.csv", "-o", "a.txt"], 2, "a name ending in .rzc, .csv, .json"),
        (["convert", "take.csv", "-o", "take.csv"], 2, "itself: choose another name"),
        (
            ["convert", "take.csv", "-o", "a.csv", "--neutral", "x"],
            2,
            "--neutral: A:B was expected",
        ),
        (["convert", "take.csv", "-o", "a.csv", "--cut", "2:1"], 2, "0 <= A <= B was expected"),
        (["convert", "take.csv", "-o", "a.csv", "--gain", "jaw"], 2, "PATTERN=NUMBER was expected"),
        (["convert", "take.csv", "-o", "a.csv", "--smooth", "hard:1"], 2, "gaussian:SECONDS"),
        (["convert", "take.csv", "-o", "a.csv", "--rate", "0"], 2, "--rate: 0.01 to 1e+06"),
        (["convert", "take.csv", "-o", "a.csv", "--neutral", "900"], 1, "frames from 0 to 89"),
        (["convert", "take.csv", "-o", "a.csv", "--mapping", "no.toml"], 1, "no.toml: cannot read"),
        (
            ["convert", "take.csv", "-o", "a.csv", "--mapping", "gui"],
            1,
            "a.csv|give the rig|mapping",
        ),
        (["mappings", "--write", "nothing"], 2, "one of arkit"),
    ],
)
def test_ends_with_one_sentence(take, tmp_path, capsys, monkeypatch, arguments, code, sentence):
    monkeypatch.chdir(tmp_path)
    assert run(*arguments) == code
    error = capsys.readouterr().err
    assert error.startswith("risorius: ")
    assert error.count("\n") == 1
    assert sentence.split("|")[-1] in error
    assert not (tmp_path / "a.csv").exists()


def test_a_curve_table_is_what_unreal_imports(take, tmp_path, capsys):
    rows, table = tmp_path / "curves.csv", tmp_path / "curves.json"
    for out in (rows, table):
        assert run("convert", take, "-o", out, "--curve-table", "--rotations", "none") == 0
    direct, _ = importing.import_file(take, rotations="none")
    lines = [line.split(",") for line in rows.read_text().splitlines()]
    names = [name.replace(".", "_") for name in direct.names]
    assert lines[0][0] == "---"
    assert [line[0] for line in lines[1:]] == names
    assert "CTRL_expressions_jawOpen" in names
    np.testing.assert_allclose(np.array(lines[0][1:], float), direct.frame_times(), atol=1e-6)
    np.testing.assert_array_equal(np.array([x[1:] for x in lines[1:]], np.float32), direct.curves)
    back = importing.read(table).clip
    assert list(back.names) == names
    np.testing.assert_allclose(back.curves, direct.curves, atol=1e-6)
    assert run("convert", take, "-o", tmp_path / "c.rzc", "--curve-table") == 2
    assert "a curve table, a name ending in .csv or .json" in capsys.readouterr().err
