# SPDX-License-Identifier: MIT
"""Tests JSON of named curves in the forms of several programs."""

from __future__ import annotations

import json

import numpy as np
import pytest
from animation_files import (
    COLUMNS,
    SHAPES,
    audio2face_json,
    camel,
    capture,
    unreal_animation,
    unreal_curve_table,
)
from risorius import importing

RIG = "CTRL_expressions."


def read(tmp_path, document, **options):
    path = tmp_path / "curves.json"
    path.write_text(document if isinstance(document, str) else json.dumps(document))
    return importing.read(path, **options)


def test_audio2faces_export(tmp_path):
    names = [camel(name) for name in SHAPES]
    rows = capture(7, SHAPES)
    clip, report = read(tmp_path, audio2face_json(rows, names)).apply()
    assert clip.rate == 30.0
    assert report.unmapped == []
    np.testing.assert_array_equal(
        clip.curve(RIG + "jawOpen"), rows[:, SHAPES.index("JawOpen")].astype(np.float32)
    )


@pytest.mark.parametrize("columns", [61, 68])
def test_neurosyncs_nameless_rows(tmp_path, columns):
    rows = np.round(np.random.default_rng(0).random((4, columns)), 6)
    found = read(tmp_path, {"blendshapes": rows.tolist()})
    assert found.clip.names[:61] == tuple(COLUMNS)
    assert found.clip.rate == 60.0
    assert any("60 frames a second were assumed" in note for note in found.notes)
    _, report = found.apply()
    # Some meshes call their basis "Neutral"; the mapping ignores this name.
    emotions = ["Angry", "Disgusted", "Fearful", "Happy", "Sad", "Surprised"]
    assert report.unmapped == (emotions if columns == 68 else [])
    assert ("Neutral" in report.ignored) == (columns == 68)
    bad = rows.tolist()
    bad[2].pop()
    with pytest.raises(importing.AnimationFileError, match=rf"blendshapes\[2\]: {columns} values"):
        read(tmp_path, {"blendshapes": bad})


A, B = [0.0, 0.5, 1.0], [1.0, 0.25, 0.0]
FRAMES = [{"jawOpen": a, "b": b} for a, b in zip(A, B, strict=True)]
TIMED = [{"time": t, **frame} for t, frame in zip([0.0, 0.1, 0.3], FRAMES, strict=True)]
NESTED = [
    {"timeCode": t, "blendShapes": frame} for t, frame in zip([0.0, 0.1, 0.3], FRAMES, strict=True)
]
WEIGHTED = [{"time": t, "weights": [a, b]} for t, a, b in zip([0.0, 0.1, 0.3], A, B, strict=True)]


@pytest.mark.parametrize(
    ("document", "times"),
    [
        ({"names": ["jawOpen", "b"], "frames": [[0, 1], [0.5, 0.25], [1, 0]], "fps": 10}, None),
        ({"jawOpen": A, "b": B, "fps": 10}, None),
        ({"jawOpen": A, "b": B, "time": [0, 0.1, 0.3]}, [0, 0.1, 0.3]),
        ({"rate": 10, "curves": {"jawOpen": A, "b": B}}, None),
        (TIMED, [0, 0.1, 0.3]),
        ({"frames": TIMED}, [0, 0.1, 0.3]),
        ({"fps": 10, "frames": FRAMES}, None),
        (NESTED, [0, 0.1, 0.3]),
        ({"frames": NESTED, "metadata": {"fps": 10}}, [0, 0.1, 0.3]),
        ({"metadata": {"blendshape_names": ["jawOpen", "b"]}, "frames": WEIGHTED}, [0, 0.1, 0.3]),
        (
            {"curves": [
                {"name": "jawOpen", "keys": [{"time": 0, "value": 0}, {"time": 0.1, "value": 0.5},
                                             {"time": 0.2, "value": 1}]},
                {"name": "b", "keys": [{"time": 0, "value": 1}, {"time": 0.1, "value": 0.25},
                                       {"time": 0.2, "value": 0}]},
            ]},
            None,
        ),
    ],
    ids=["matrix", "lists", "lists and time", "curves", "frames", "frames inside", "frames, fps",
         "nested", "nested inside", "weights", "keys"],
)  # fmt: skip
def test_shapes_of_json(tmp_path, document, times):
    clip = read(tmp_path, document).clip
    assert clip.names == ("jawOpen", "b")
    np.testing.assert_array_equal(clip.curves, np.float32([A, B]))
    np.testing.assert_allclose(clip.frame_times(), times or [0, 0.1, 0.2], atol=1e-9)


CURVES = {
    "CTRL_expressions_jawOpen": {0.0: 0.0, 0.5: 1.0},
    "CTRL_expressions_eyeBlinkL": {0.25: 0.5},
}


@pytest.mark.parametrize("write", [unreal_curve_table, unreal_animation])
def test_unreals_curves_share_one_clock(tmp_path, write):
    found = read(tmp_path, write(CURVES))
    assert found.mapping == "controls"
    clip, report = found.apply()
    np.testing.assert_allclose(clip.frame_times(), [0, 0.25, 0.5])
    assert clip.rate == 60.0  # keys with long distances do not define a frame rate
    np.testing.assert_array_equal(clip.curve(RIG + "jawOpen"), [0, 0.5, 1])
    np.testing.assert_array_equal(clip.curve(RIG + "eyeBlinkL"), [0.5, 0.5, 0.5])
    assert report.unmapped == []


