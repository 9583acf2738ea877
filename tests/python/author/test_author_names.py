# SPDX-License-Identifier: MIT
"""Tests which controls or additional expressions a head's shapes become by their names."""

from __future__ import annotations

import command_line
import face_shapes
import numpy as np
import pytest
import risorius
from risorius import expressions
from risorius.author.input import matching, obj, said, shape_face
from risorius.controls import arkit

PREFIX = "CTRL_expressions."


def test_a_name_of_a_vocabulary_wins_over_a_word():
    found = matching.assign(["mouthOpen", "smile", "jawOpen", "mouthSmile_L"], {})
    assert found.controls["jawOpen"] == ["jawOpen"]
    assert found.controls["mouthSmile_L"] == ["mouthCornerPullL"]
    assert found.controls["mouthOpen"] == ["mouthOpen"]
    assert found.notes == [
        "jawOpen and mouthOpen both mean jawOpen: mouthOpen becomes a control of its own, "
        "mouthOpen; [controls] may say otherwise",
        "mouthSmile_L and smile both mean mouthCornerPullL and mouthCornerPullR: smile becomes a "
        "control of its own, smile; [controls] may say otherwise",
    ]


@pytest.mark.parametrize("before", ["", "blendShape1.", "Head|"])
def test_all_units_are_their_controls(before):
    spelled = {unit: unit.replace("Left", "_L").replace("Right", "_R") for unit in arkit.mapping()}
    names = {before + spelled[unit]: row for unit, row in arkit.mapping().items()}
    found = matching.assign(names, {})
    assert found.notes == []
    assert found.known == {"arkit": 52}
    for name, row in names.items():
        assert [PREFIX + control for control in found.controls[name]] == list(row)


def test_visemes_and_faces_become_expressions():
    found = matching.assign(["A", "Joy", "Blink", "Blink_L", "Blink_R", "Fcl_MTH_A", "お"], {})
    assert found.expressions == {
        "A": "aa",
        "Joy": "joy",
        "Blink": "blink",
        "Fcl_MTH_A": "Fcl_MTH_A",
        "お": "O",
    }
    assert found.controls["Blink_L"] == ["eyeBlinkL"]
    assert found.controls["お"] == ["O"]  # names that every reader of DNA files accepts
    assert found.controls["Joy"] == ["Joy"]
    assert found.notes == []
    assert matching.assign(["Blink"], {}).controls == {"Blink": ["eyeBlinkL", "eyeBlinkR"]}


def test_the_names_of_icts_head_are_all_known():
    # ICT's head has ARKit's shapes without tongueOut. It has browInnerUp and cheekPuff for each
    # side, and cheekRaiser and PupilDilate in addition.
    units = [u.replace("Left", "_L").replace("Right", "_R") for u in arkit.mapping()]
    names = [u for u in units if u not in ("browInnerUp", "cheekPuff", "tongueOut")]
    sided = ("browInnerUp", "cheekPuff", "cheekRaiser", "PupilDilate")
    names += [f"{name}_{side}" for name in sided for side in "LR"]
    found = matching.assign(names, {})
    assert sum(found.known.values()) == len(names) == 57
    assert found.controls["browInnerUp_L"] == ["browRaiseInL"]
    assert found.controls["cheekPuff_R"] == ["mouthCheekBlowR"]
    assert found.controls["PupilDilate_L"] == ["eyePupilWideL"]
    assert len(found.notes) == 2  # cheekRaiser is assigned to cheekSquint


@pytest.mark.parametrize(
    ("names", "words"),
    [
        (["jaw_open", "Jaw_Open"], "both mean jawOpen (their letters are the same): Jaw_Open beco"),
        (["mouthSmileLeft", "Mouth_Smile_L"], "mouthSmileLeft and Mouth_Smile_L both mean mouthCo"),
        (
            ["Key 1", "Key 2", "Key 3", "Key 4"],
            "no name is known of 4 shapes (Key 1, Key 2, Key 3, ...)",
        ),
        (
            ["viseme_aa", "viseme_PP", "hat"],
            "the 2 names known are of expressions and visemes: speech",
        ),
    ],
)
def test_odd_names_are_one_sentence(names, words):
    found = matching.assign(names, {})
    assert len(found.notes) == 1
    assert words in found.notes[0]
    given = [control for controls in found.controls.values() for control in controls]
    assert len(set(given)) == len(given)


@pytest.fixture(scope="module")
def authored(tmp_path_factory):
    """(folder, output of `author --names`, output of `author`) for an egg with foreign shapes."""
    folder = tmp_path_factory.mktemp("names") / "egg"
    path = face_shapes.write_all(folder, joints=8, more="rounds = 2\n[lods]\ncount = 1\n")
    positions, faces = face_shapes.head()
    lips = face_shapes.bump(positions, 0, -5, 4)[:, None]
    for name, way in (
        ("viseme_aa", [0, -1.0, 0]),
        ("Joy", [0, 1.0, 0]),
        ("Mouth_Funnel", [0, 0, 1.0]),
    ):
        face_shapes.write_obj(folder / "shapes" / f"{name}.obj", positions + lips * way, faces)
    names = command_line.run("author", path, "--names", text=True)
    assert names.returncode == 0, names.stderr
    done = command_line.run("author", path, "-o", folder / "egg.dna", "--exact", text=True)
    assert done.returncode == 0, done.stderr
    return folder, names.stdout, done.stdout


