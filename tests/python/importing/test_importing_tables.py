# SPDX-License-Identifier: MIT
"""Tests tables: takes of Live Link Face as the app writes them, and CSV of other programs."""

from __future__ import annotations

import os

import numpy as np
import pytest
from animation_files import (
    COLUMNS,
    ROTATIONS,
    SHAPES,
    audio2face_csv,
    camel,
    capture,
    live_link_face,
)
from conftest import no_room
from risorius import Clip, importing
from risorius.importing import AnimationFileError

RIG = "CTRL_expressions."


def write(tmp_path, text, name="take.csv"):
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def read(tmp_path, text, name="take.csv", **options):
    return importing.read(write(tmp_path, text, name), **options)


def take(count=90, rate=30.0, start=12.5 * 3600, **options):
    return live_link_face(capture(count), start + np.arange(count) / rate, **options)


def test_time_is_the_timecodes_30_rows_a_second_on_a_clock_of_60(tmp_path):
    found = read(tmp_path, take())
    assert found.kind == found.mapping == "live_link_face"
    assert found.clip.names == tuple(COLUMNS)
    assert found.clip.rate == 30.0
    np.testing.assert_allclose(found.clip.frame_times(), np.arange(90) / 30.0, atol=1e-4)
    np.testing.assert_array_equal(found.clip.curves, capture(90).T.astype(np.float32))
    assert found.clip.metadata["timecode"] == "12:30:00:00.000"
    assert "the timecode counts 60 frames a second" in found.notes


def test_rows_that_the_phone_dropped_leave_a_gap_and_a_note(tmp_path):
    seconds = 40000.0 + np.arange(60) / 30.0
    keep = np.ones(60, bool)
    keep[[10, 11, 12, 40]] = False
    found = read(tmp_path, live_link_face(capture(60)[keep], seconds[keep]))
    np.testing.assert_allclose(found.clip.frame_times(), np.arange(60)[keep] / 30.0, atol=1e-4)
    assert any(note.startswith("4 frame(s) are missing in 2 gap(s)") for note in found.notes)


def test_a_take_across_midnight_goes_on(tmp_path):
    found = read(tmp_path, take(start=86399.0))
    np.testing.assert_allclose(found.clip.frame_times(), np.arange(90) / 30.0, atol=1e-4)
    assert found.clip.metadata["timecode"] == "23:59:59:00.000"


@pytest.mark.parametrize("base", [24, 25, 30, 50, 60])
def test_the_base_is_told_by_where_the_second_turns(tmp_path, base):
    seconds = 7.6 + np.arange(40) / base
    found = read(tmp_path, live_link_face(capture(40), seconds, base=base))
    np.testing.assert_allclose(found.clip.frame_times(), np.arange(40) / base, atol=1e-4)


def test_a_base_that_nothing_tells_is_asked_for(tmp_path):
    text = live_link_face(capture(10), 3600.2 + np.arange(10) / 30.0, base=30)
    with pytest.raises(ValueError, match="give the timecode rate"):
        read(tmp_path, text)
    found = read(tmp_path, text, timecode_rate=30)
    np.testing.assert_allclose(found.clip.frame_times(), np.arange(10) / 30.0, atol=1e-4)


def test_drop_frame_timecodes_leave_out_two_numbers_a_minute(tmp_path):
    """After 00:00:59;29 the next timecode is 00:01:00;02, one frame of 1001 / 30000 s later."""
    codes = ["00:00:59;28", "00:00:59;29", "00:01:00;02", "00:01:00;03"]
    body = "".join(f"{code},2,0.1,0.2\n" for code in codes)
    found = read(tmp_path, "Timecode,BlendShapeCount,JawOpen,JawLeft\n" + body, timecode_rate=29.97)
    np.testing.assert_allclose(found.clip.frame_times(), np.arange(4) * 1001 / 30000, atol=1e-9)


def test_29_97_without_drop_counts_seconds_that_last_longer(tmp_path):
    seconds = np.arange(300) / 30.0
    text = live_link_face(capture(300), seconds, base=30)
    found = read(tmp_path, text, timecode_rate=29.97)
    np.testing.assert_allclose(found.clip.frame_times(), seconds * 1.001, atol=1e-4)