def test_cubic_keys_and_repeated_curves_are_said(tmp_path):
    found = read(tmp_path, unreal_animation(CURVES, "RCIM_Cubic"))
    assert "cubic keys are joined by straight lines" in found.notes
    curves = [{"name": "a", "keys": [{"time": 0, "value": i}]} for i in range(2)]
    found = read(tmp_path, curves)
    assert "a: found twice, the first one is taken" in found.notes
    assert found.clip.curve("a").tolist() == [0.0]


@pytest.mark.parametrize(
    ("document", "sentence"),
    [
        ("{", "line 1, column 2: not JSON"),
        ("[" * 100000, "nested too deeply|not JSON"),
        ("{}", "named curves were expected, found none"),
        ("[1, 2]", "named curves were expected, found none"),
        ({"a": [1, 2]}, "nothing gives the time: give the rate"),
        ({"a": [1, 2], "b": [1], "fps": 30}, "b: 2 values as in the first curve were expected"),
        ({"a": [1, True], "fps": 30}, r"a\[1\]: a finite number was expected, found True"),
        ('{"a": [1, NaN], "fps": 30}', r"a\[1\]: a finite number was expected, found nan"),
        ('{"a": [1, 1e999], "fps": 30}', r"a\[1\]: a finite number was expected, found inf"),
        ({"a": [1, 2], "fps": 0}, "fps: frames a second above 0 were expected"),
        ({"names": ["a"], "frames": [[1, 2]], "fps": 1}, r"frames\[0\]: 1 values as in names"),
        ({"names": [3], "frames": [[1]], "fps": 1}, "names: a list of names was expected"),
        ({"names": ["a", "a"], "frames": [[1, 1]], "fps": 1}, "'a' was expected once"),
        ({"a": [1, 2], "time": [0]}, "time: 2 times were expected, found 1"),
        ([{"name": "a", "keys": [{"time": 0}]}], r"a.Keys\[0\]: a key with value was expected"),
        ([{"name": "a", "keys": [{"time": 1, "value": 0}, {"time": 1, "value": 0}]}], "ascend"),
        ({"risorius_clip": 1, "curves": {"a": [1]}, "frames": 2, "rate": 1}, "curves.a: 2 values"),
        ({"risorius_clip": 1, "curves": 1}, "curves: a table was expected"),
    ],
)  # fmt: skip
def test_odd_documents_are_one_sentence(tmp_path, document, sentence):
    with pytest.raises(importing.AnimationFileError, match=sentence) as caught:
        read(tmp_path, document)
    assert "\n" not in str(caught.value)


def test_a_clips_events_and_metadata_come_back(tmp_path):
    clip = importing.read(_track(tmp_path)).clip.replaced(metadata={"actor": "ü"})
    importing.write_text(importing.json_text(clip), tmp_path / "out.json")
    again = importing.read(tmp_path / "out.json").clip
    assert again.events == clip.events
    assert again.metadata["actor"] == "ü"
    assert (again.start, again.rate, again.times) == (clip.start, clip.rate, None)


def _track(tmp_path):
    (tmp_path / "a.tsv").write_text("0.00\tA\n0.30\tB\n0.50\tX\n")
    return tmp_path / "a.tsv"


def test_seeded_damage_never_ends_in_anything_but_a_sentence(tmp_path):
    rng = np.random.default_rng(8)
    texts = [audio2face_json(capture(3, SHAPES), SHAPES), unreal_animation(CURVES)]
    texts += [json.dumps(NESTED), json.dumps({"jawOpen": A, "b": B, "time": [0, 1, 2]})]
    outcomes = {True: 0, False: 0}
    for i in range(160):
        data = bytearray(texts[i % 4].encode())
        at = int(rng.integers(0, len(data)))
        if i % 3:
            data[at] = rng.choice(bytearray(b'0123456789.-e"[]{},:nt'))
        else:
            del data[at : at + int(rng.integers(1, 60))]
        (tmp_path / "x.json").write_bytes(data)
        try:
            importing.import_file(tmp_path / "x.json", rate=24.0)
            outcomes[True] += 1
        except importing.AnimationFileError as error:
            assert "\n" not in str(error)
            outcomes[False] += 1
    assert min(outcomes.values()) > 30


@pytest.mark.parametrize(
    "document",
    [
        {"time": [0, 0.1, 0.2], "jawOpen": [0, None, 1]},
        {"names": ["jawOpen"], "frames": [[0], [None], [1]], "time": [0, 0.1, 0.2]},
        {"names": ["jawOpen"], "frames": [
            {"time": t, "weights": [w]} for t, w in ((0, 0), (0.1, None), (0.2, 1))]},
        [{"time": 0, "jawOpen": 0}, {"time": 0.1, "jawOpen": None}, {"time": 0.2, "jawOpen": 1}],
    ],
)  # fmt: skip
def test_null_is_a_value_that_is_not_there(tmp_path, document):
    path = tmp_path / "a.json"
    path.write_text(json.dumps(document))
    found = importing.read(path)
    np.testing.assert_allclose(found.clip.curve("jawOpen"), [0, 0.5, 1])
    assert any("jawOpen" in note and "filled" in note for note in found.notes)


def test_a_curve_of_null_alone_is_refused(tmp_path):
    path = tmp_path / "a.json"
    path.write_text('{"time": [0, 1], "jawOpen": [null, null]}')
    with pytest.raises(importing.AnimationFileError, match="jawOpen: numbers were expected, found"):
        importing.read(path)
