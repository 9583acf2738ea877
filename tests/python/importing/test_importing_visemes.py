# SPDX-License-Identifier: MIT
"""Tests viseme tracks of Rhubarb, Papagayo and Moho, and the curves made of them."""

from __future__ import annotations

import numpy as np
import pytest
from animation_files import (
    moho_dat,
    papagayo_pgo,
    papagayo_pgo_json,
    rhubarb_json,
    rhubarb_tsv,
    rhubarb_xml,
)
from risorius import importing
from risorius.cli import main
from risorius.importing.visemes import Cue, flowing_curves

RIG = "CTRL_expressions."
CUES = [(0.0, 0.05, "X"), (0.05, 0.27, "D"), (0.27, 0.31, "C"), (0.31, 0.43, "B"), (0.43, 0.5, "X")]


def read(tmp_path, text, name="cues", **options):
    path = tmp_path / name
    path.write_bytes(text.encode())
    return importing.read(path, **options)


@pytest.mark.parametrize("write", [rhubarb_tsv, rhubarb_xml, rhubarb_json])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_rhubarbs_three_forms_are_one_track(tmp_path, write, end):
    found = read(tmp_path, write(CUES).replace("\n", end))
    assert (found.kind, found.mapping) == ("rhubarb", "rhubarb")
    assert [(e.time, e.name, e.value) for e in found.clip.events] == [
        (start, "viseme", shape) for start, _, shape in CUES
    ]
    np.testing.assert_allclose([e.duration for e in found.clip.events], [b - a for a, b, _ in CUES])
    assert found.clip.duration == 0.5
    assert found.clip.rate == 60.0


@pytest.mark.parametrize("write", [papagayo_pgo, papagayo_pgo_json, moho_dat])
def test_papagayo_and_moho_give_one_track(tmp_path, write):
    found = read(tmp_path, write(), rate=24.0 if write is moho_dat else None)
    assert found.mapping == "papagayo"
    marks = [(round(e.time * 24), e.value) for e in found.clip.events if e.name == "viseme"]
    # Moho writes a rest twice, at both ends of a pause; only the first is compared.
    marks = [mark for i, mark in enumerate(marks) if i == 0 or mark[1] != marks[i - 1][1]]
    assert marks == [
        (0, "rest"), (6, "AI"), (9, "L"), (13, "O"), (18, "rest"), (24, "MBP"), (28, "O"),
        (36, "rest"),
    ]  # fmt: skip
    words = [(e.value, e.time * 24) for e in found.clip.events if e.name == "word"]
    assert words == ([] if write is moho_dat else [("hello", 6.0), ("bob", 24.0)])


def test_a_dat_without_a_rate_says_what_was_assumed(tmp_path):
    found = read(tmp_path, moho_dat())
    assert any("24 were assumed" in note for note in found.notes)
    faster = read(tmp_path, moho_dat().replace("MohoSwitch1\n", "MohoSwitch1\nFPS 48\n"))
    assert faster.clip.events[1].time == 0.5 * found.clip.events[1].time


def test_the_weights_are_half_cosines_around_each_border():
    cues = [Cue(0.0, 1.0, "A"), Cue(1.0, 2.0, "D"), Cue(2.0, 3.0, "A")]
    at = np.arange(0.0, 3.01, 0.01)
    names, weights = flowing_curves(cues, at, blend=0.2)
    assert names == ["A", "D"]
    up = 0.5 - 0.5 * np.cos(np.pi * np.clip((at - 0.9) / 0.2, 0, 1))
    down = 0.5 - 0.5 * np.cos(np.pi * np.clip((at - 1.9) / 0.2, 0, 1))
    np.testing.assert_allclose(weights[1], up * (1 - down), atol=1e-12)
    np.testing.assert_allclose(weights.sum(axis=0), 1.0, atol=1e-12)


def test_a_short_closed_mouth_closes_and_a_short_weak_one_gives_way():
    for shape, least, most in (("MBP", 1.0 - 1e-9, 1.0 + 1e-9), ("etc", 0.3, 0.9)):
        cues = [Cue(0, 0.5, "AI"), Cue(0.5, 0.56, shape), Cue(0.56, 1, "O")]
        at = np.array([0.53])
        names, weights = flowing_curves(cues, at, blend=0.16)
        assert least <= weights[names.index(shape), 0] <= most


def test_random_tracks_add_up_to_one_everywhere():
    rng = np.random.default_rng(2)
    ends = np.cumsum(rng.exponential(0.07, 400))
    shapes = rng.choice(list("ABCDEFGHX"), 400)
    cues = [Cue(a, b, s) for a, b, s in zip([0, *ends[:-1]], ends, shapes, strict=True)]
    _, weights = flowing_curves(cues, np.arange(0, ends[-1], 1 / 60))
    np.testing.assert_allclose(weights.sum(axis=0), 1.0, atol=1e-9)
    assert weights.min() >= 0.0