@pytest.mark.parametrize(
    "names",
    [
        [camel(n) for n in SHAPES] + ROTATIONS,
        [
            n.replace("Left", "#").replace("Right", "Left").replace("#", "Right")
            for n in SHAPES
            if n not in ("JawLeft", "JawRight", "MouthLeft", "MouthRight")
        ],
        SHAPES[:-1],
        [n.replace("Left", "_L").replace("Right", "_R") for n in SHAPES],
    ],
    ids=["camel case", "right before left", "51 without the tongue", "_L and _R"],
)
def test_columns_are_known_by_their_names(tmp_path, names):
    values = capture(40, names)
    text = live_link_face(values, 100.0 + np.arange(40) / 30.0, names=names)
    clip, report = read(tmp_path, text).apply()
    assert report.unmapped == []
    blink = next(n for n in names if n.lower().replace("_", "") in ("eyeblinkright", "eyeblinkr"))
    np.testing.assert_array_equal(
        clip.curve(RIG + "eyeBlinkR"), values[:, names.index(blink)].astype(np.float32)
    )


def test_angles_turn_to_the_faces_own_left_up_and_left_shoulder(tmp_path):
    clip, report = read(tmp_path, take()).apply()
    values = capture(90).astype(np.float32)
    turns = (("head.yaw", "HeadYaw", -1), ("head.pitch", "HeadPitch", -1))
    for control, column, sign in (*turns, ("head.roll", "HeadRoll", 1)):
        np.testing.assert_array_equal(clip.curve(control), sign * values[:, COLUMNS.index(column)])
    assert "eyeL.yaw" not in clip
    assert {"LeftEyeYaw", "LeftEyeRoll", "RightEyeRoll"} <= set(report.ignored)
    both, _ = importing.import_file(tmp_path / "take.csv", rotations="all")
    np.testing.assert_array_equal(both.curve("eyeR.yaw"), -values[:, COLUMNS.index("RightEyeYaw")])
    none, _ = importing.import_file(tmp_path / "take.csv", rotations="none")
    assert not any(name.startswith(("head.", "eyeL.")) for name in none.names)


def test_a_head_that_was_not_recorded_is_not_held_still(tmp_path):
    values = capture(40)
    values[:, [COLUMNS.index(n) for n in ROTATIONS[:3]]] = 0.0
    clip, report = read(tmp_path, live_link_face(values, np.arange(40) / 30.0 + 9.0)).apply()
    assert not any(name.startswith("head.") for name in clip.names)
    assert set(ROTATIONS[:3]) <= set(report.always_zero) & set(report.ignored)
    assert any("was not recorded" in note for note in report.notes)


def test_the_report_names_what_the_rig_lacks(tmp_path):
    clip, report = importing.import_file(write(tmp_path, take()), [RIG + "jawOpen"])
    assert clip.names == (RIG + "jawOpen", "head.yaw", "head.pitch", "head.roll")
    assert RIG + "tongueOut" in report.not_in_rig
    assert "not in the rig: " in report.text()
    assert "RightEyeRoll" in report.text()


def test_crlf_a_byte_order_mark_and_utf16_read_the_same(tmp_path):
    text = take(20)
    plain = read(tmp_path, text, timecode_rate=60).clip
    for data in (
        text.replace("\n", "\r\n").encode(),
        b"\xef\xbb\xbf" + text.encode(),
        text.encode("utf-16"),
    ):
        clip = read(tmp_path, data, timecode_rate=60).clip
        np.testing.assert_array_equal(clip.curves, plain.curves)
        assert clip.names == plain.names


def test_a_byte_order_mark_is_no_part_of_the_first_name(tmp_path):
    clip = read(tmp_path, b"\xef\xbb\xbfjawOpen,time\n1,0\n2,1\n").clip
    assert clip.names == ("jawOpen",)


