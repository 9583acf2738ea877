# SPDX-License-Identifier: MIT
"""Tests that values in other scales, and head rotations in degrees, are refused.

The error asks for the option of the import that converts them.
"""

from __future__ import annotations

import json

import numpy as np
import pytest
from animation_files import COLUMNS, SHAPES, capture, live_link_face
from conftest import GOLDEN
from risorius import Clip, importing
from risorius.cli import main

JAW = "CTRL_expressions.jawOpen"
SOME = np.array([0.0, 0.25, 1.0, 0.5])


def convert(tmp_path, name, text, *options):
    path, out = tmp_path / name, tmp_path / "out.rzc"
    path.write_text(text)
    code = main(["clip", "convert", str(path), "-o", str(out), *options])
    return code, (Clip.load(out) if code == 0 else None)


def table(values, name="jawOpen"):
    return f"time,{name}\n" + "".join(f"{i / 30:.4f},{v:g}\n" for i, v in enumerate(values))


def frames(values):
    return json.dumps({"fps": 30, "frames": [{"jawOpen": float(v)} for v in values]})


def matrix(values):
    return json.dumps({"fps": 30, "names": ["jawOpen"], "frames": [[float(v)] for v in values]})


def keys(values):
    rows = {"Name": "jawOpen", **{f"{i / 30:.4f}": float(v) for i, v in enumerate(values)}}
    return json.dumps([rows])


@pytest.mark.parametrize("form", [table, frames, matrix, keys])
@pytest.mark.parametrize("full", [100.0, 255.0])
def test_values_far_above_1_are_asked_about_in_every_reader(tmp_path, form, full, capsys):
    name = "take.csv" if form is table else "take.json"
    assert convert(tmp_path, name, form(SOME * full))[0] == 1
    assert not (tmp_path / "out.rzc").exists()
    said = capsys.readouterr().err
    assert f"1 was expected for a whole movement, found {JAW} at {full:g}" in said
    assert f"(clip convert --full-value {full:g}; Full Value in Blender" in said
    code, clip = convert(tmp_path, name, form(SOME * full), "--full-value", f"{full:g}")
    assert code == 0
    np.testing.assert_allclose(clip.curve(JAW), SOME, atol=1e-6)
    code, clip = convert(tmp_path, name, form(SOME * full), "--full-value", "1")
    np.testing.assert_allclose(clip.curve(JAW), SOME * full, atol=1e-5)


def test_overdrive_is_no_other_scale(tmp_path):
    code, clip = convert(tmp_path, "take.csv", table(SOME * 3))
    assert code == 0
    assert clip.curve(JAW).max() == 3.0


def test_a_head_in_degrees_is_asked_about_beside_weights_in_per_cent(tmp_path, capsys):
    values = capture(40)
    angles = np.array([name not in SHAPES for name in COLUMNS])
    text = live_link_face(
        np.where(angles, np.degrees(values), 100.0 * values), 900.0 + np.arange(40) / 30
    )
    assert convert(tmp_path, "take.csv", text)[0] == 1
    said = capsys.readouterr().err
    assert "--full-value 100" in said
    assert "radians were expected, found head." in said
    assert "(clip convert --angles degrees; Angles in Blender" in said
    options = ("--full-value", "100", "--angles", "degrees", "--rotations", "all")
    code, clip = convert(tmp_path, "take.csv", text, *options)
    want, _ = importing.import_file(
        write(tmp_path, live_link_face(values, 900.0 + np.arange(40) / 30)), rotations="all"
    )
    assert (code, clip.names) == (0, want.names)
    np.testing.assert_allclose(clip.curves, want.curves, atol=1e-6)
    _, kept = convert(tmp_path, "take.csv", text, "--full-value", "100", "--angles", "radians")
    yaw = values[:, COLUMNS.index("HeadYaw")]
    np.testing.assert_allclose(kept.curve("head.yaw"), -np.degrees(yaw), rtol=1e-6)


def write(tmp_path, text):
    path = tmp_path / "in_radians.csv"
    path.write_text(text)
    return path


def test_angles_that_are_left_out_are_not_asked_about(tmp_path):
    values = np.where(np.array([n in SHAPES for n in COLUMNS]), capture(40), 30.0)
    text = live_link_face(values, 900.0 + np.arange(40) / 30)
    assert convert(tmp_path, "take.csv", text, "--rotations", "none")[0] == 0


def test_a_mapping_that_brings_per_cent_down_is_believed(tmp_path):
    mapping = tmp_path / "mine.toml"
    mapping.write_text('base = "arkit"\n[controls]\n"*" = { gain = 0.01 }\n')
    code, clip = convert(tmp_path, "take.csv", table(SOME * 100), "--mapping", str(mapping))
    assert code == 0
    np.testing.assert_allclose(clip.curve(JAW), SOME, atol=1e-6)


def test_a_clip_of_risorius_may_hold_any_value(tmp_path):
    Clip([JAW], [[0.0, 90.0]], 30.0).save(tmp_path / "mine.rzc")
    out = tmp_path / "out.csv"
    assert main(["clip", "convert", str(tmp_path / "mine.rzc"), "-o", str(out)]) == 0


def test_a_face_is_not_evaluated_with_another_scale(tmp_path, capsys):
    (tmp_path / "take.csv").write_text(table(SOME * 100))
    out = tmp_path / "out.npz"
    code = main(["eval", str(tmp_path / "take.csv"), str(GOLDEN / "core.dna"), "-o", str(out)])
    assert code == 1
    assert not out.exists()
    assert "1 was expected for a whole movement" in capsys.readouterr().err


def test_options_that_make_no_sense(tmp_path, capsys):
    assert convert(tmp_path, "take.csv", table(SOME), "--full-value", "-1")[0] == 2
    assert "--full-value: more than 0 was expected, found '-1'" in capsys.readouterr().err
    for options in ({"full_value": float("nan")}, {"angles": "turns"}):
        with pytest.raises(ValueError, match="was expected, found"):
            importing.import_file(tmp_path / "take.csv", **options)