def test_the_mouth_opens_where_the_cue_says(tmp_path):
    clip, report = read(tmp_path, rhubarb_tsv(CUES)).apply()
    peak = clip.frame_times()[int(np.argmax(clip.curve(RIG + "jawOpen")))]
    assert 0.09 < peak < 0.25
    assert report.unmapped == []
    assert report.ignored == ["X"]


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("0.00\tX\n0.30\tQ\n", r"line 2: a time, a tab and a shape A-H or X were expected, found"),
        ("0.50\tA\n0.30\tB\n0.9\tX\n", "line 2: times that ascend from 0 were expected, found 0.3"),
        ("0.00\tX\n", "two lines at least"),
        ("<rhubarbResult><mouthCues>", "line 1, column .*: not XML"),
        ("<other/>", "<rhubarbResult> was expected, found <other>"),
        ('<!DOCTYPE a [<!ENTITY b "c">]><rhubarbResult/>', "XML without declarations of its own"),
        ("<rhubarbResult/>", "mouth shapes with a length were expected, found none"),
        ('{"mouthCues": [{"start": 0, "end": 1, "value": "Z"}]}', "mouth cue 0: a shape A-H or X"),
        ('{"mouthCues": [{"start": 2, "end": 1, "value": "A"}]}', "mouth cue 0: times that ascend"),
        (
            '{"mouthCues": [{"start": 0, "end": 1e99, "value": "A"}]}',
            "times to 7200 s were expected",
        ),
        ('{"mouthCues": 3}', "mouthCues: a list of tables"),
        ("MohoSwitch1\n1 rest\nx AI\n", "line 3, column 1: a number was expected, found 'x'"),
        ("MohoSwitch1\n1 rest 4\n", "line 2: a frame number and a shape were expected"),
        ("MohoSwitch1\n", "two shapes at least were expected"),
        ("lipsync version 1\na.wav\n24\n", "line 3: the file ends too early"),
        (
            papagayo_pgo().replace("\t\t2\n", "\t\ttwo\n"),
            "line 12: the number of words was expected",
        ),
        (papagayo_pgo().replace("\t13 O", "\t13"), "a frame and a phoneme were expected"),
        ('{"voices": [{"name": 1}], "fps": 24}', "not a Papagayo document"),
    ],
)
def test_odd_tracks_are_one_sentence(tmp_path, text, sentence):
    with pytest.raises(importing.AnimationFileError, match=sentence) as caught:
        read(tmp_path, text)
    assert "\n" not in str(caught.value)


def test_seeded_damage_never_ends_in_anything_but_a_sentence(tmp_path):
    rng = np.random.default_rng(4)
    texts = [rhubarb_tsv(CUES), rhubarb_xml(CUES), rhubarb_json(CUES), papagayo_pgo(), moho_dat()]
    texts.append(papagayo_pgo_json())
    outcomes = {True: 0, False: 0}
    for i in range(160):
        data = bytearray(texts[i % 6].encode())
        for _ in range(int(rng.integers(1, 3))):
            at = int(rng.integers(0, len(data)))
            if rng.random() < 0.7:
                data[at] = int(rng.integers(32, 127))
            else:
                del data[at : at + int(rng.integers(1, 40))]
        (tmp_path / "x").write_bytes(data)
        try:
            importing.import_file(tmp_path / "x", rate=24.0)
            outcomes[True] += 1
        except importing.AnimationFileError as error:
            assert "\n" not in str(error)
            outcomes[False] += 1
    assert min(outcomes.values()) > 10


@pytest.mark.parametrize(
    "change",
    [
        str.lower,
        lambda text: text.replace("\n", " \n"),
        lambda text: text.replace(".", ","),
        lambda text: text.replace("\t", "  "),
        lambda text: text.replace("\t", ","),
        lambda text: text.replace("\t", ";").replace(".", ","),
        lambda text: "time\tviseme\n" + text,
        lambda text: "Time (s);shape\n" + text.replace("\t", ";").replace(".", ",").lower(),
    ],
)
@pytest.mark.parametrize("kind", [None, "rhubarb"])
def test_rhubarb_as_people_and_spreadsheets_leave_it(tmp_path, change, kind):
    found = read(tmp_path, change(rhubarb_tsv(CUES)), kind=kind)
    assert (found.kind, found.mapping) == ("rhubarb", "rhubarb")
    assert [(e.time, e.value) for e in found.clip.events] == [(s, shape) for s, _, shape in CUES]


@pytest.mark.parametrize("odd", ["0.40\tQ", "0.40 B C", "B\t0.40", "0.40", "hello", "nan\tB"])
def test_the_odd_line_of_a_rhubarb_track_is_named(tmp_path, odd, capsys):
    path = tmp_path / "cues.tsv"
    path.write_text(rhubarb_tsv(CUES).replace("0.31\tB", odd))
    for options in ([], ["--kind", "rhubarb"]):
        out = ["-o", str(tmp_path / "out.rzc"), *options]
        assert main(["clip", "convert", str(path), *out]) == 1
        said = capsys.readouterr().err
        assert f"line 4: a time, a tab and a shape A-H or X were expected, found {odd!r}" in said


def test_a_table_that_is_said_to_be_rhubarbs_is_not(tmp_path):
    with pytest.raises(
        importing.AnimationFileError, match="shape A-H or X in each line .* a table"
    ):
        read(tmp_path, "time,jawOpen\n0,1\n", kind="rhubarb")
    # A table is a viseme track only if exactly one column has mouth shapes; this one has two.
    with pytest.raises(importing.AnimationFileError, match="columns with curves were expected"):
        read(tmp_path, "time,a,b\n0,A,B\n1,C,D\n")
