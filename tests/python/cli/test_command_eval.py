# SPDX-License-Identifier: MIT
"""Tests the command `risorius eval` for the pose of given control values."""

import json

import numpy as np
import pytest
import risorius
from conftest import GOLDEN
from risorius.cli import main
from risorius.cli.eval import ATTRIBUTES

FILE = str(GOLDEN / "core.dna")
JAW = "CTRL_expressions.jawOpen"


def test_json_is_the_pose(capsys):
    assert main(["eval", FILE, f"{JAW}=0.75", "--lod", "1", "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    rig = risorius.Rig(risorius.load(FILE))
    raw = np.zeros(4, np.float32)
    raw[rig.raw_control_names.index(JAW)] = 0.75
    pose = rig.evaluate(raw, lod=1)
    joints = np.zeros_like(pose.joints)
    for row in facts["joints"]:
        joints[row["index"]] = [row[a] for a in ATTRIBUTES]
    np.testing.assert_array_equal(joints, pose.joints)
    maps = np.zeros_like(pose.animated_maps)
    for row in facts["animated_maps"]:
        maps[row["index"]] = row["value"]
    np.testing.assert_array_equal(maps, pose.animated_maps)
    assert facts["raw_controls"] == [
        {"name": JAW, "index": rig.raw_control_names.index(JAW), "value": 0.75}
    ]
    assert facts["lod"] == 1


def test_page_names_what_moves(capsys):
    assert main(["eval", FILE, f"{JAW}=1"]) == 0
    page = capsys.readouterr().out
    assert "FACIAL_R_Eye2" in page
    assert "shape_jawOpen" in page


def test_the_page_has_no_rounding_noise(tmp_path, capsys):
    dna = risorius.Dna()
    dna.lod_count = 1
    dna.raw_control_names, dna.joint_names, dna.joint_parents = ["open"], ["jaw", "still"], [0, 0]
    dna.neutral_joint_translations = dna.neutral_joint_rotations = np.zeros((2, 3))
    dna.joint_groups = [
        risorius.JointGroup(
            lods=[3], input_indices=[0], output_indices=[0, 1, 10],
            values=[[0.25], [3.9e-17], [3.9e-17]],
        )
    ]  # fmt: skip
    dna.save(tmp_path / "face.dna")
    arguments = ["eval", str(tmp_path / "face.dna"), "open=1"]
    assert main(arguments) == 0
    text = capsys.readouterr().out
    joints = text.partition("joints, as difference from the neutral pose")[2].splitlines()
    assert "added to 1" in joints[0]
    assert [line.split() for line in joints[2:]] == [["jaw", "0.25", *"00000000"]]
    assert main([*arguments, "--json"]) == 0
    jaw, still = json.loads(capsys.readouterr().out)["joints"]
    assert jaw["ty"] == still["ty"] == 3.9e-17


def test_gui_controls_go_through_the_table(capsys):
    name = risorius.load(FILE).gui_control_names[2]
    assert main(["eval", FILE, "--gui", f"{name}=1", "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    rig = risorius.Rig(risorius.load(FILE))
    raw = rig.gui_to_raw([0, 0, 1])
    assert {r["index"]: r["value"] for r in facts["raw_controls"]} == {
        i: float(raw[i]) for i in np.flatnonzero(raw)
    }


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["jawOpn=1"], JAW),
        (["brow=1"], "any of"),
        ([JAW], "NAME=VALUE"),
        ([f"{JAW}=wide"], "wide"),
        ([f"{JAW}=nan"], "nan"),
        ([f"{JAW}=1e99"], "1e99"),
        (["--lod", "2"], "--lod"),
        (["--lod", "-1"], "--lod"),
    ],
)
def test_bad_command_line_is_exit_code_2(capsys, arguments, message):
    assert main(["eval", FILE, *arguments]) == 2
    output = capsys.readouterr()
    assert message in output.err
    assert output.out == ""


def test_bad_input_is_exit_code_1(tmp_path, capsys):
    bad = tmp_path / "bad.dna"
    bad.write_bytes(b"not a face")
    assert main(["eval", str(bad)]) == 1
    assert main(["eval", str(tmp_path / "absent.dna")]) == 1
    assert capsys.readouterr().out == ""


def test_every_layer_of_the_newest_version_is_evaluated(capsys):
    assert main(["eval", str(GOLDEN / "tiny_v28.dna")]) == 0
    assert "not evaluated" not in capsys.readouterr().err


def test_layers_that_are_not_evaluated_are_named(capsys, tmp_path):
    data = bytearray((GOLDEN / "tiny_v28.dna").read_bytes())
    data[data.index(b"rbfb") : data.index(b"rbfb") + 4] = b"new1"
    (tmp_path / "new.dna").write_bytes(data)
    assert main(["eval", str(tmp_path / "new.dna")]) in (0, 1)
    assert "new1" in capsys.readouterr().err


def test_options_may_stand_among_the_controls(capsys):
    assert main(["eval", FILE, "--lod", "1", f"{JAW}=0.5", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["raw_controls"][0]["value"] == 0.5
    with pytest.raises(SystemExit, match="2"):
        main(["eval", FILE, f"{JAW}=0.5", "--unknown"])
    with pytest.raises(SystemExit, match="2"):
        main(["info", FILE, "more"])