@pytest.mark.parametrize(
    ("text", "values", "times"),
    [
        ("time,jawOpen\n0,0.5\n0.1,1\n", [0.5, 1], [0, 0.1]),
        ("jawOpen;Time (ms)\n0,5;0\n1,0;40\n", [0.5, 1], [0, 0.04]),
        ("frame\tjawOpen\n10\t0.5\n12\t1\n", [0.5, 1], [10 / 24, 12 / 24]),
        ("jawOpen|x\n0.5|0\n1|0\n", [0.5, 1], [0, 1 / 24]),
        ('"time","jawOpen"\n"0","0.5"\n"2","1"\n', [0.5, 1], [0, 2]),
        ("Timecode,jawOpen\n01:00:00:00,0.5\n01:00:01:12,1\n", [0.5, 1], [0, 1.5]),
        ("timestamp,jawOpen,\n1,0.5,\n2,1,\n", [0.5, 1], [1, 2]),
    ],
    ids=[
        "comma",
        "decimal comma, ms",
        "tab, frames",
        "no time",
        "quoted",
        "timecode",
        "last comma",
    ],
)
def test_plain_tables(tmp_path, text, values, times):
    options = {"rate": 24.0, "timecode_rate": 24.0}
    clip = read(tmp_path, text, **options).clip
    np.testing.assert_array_equal(clip.curve("jawOpen"), np.float32(values))
    np.testing.assert_allclose(clip.frame_times(), times, atol=1e-9)


def test_audio2face_frames_as_pandas_writes_them(tmp_path):
    rows = capture(5, SHAPES)
    clip, report = read(tmp_path, audio2face_csv(rows, SHAPES, np.arange(5) / 30)).apply()
    np.testing.assert_array_equal(
        clip.curve(RIG + "tongueOut"), rows[:, SHAPES.index("TongueOut")].astype(np.float32)
    )
    assert report.unmapped == []
    assert clip.rate == 30.0


def test_empty_cells_are_filled_and_said(tmp_path):
    found = read(tmp_path, "time,a,b,c\n0,1,,\n1,,2,\n2,3,,\n")
    np.testing.assert_array_equal(found.clip.curve("a"), [1, 2, 3])
    np.testing.assert_array_equal(found.clip.curve("b"), [2, 2, 2])
    assert found.clip.names == ("a", "b")
    assert "a: 1 empty cell(s) filled" in found.notes
    assert "c: empty, left out" in found.notes


TABLES = {
    "sep": "sep=;\r\ntime;jawOpen;mouthClose\r\n0,0;0,5;0,1\r\n0,04;0,6;0,2\r\n",
    "sep, quoted, tab": '"sep=\\t"\ntime\tjawOpen\tmouthClose\n0\t0.5\t0.1\n0.04\t0.6\t0.2\n',
    "sep against the header": "sep=;\ntime;jawOpen;mouthClose\n0,0;0,5;0,1\n0,04;0,6;0,2\n",
    "comments": "# a, b; c\n// fps: 60\ntime,jawOpen,mouthClose\n0,.5,.1\n# cut\n0.04,.6,.2\n",
    "NumPy": "# time,jawOpen,mouthClose\n0.0,0.5,0.1\n4e-2,0.6,0.2\n",
    "tab, decimal commas": "time\tjawOpen\tmouthClose\n0,0\t0,5\t0,1\n0,04\t0,6\t0,2\n",
    "bars, decimal commas": "time|jawOpen|mouthClose\n0,0|0,5|0,1\n0,04|0,6|0,2\n",
    "quoted decimal commas": 'time,jawOpen,mouthClose\n"0,0","0,5","0,1"\n"0,04","0,6","0,2"\n',
    "a cut last row": "time,jawOpen,mouthClose\n0,0.5,0.1\n0.04,0.6,0.2\n0.08,0\n",
    "a row without a time": "time,jawOpen,mouthClose\n0,.5,.1\n,.9,.9\n0.04,.6,.2\n0.08,0",
}


@pytest.mark.parametrize("form", TABLES)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_tables_as_spreadsheets_write_them(tmp_path, form, encoding):
    clip = read(tmp_path, TABLES[form].encode(encoding)).clip
    np.testing.assert_allclose(clip.curve("jawOpen"), [0.5, 0.6])
    np.testing.assert_allclose(clip.curve("mouthClose"), [0.1, 0.2], rtol=1e-6)
    np.testing.assert_allclose(clip.frame_times(), [0.0, 0.04])