def test_the_command_tells_what_names_become(authored):
    folder, names, said = authored
    assert '"viseme_aa" = "@aa"' in names
    assert '"jawOpen" = "jawOpen"\n' in names
    assert "# 10 of 10 names are known: " in names
    assert f"{folder / 'egg_expressions'}: 2 expressions of the face itself" in said


def test_what_is_printed_says_the_same_when_it_is_read(authored):
    folder, names, _ = authored
    path = folder / "names.toml"
    path.write_text(names.replace('"@aa"', '"jawOpen"'), encoding="utf-8")
    again = command_line.run("author", folder / "spec.toml", "--names", path, text=True)
    assert said.parse(again.stdout) == said.parse(names) | {"viseme_aa": "viseme_aa"}
    assert said.parse(names)["Joy"] == "@joy"
    assert "# note: jawOpen and viseme_aa both mean jawOpen" in again.stdout


def test_a_person_says_units_expressions_and_nothing(tmp_path):
    path = tmp_path / "names.toml"
    told = {
        "Key 1": "=mouthFunnel",
        "Key 2": "@joy",
        "Blush 🌸": [],
        'a "b"\x7f': ["jawOpen", "CTRL_expressions.tongueOut"],
    }
    path.write_text(said.text_of(told), encoding="utf-8")
    assert said.read(path) == told
    found = matching.assign([*told, "Key 3", "eyeBlinkLeft", "smile"], said.read(path))
    assert found.controls["Key 1"] == [
        name.removeprefix(PREFIX) for name in arkit.mapping()["mouthFunnel"]
    ]
    assert (found.controls["Key 2"], found.expressions) == (["Key_2"], {"Key 2": "joy"})
    assert found.controls["Blush 🌸"] == []
    assert found.controls['a "b"\x7f'] == ["jawOpen", "tongueOut"]
    assert list(found.by.values()) == ["person"] * 4 + ["", "arkit", "words"]
    assert found.notes == []


def test_what_is_left_out_is_no_control():
    positions, faces = face_shapes.head()
    corners = [list(face) for face in faces]
    mesh = obj.ObjMesh(positions, np.zeros((0, 2)), corners, [[] for _ in corners])
    shapes = shape_face.ShapeSet("egg", mesh, face_shapes.expressions(positions))
    together = {"jawOpen+eyeBlinkLeft": shapes.expressions["jawOpen"]}
    became = matching.assign(shapes.expressions, {"jawOpen": []})
    dna = shape_face.make_shape_face(shapes, became.controls)
    assert PREFIX + "eyeBlinkL" in dna.raw_control_names
    assert len(dna.raw_control_names) == len(shapes.expressions) - 1
    rows = shape_face.combined_rows("", shapes, together, became.controls, dna.raw_control_names)
    assert rows == []
    with pytest.raises(ValueError, match="all are left out"):
        shape_face.make_shape_face(shapes, {name: [] for name in shapes.expressions})


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ('[controls]\na = "=smile"', "controls.a: an ARKit unit such as =jawOpen was expected"),
        ('[controls]\na = "@../b"', "controls.a: letters, digits, _ and - were expected"),
        ('[controls]\na = ["@joy", "jawOpen"]', "controls.a: an expression alone or controls"),
        ("[controls]\na = 3", "controls.a: text was expected"),
        ("a = 3", "a table [controls] was expected"),
        ("[controls", "names.toml"),
    ],
)
def test_a_file_of_names_that_says_nothing_is_one_sentence(content, words, tmp_path):
    path = tmp_path / "names.toml"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(ValueError, match="names.toml") as caught:
        said.read(path)
    assert words in str(caught.value)


def test_an_expression_of_the_face_moves_it(authored):
    folder, _, _ = authored
    library = expressions.load(folder / "egg_expressions")
    assert list(library) == ["aa", "joy"]
    assert (library["aa"].label, library["aa"].group) == (expressions.get("aa").label, "viseme")
    rig = risorius.Rig(risorius.load(folder / "egg.dna"))
    vector = expressions.pose_vector(library["joy"], rig.raw_control_names)
    assert vector.sum() == 1.0
    assert dict(library["joy"].weights) == {PREFIX + "Joy": 1.0}
    with pytest.raises(ValueError, match="a folder with expressions was expected"):
        expressions.load(folder / "shapes")


def test_a_unit_of_several_controls_is_what_captures_move(authored):
    folder, _, _ = authored
    assert set(arkit.mapping()["mouthFunnel"]) <= set(
        risorius.load(folder / "egg.dna").raw_control_names
    )


def test_a_place_that_cannot_be_written_is_told_before_the_work(authored):
    folder, _, _ = authored
    (folder / "no_expressions").write_text("a file")
    done = command_line.run("author", folder / "spec.toml", "-o", folder / "no.dna", text=True)
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1
    assert "no_expressions" in done.stderr
    assert not (folder / "no.dna").exists()
