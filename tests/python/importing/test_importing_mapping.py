# SPDX-License-Identifier: MIT
"""Tests mappings of curves: valid content, matching of names, reports."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest
import risorius
from conftest import GOLDEN
from risorius import Clip, expressions, importing
from risorius.controls import arkit
from risorius.importing.mapping import Mapping, apply_rows, loose_name, parse_mapping

RIG = "CTRL_expressions."


def mapped(text, curves, **options):
    clip = Clip(list(curves), [[v, v] for v in curves.values()], 30.0)
    return importing.Imported(clip, "csv", "", "take").apply(
        parse_mapping(text, "m.toml"), **options
    )


def test_rows_weigh_and_add_up_and_controls_adjust():
    text = """
        prefix = "CTRL_expressions."
        [rows]
        smile = { mouthCornerPullL = 1.0, mouthCornerPullR = 0.5 }
        grin = { mouthCornerPullL = 0.25 }
        [controls]
        "mouth*" = { gain = 2.0, offset = 0.125 }
        "mouthCornerPullR" = { curve = [[0.0, 0.0], [0.25, 0.75], [1.0, 1.0]] }
    """
    clip, report = mapped(text, {"smile": 0.5, "grin": 0.5, "other": 0.0})
    assert clip.curve(RIG + "mouthCornerPullL").tolist() == [1.375, 1.375]  # 2 (.5 + .125) + .125
    assert clip.curve(RIG + "mouthCornerPullR").tolist() == [0.75, 0.75]
    assert report.unmapped == ["other"]
    assert report.always_zero == ["other"]
    assert report.mapped["smile"] == (RIG + "mouthCornerPullL", RIG + "mouthCornerPullR")


@pytest.mark.parametrize(
    "name",
    ["eyeBlinkLeft", "EyeBlinkLeft", "eyeBlink_L", "eyeBlinkL", "eye_blink_left", "EYE_BLINK_LEFT",
     "Eye Blink Left", "eyeBlink.L", "eyeBlink_l"],
)  # fmt: skip
def test_spellings_of_one_shape(name):
    assert loose_name(name) == "eyeblink|l"


def test_no_two_units_are_one_name():
    assert len({loose_name(unit) for unit in arkit.mapping()}) == 52
    assert {loose_name("jawLeft"), loose_name("jaw_left")} == {"jaw|l"}


def test_arkits_rows_are_those_of_arkit_toml():
    rows = importing.load_mapping("arkit").rows
    assert {unit: rows[unit] for unit in arkit.mapping()} == arkit.mapping()


def test_bits_pass_where_nothing_is_to_be_done():
    bits = np.array([[0x7FC12345, 0x80000000, 0x00000001]], np.uint32).view(np.float32)
    found = apply_rows(importing.load_mapping("controls"), Clip(["CTRL_expressions_a"], bits))
    assert found.clip.names == ("CTRL_expressions.a",)
    assert found.clip.curves.view(np.uint32).tolist() == bits.view(np.uint32).tolist()


def test_expressions_and_both_sides_in_a_row():
    text = """
        prefix = "CTRL_expressions."
        [rows]
        pp = "PP"
        half = { "@PP" = 0.5, jawOpen = 0.25 }
        smile = { "mouthCornerPull*" = 0.5, "mouthPress**" = 0.25 }
    """
    rows = parse_mapping(text, "m").rows
    pose = expressions.get("PP").weights
    assert rows["pp"] == dict(pose)
    assert rows["half"] == {k: 0.5 * w + 0.25 * (k == RIG + "jawOpen") for k, w in pose.items()}
    assert rows["smile"] == {
        **{RIG + "mouthCornerPull" + side: 0.5 for side in "LR"},
        **{RIG + "mouthPress" + quarter: 0.25 for quarter in ("UL", "UR", "DL", "DR")},
    }


def test_a_pattern_stands_for_many():
    text = 'matching = "exact"\n[rows]\n"face_*_w" = { "CTRL_expressions.*" = 2.0 }'
    clip, report = mapped(text, {"face_jawOpen_w": 0.5, "face__w": 1.0, "face_w": 1.0})
    assert clip.curve(RIG + "jawOpen").tolist() == [1.0, 1.0]
    assert report.unmapped == ["face_w"]


def test_lips_that_a_capture_shuts_are_the_whole_share_of_its_jaw():
    """If lips are shut, mouthClose equals jawOpen, so mouthLipsTogether, their quotient, is 1."""
    jaw = [0.5, 0.5, 0.5, 0.0, 0.01, 0.01, 0.3]
    close = [0.5, 0.25, 0.7, 0.0, 0.005, 0.02, -0.1]
    take = importing.Imported(Clip(["JawOpen", "MouthClose"], [jaw, close], 30.0), "csv", "", "a")
    clip, _ = take.apply("live_link_face")
    lips = [RIG + "mouthLipsTogether" + quarter for quarter in ("UL", "UR", "DL", "DR")]
    for name in lips:
        # If the jaw is open by less than 0.02, the quotient is faded to 0, because a quotient of
        # noise would jump between 0 and 1.
        np.testing.assert_allclose(clip.curve(name), [1, 0.5, 1, 0, 0.25, 1, 0], atol=1e-6)
    np.testing.assert_allclose(clip.curve(RIG + "jawOpen"), jaw, atol=1e-6)
    # A mapping's gain of the jaw does not open shut lips, because the quotient is formed before
    # the gain; mouthLipsTogether has its own gain.
    own = '[controls]\n"jaw*" = { gain = 2.0 }\n"mouthLipsTogether??" = { gain = 0.5 }'
    clip, _ = take.apply(parse_mapping('base = "arkit"\n' + own, "m"))
    np.testing.assert_allclose(clip.curve(lips[0])[:2], [0.5, 0.25])
    np.testing.assert_allclose(clip.curve(RIG + "jawOpen")[0], 1.0)
    # A mapping can switch off the division by jawOpen; without a curve of the jaw, mouthClose is
    # not divided either.
    none = 'base = "arkit"\nprefix = "CTRL_expressions."\n[shares]\n"mouthLipsTogether**" = ""'
    clip, _ = take.apply(parse_mapping(none, "m"))
    np.testing.assert_allclose(clip.curve(lips[3]), close)
    alone, _ = mapped('base = "arkit"', {"mouthClose": 0.25})
    assert alone.curve(lips[0]).tolist() == [0.25, 0.25]


def test_lips_that_are_shut_at_two_keys_are_shut_between_them():
    keys = {"jawOpen": ([0.0, 1.0], [0.0, 0.5]), "mouthClose": ([0.0, 1.0], [0.0, 0.5])}
    clip, _ = importing.import_curves(keys)
    jaw, lips = clip.curve(RIG + "jawOpen"), clip.curve(RIG + "mouthLipsTogetherUL")
    at = np.linspace(0, 1, 400)
    straight = np.interp(at, clip.frame_times(), jaw)
    parted = straight * (1 - np.interp(at, clip.frame_times(), lips))
    np.testing.assert_allclose(straight, 0.5 * at, atol=1e-6)
    assert parted.max() < 0.006  # of the jaw's motion: 0.2 mm of 35 mm
    assert clip.frame_times()[[0, -1]].tolist() == [0, 1]


def test_a_curve_that_comes_twice_is_taken_once_and_said():
    clip, report = mapped('base = "arkit"', {"jawOpen": 0.5, "JawOpen": 0.25})
    assert clip.curve(RIG + "jawOpen").tolist() == [0.5, 0.5]
    assert "JawOpen is jawOpen again, left out" in report.notes
    assert report.ignored == ["JawOpen"]


def test_a_mesh_before_the_name_says_nothing():
    clip, _ = mapped('base = "arkit"', {"Face.jawOpen": 0.5})
    assert clip.names == (RIG + "jawOpen",)


def test_shape_keys_of_another_rigs_action():
    curves = {
        "Key.eyeBlink_L": ([0.0, 1.0], [0.0, 1.0]),
        "jawOpen": ([0.5], [0.25]),
        "Hat": ([0.0, 1.0], [0.0, 0.0]),
    }
    clip, report = importing.import_curves(curves, [RIG + "eyeBlinkL"], source="Talk")
    np.testing.assert_allclose(clip.frame_times(), [0, 0.5, 1])
    assert clip.curve(RIG + "eyeBlinkL").tolist() == [0, 0.5, 1]
    assert (report.unmapped, report.not_in_rig) == (["Hat"], [RIG + "jawOpen"])
    for bad in ({"a": ([0, 0], [1, 1])}, {"a": ([0], [1, 2])}, {"a": ([0], [np.nan])}, {}):
        with pytest.raises(ValueError, match="expected"):
            importing.import_curves(bad)


def test_gui_curves_go_through_the_rigs_own_table():
    class Rig:
        gui_control_names = ["CTRL_C_jaw.ty", "CTRL_C_jaw.tx"]
        raw_control_names = [RIG + "jawOpen", RIG + "jawLeft", RIG + "jawRight"]

        def gui_to_raw(self, gui):
            return np.float32([gui[0], max(-gui[1], 0), max(gui[1], 0)])

    clip = Clip(["CTRL_C_jaw.ty", "CTRL_C_jaw.tx", "CTRL_C_ear.ty"], [[0, 1], [-1, 0], [1, 1]], 30)
    found = importing.Imported(clip, "csv", importing.best_mapping(clip.names) or "", "take")
    assert found.mapping == "gui"
    out, report = found.apply(rig=Rig())
    assert out.names == (RIG + "jawOpen", RIG + "jawLeft")
    assert out.curves.tolist() == [[0, 1], [1, 0]]
    assert report.not_in_rig == ["CTRL_C_ear.ty"]
    with pytest.raises(ValueError, match="give the rig"):
        found.apply()


def test_gui_curves_and_a_real_rig():
    dna = risorius.load(GOLDEN / "core.dna")
    rig = risorius.Rig(dna)
    names = dna.gui_control_names
    values = np.linspace(0, 1, 5 * len(names), dtype=np.float32).reshape(len(names), 5)
    mapping = parse_mapping('gui = true\n[rows]\n"GUI_*" = { "GUI_*" = 1.0 }', "m")
    clip, _ = importing.Imported(Clip(names, values, 30), "csv", "", "a").apply(mapping, rig=rig)
    raw, unknown = clip.raw_controls(dna.raw_control_names)
    assert unknown == []
    for frame, gui in zip(raw, values.T, strict=True):
        np.testing.assert_array_equal(frame, rig.gui_to_raw(np.ascontiguousarray(gui)))
    assert raw.any()


@pytest.mark.parametrize(
    ("names", "mapping"),
    [
        (["eyeBlinkLeft", "jawOpen"], "arkit"),
        (["EyeBlinkLeft", "HeadYaw"], "live_link_face"),
        (["CTRL_expressions_jawOpen", "x"], "controls"),
        (["viseme_PP", "viseme_aa"], "oculus"),
        (["MBP", "rest", "etc"], "papagayo"),
        (["bone", "hat"], None),
    ],
)
def test_names_choose_their_mapping(names, mapping):
    assert importing.best_mapping(names) == mapping


def test_no_mapping_is_one_sentence():
    found = importing.Imported(Clip(["hat"], [[0]], 30), "csv", "", "a.csv")
    with pytest.raises(ValueError, match=r"a.csv: no mapping knows any of its 1 curves \(hat"):
        found.apply()


@pytest.mark.parametrize("name", importing.mapping_names())
def test_every_mapping_can_be_copied_and_edited(name, tmp_path):
    text = importing.mapping_text(name)
    assert tomllib.loads(text)["name"] == name
    assert text.startswith("# SPDX")
    path = tmp_path / "mine.toml"
    path.write_text(text)
    assert importing.load_mapping(path) == importing.load_mapping(name)
    assert importing.load_mapping(name).description


def test_check_names_what_a_rig_lacks():
    mapping = Mapping("m", rows={"a": {RIG + "jawOpen": 1.0, RIG + "jawUp": 1.0, "head.yaw": 1.0}})
    assert importing.check(mapping, [RIG + "jawOpen"]) == [
        "rows.a: the rig has no control CTRL_expressions.jawUp"
    ]
    mapping = parse_mapping('[controls]\n"jaw*" = { gain = 1.0 }\n"ear*" = { gain = 1.0 }', "m")
    assert importing.check(mapping, [RIG + "jawOpen"]) == [
        "controls.ear*: fits no control of the rig"
    ]


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("[rows\n", r"m.toml: no TOML: .*line 1"),
        ("colour = 1", "colour: one of .* was expected"),
        ("name = 1", "name: text was expected, found 1"),
        ('base = "nothing"', "base: one of .* was expected, found nothing"),
        ('matching = "near"', "matching: loose or exact was expected, found 'near'"),
        ("rows = 1", "rows: a table was expected, found 1"),
        ("[rows]\na = 1", r"rows.a: .* was expected, found 1"),
        ("[rows]\na = { b = true }", "rows.a.b: a number was expected, found True"),
        ("[rows]\na = { b = nan }", "rows.a.b: a finite number was expected, found nan"),
        (
            '[rows]\na = { "*b" = 1.0 }',
            r"rows.a: a \* was expected at the end of a control, or in both",
        ),
        ('[rows]\na = "nosuch"', "rows.a.@nosuch: nosuch: an expression such as .* was expected"),
        ('[rows]\n"a*b*" = { c = 1.0 }', r"rows.a\*b\*: one \* at most was expected"),
        ("strip = 3", "strip: a list of names was expected"),
        ("[shares]\na = 1", "shares.a: a control was expected, found 1"),
        ('[shares]\na = "b"\nb = "c"', "shares.a: a control that is no share .*, found b"),
        ("[controls]\na = { gian = 1 }", "controls.a: gain, offset, curve were expected"),
        ("[controls]\na = { curve = [[1, 2]] }", "controls.a.curve: two or more ascending"),
        ("[controls]\na = { curve = [1] }", r"controls.a.curve: a list of \[value, result\]"),
        (
            'base = "arkit"\n[rows]\nJawOpen = { a = 1.0 }',
            "rows: jawOpen is in the base with another",
        ),
    ],
)
def test_a_mapping_that_does_not_hold_together_is_one_sentence(text, sentence):
    with pytest.raises(importing.MappingError, match=sentence) as caught:
        parse_mapping(text, "m.toml")
    assert "\n" not in str(caught.value)


def test_a_mapping_that_is_not_there_names_those_that_are(tmp_path):
    with pytest.raises(importing.MappingError, match="cannot read it.*built in: arkit"):
        importing.load_mapping(tmp_path / "no.toml")


def test_a_take_and_the_live_stream_turn_the_same_way():
    """The mapping for files and the live decoder, separate code, give angles the same signs."""
    from risorius.live import livelink

    rows = importing.load_mapping("live_link_face").rows
    signs = dict(zip(livelink.NAMES, livelink._SIGNS.tolist(), strict=True))
    for row in rows.values():
        for control, weight in row.items():
            if control in signs:
                assert signs[control] == weight, control


def test_rows_of_ones_own_go_over_any_mapping(tmp_path):
    path = tmp_path / "mine.toml"
    rows = {'Key "1"': {"CTRL_expressions.jawOpen": 0.5}, "Key 2": {"@PP": 1.0}, "hat": {}}
    path.write_text(importing.mapping_with("arkit", rows), encoding="utf-8")
    mine = importing.load_mapping(path)
    assert mine.rows['Key "1"'] == {"CTRL_expressions.jawOpen": 0.5}
    assert mine.rows["Key 2"] == dict(risorius.expressions.get("PP").weights)
    assert mine.rows["hat"] == {}
    assert mine.rows["eyeBlinkLeft"] == importing.load_mapping("arkit").rows["eyeBlinkLeft"]
    more = '[controls]\n"*Blink*" = { gain = 2, curve = [[0.0, 0.1], [1, 1.5]] }\n'
    path.write_text(path.read_text(encoding="utf-8") + more, encoding="utf-8")
    text = importing.mapping_with(str(path), {"hat": {"CTRL_expressions.earUpL": 1.0}})
    again = importing.mapping.parse_mapping(text, "again")
    assert again.rows["hat"] == {"CTRL_expressions.earUpL": 1.0}
    assert again.rows["Key 2"] == mine.rows["Key 2"]
    assert again.controls == importing.load_mapping(path).controls != {}
    bare = importing.mapping.parse_mapping(importing.mapping_with("", {"a": {"b.c": 1.0}}), "bare")
    assert bare.rows == {"a": {"b.c": 1.0}}
    with pytest.raises(importing.MappingError, match="nowhere"):
        importing.mapping_with(str(tmp_path / "nowhere.toml"), rows)