@pytest.mark.parametrize("hole", ["", " ", "-", "N/A", "NULL"])
def test_holes_in_tables_and_in_captures_are_filled_and_said(tmp_path, hole):
    """A take of Live Link Face lacks a cell, a column, a timecode, its end; a table lacks cells."""
    rows = [line.split(",") for line in take(60).splitlines()]
    rows[5][2] = rows[9][0] = hole
    for row in rows[1:]:
        row[4] = hole
    rows[-1] = rows[-1][:30]
    found = read(tmp_path, "\n".join(map(",".join, rows)))
    kept = np.delete(np.arange(59), 8)
    values = capture(60)[:, 0]
    values[4] = (values[3] + values[5]) / 2
    np.testing.assert_allclose(found.clip.curve("EyeBlinkLeft"), values[kept], atol=1e-3)
    np.testing.assert_allclose(found.clip.frame_times(), kept / 30.0, atol=1e-4)
    assert "EyeLookInLeft: empty, left out" in found.notes
    assert "EyeBlinkLeft: 1 empty cell(s) filled" in found.notes
    assert "1 row(s) without a time left out" in found.notes
    assert "the last row (line 61) is cut short and left out" in found.notes
    rows[7][5:10] = [hole] * 5
    found = read(tmp_path, "\n".join(map(",".join, rows)))
    assert "6 empty cell(s) filled in 6 curves, as EyeBlinkLeft" in found.notes
    table = f"time,jawOpen,jawLeft\n0,0.5,{hole}\n0.04,{hole},0.2\n0.08,0.7,0.3\n"
    clip = read(tmp_path, table).clip
    np.testing.assert_allclose(clip.curves, [[0.5, 0.6, 0.7], [0.2, 0.2, 0.3]], rtol=1e-6)


def test_a_row_for_each_time_and_name_becomes_a_column_for_each_name(tmp_path):
    rows = [(t, n, v) for t in (0.0, 0.04, 0.08) for n, v in (("jawOpen", t), ("tongueOut", 0.5))]
    del rows[3]  # a missing value
    text = "timestamp,category_name,score\n" + "".join(f"{t},{n},{v}\n" for t, n, v in rows)
    found = read(tmp_path, text)
    assert found.mapping == "arkit"
    assert found.clip.names == ("jawOpen", "tongueOut")
    np.testing.assert_allclose(found.clip.curves, [[0, 0.04, 0.08], [0.5] * 3], rtol=1e-6)
    np.testing.assert_allclose(found.clip.frame_times(), [0, 0.04, 0.08])
    assert "the column category_name names the curves" in found.notes
    many = "".join(f"{i // 2},name{i},1\n" for i in range(40))
    with pytest.raises(importing.AnimationFileError, match="found 40 for 20 times and 40 names"):
        read(tmp_path, "time,name,value\n" + many)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ('time,a\n0.5,"1,234"\n', r"line 2, column 2 \(a\): a number was expected, found '1,234'"),
        ("time;a\n0;1,2,3\n", "a number was expected, found '1.2.3'"),
        (
            "time,a\n0,1\n,2\n,3\n",
            "times were expected, found none in 2 of 3 rows: clip convert --time-unit",
        ),
    ],
)
def test_what_is_no_decimal_comma_and_no_time_is_refused(tmp_path, text, sentence):
    with pytest.raises(importing.AnimationFileError, match=sentence):
        read(tmp_path, text)


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        (b"", "it holds nothing"),
        (b"\xef\xbb\xbf \r\n", "it holds nothing"),
        (
            b"time,a\n0,1\n1,\xff\n",
            "line 3, column 3: UTF-8 text was expected, found the byte 0xff",
        ),
        (b"time,a\n0,1\n1,x\n", r"line 3, column 2 \(a\): a number was expected, found 'x'"),
        (b"time,a\n0,nan\n", r"line 2, column 2 \(a\): a finite number was expected, found 'nan'"),
        (b"time,a\n0,1e39\n", r"line 2, column 2 \(a\): a finite number was expected"),
        (b"time,a\n0,1_0\n", r"line 2, column 2 \(a\): a number was expected"),
        (b"time,a\n0,1\n1\n2,3\n", "line 3: 2 columns as in the header were expected, found 1"),
        (b"time,a,a\n0,1,1\n", "line 1: 'a' was expected once, found in the columns 2 and 3"),
        (b"time,a\n", "rows after the header were expected"),
        (
            b"0,1\n1,2\n",
            "line 1: a header with the names of the curves was expected, found numbers",
        ),
        (b"time,b\n0,hello\n", "columns with curves were expected, found none"),
        (b"a,b\n0,1\n", "nothing gives the time: give the rate"),
        (b"frame,b\n0,1\n", r"column 1 \(frame\): its time is a frame number: give the rate"),
        (b'time,a\n0,"1\n1,2\n', "no table"),
        (b"time,a\n0,\x001\n", "line 2: text was expected, found a zero byte"),
        (
            b"Timecode,BlendShapeCount,JawOpen\n12:00:61:00,1,0\n",
            r"line 2, column 1 \(Timecode\): hours to 23, minutes and seconds to 59",
        ),
        (
            b"Timecode,BlendShapeCount,JawOpen\nnoon,1,0\n",
            r"line 2, column 1 \(Timecode\): a timecode as 12:21:59:06.595 was expected",
        ),
    ],
)
def test_odd_files_are_one_sentence_with_the_place(tmp_path, data, sentence):
    with pytest.raises(importing.AnimationFileError, match=sentence) as caught:
        read(tmp_path, data)
    assert str(caught.value).startswith(str(tmp_path / "take.csv"))
    assert "\n" not in str(caught.value)


def test_a_frame_number_beyond_the_rate_is_named(tmp_path):
    with pytest.raises(importing.AnimationFileError, match="line 17, .*a frame number below 30"):
        read(tmp_path, take(), timecode_rate=30)
    text = "Timecode,BlendShapeCount,JawOpen\n00:00:01;05,1,0\n00:00:01;06,1,0\n"
    with pytest.raises(importing.AnimationFileError, match="drop-frame timecodes count 30 or 60"):
        read(tmp_path, text, timecode_rate=25)


def test_a_file_too_large_is_not_read(tmp_path, monkeypatch):
    monkeypatch.setattr("risorius.importing.source.MAX_BYTES", 100)
    with pytest.raises(
        importing.AnimationFileError, match="at most 100 bytes were expected, found"
    ):
        read(tmp_path, take())


def test_options_that_make_no_sense(tmp_path):
    path = write(tmp_path, take())
    for options in ({"kind": "c3d"}, {"rate": 0.0}, {"timecode_rate": -1.0}):
        with pytest.raises(ValueError, match="expected, found"):
            importing.read(path, **options)
    with pytest.raises(ValueError, match="one of head, all, none was expected"):
        importing.import_file(path, rotations="both")
    with pytest.raises(importing.AnimationFileError, match="was expected, found something else"):
        importing.read(path, kind="fbx")


def test_frames_out_of_order_are_left_out_and_said(tmp_path):
    found = read(tmp_path, "time,a\n0,0\n1,1\n1,5\n0.5,6\n2,2\n3,3\n")
    np.testing.assert_array_equal(found.clip.curve("a"), [0, 1, 2, 3])
    assert found.notes[0].startswith("2 frame(s) left out whose time is not after the one before")


@pytest.mark.parametrize("kind", ["csv", "json"])
def test_what_is_written_reads_back_bit_for_bit(tmp_path, kind):
    rng = np.random.default_rng(3)
    bits = rng.integers(0, 2**32, (4, 500), np.uint32).view(np.float32)
    bits = np.where(np.isfinite(bits), bits, np.float32(-0.0))
    times = np.cumsum(rng.uniform(1e-3, 0.1, 500)) - 3.0
    for clip in (Clip("abcd", bits, 60.0, start=1.25), Clip("abcd", bits, 60.0, times=times)):
        text = importing.csv_text(clip) if kind == "csv" else importing.json_text(clip)
        importing.write_text(text, tmp_path / f"out.{kind}")
        again = importing.read(tmp_path / f"out.{kind}").clip
        assert again.names == clip.names
        np.testing.assert_array_equal(again.curves.view(np.uint32), bits.view(np.uint32))
        np.testing.assert_allclose(again.frame_times(), clip.frame_times(), rtol=0, atol=1e-9)


@pytest.mark.skipif(os.name == "nt", reason="limits are those of POSIX")
@pytest.mark.parametrize("kind", ["csv", "json"])
def test_text_is_written_whole_or_not_at_all_and_takes_no_name_of_the_users(tmp_path, kind):
    clip = Clip("ab", [[0, 1], [1, 0]])
    text = importing.csv_text(clip) if kind == "csv" else importing.json_text(clip)
    for name in (f"out.{kind}", f"out.{kind}.part"):
        (tmp_path / name).write_text("the user's own")
    path = tmp_path / f"out.{kind}"
    with no_room(10), pytest.raises(OSError, match=f"out.{kind}'"):
        importing.write_text(text, path)
    assert path.read_text() == "the user's own"
    importing.write_text(text, path)
    assert path.read_text() == text
    assert (tmp_path / f"out.{kind}.part").read_text() == "the user's own"
    assert len(os.listdir(tmp_path)) == 2


def test_what_text_cannot_hold_is_refused():
    with pytest.raises(ValueError, match="b, frame 1: CSV holds finite numbers only"):
        importing.csv_text(Clip("ab", [[0, 1], [1, np.nan]]))


def test_seeded_damage_never_ends_in_anything_but_a_sentence(tmp_path):
    rng = np.random.default_rng(11)
    sources = [
        take(8).encode(),
        audio2face_csv(capture(6, SHAPES), SHAPES, np.arange(6.0)).encode(),
    ]
    path, read_count = tmp_path / "x.csv", 0
    for i in range(160):
        data = bytearray(sources[i % 2])
        for _ in range(rng.integers(1, 3)):
            at = int(rng.integers(0, len(data)))
            what = rng.integers(0, 4)
            if what == 0:
                data[at] = int(rng.integers(0, 256))
            elif what == 1 and i % 3 == 0:
                del data[at : at + int(rng.integers(1, 200))]
            elif what == 2:
                data[at:at] = rng.choice([b",", b"\n", b'"', b":", b"nan", b"-", b";"])
            elif i % 5 == 0:
                data = data[: max(1, at)]
        path.write_bytes(data)
        try:
            importing.import_file(path, rate=30.0, timecode_rate=60.0)
            read_count += 1
        except importing.AnimationFileError as error:
            assert "\n" not in str(error)
    assert 10 < read_count < 150


def test_a_clip_without_its_suffix_is_called_a_clip(tmp_path):
    path = tmp_path / "take.csv"
    Clip(["a"], [[0.0]], 60.0).save(path)
    with pytest.raises(AnimationFileError, match=r"a clip of Risorius .* rename it"):
        importing.read(path)


def test_the_report_names_every_curve(tmp_path):
    path = tmp_path / "take.csv"
    strange = [f"strange{i}" for i in range(60)]
    header = ["time", "JawOpen", "HeadYaw", *strange]
    rows = [",".join([str(i)] * len(header)) for i in (0, 1)]
    path.write_text("\n".join([",".join(header), *rows]))
    clip, report = importing.import_file(path, ["CTRL_expressions.other"], mapping="live_link_face")
    text = report.text()
    words = text.replace(",", " ").split()
    assert all(name in words for name in ["JawOpen", "HeadYaw", *strange])
    assert all(name in words for row in report.mapped.values() for name in row)
    assert "more" not in words
    assert max(map(len, text.splitlines())) <= 100 + len(str(path))
    # The report also names curves that are no controls of the rig, but rotate the head.
    assert report.bones == list(clip.names) == ["head.yaw"]
    assert "for the bones of head and eyes: 1: head.yaw" in text
