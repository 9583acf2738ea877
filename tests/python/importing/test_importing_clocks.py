# SPDX-License-Identifier: MIT
"""Tests times of captures: units in many spellings, and clocks that stop or run backwards."""

from __future__ import annotations

import json

import numpy as np
import pytest
from animation_files import capture, live_link_face
from risorius import Clip, importing
from risorius.cli import main

FEW = ["JawOpen", "MouthSmileLeft"]


def convert(tmp_path, name, text, *options):
    """Run `risorius clip convert` on a file with this text.

    Returns the exit code and the converted clip, or None.
    """
    path, out = tmp_path / name, tmp_path / "out.rzc"
    path.write_text(text)
    code = main(["clip", "convert", str(path), "-o", str(out), *options])
    return code, (Clip.load(out) if code == 0 else None)


def table(header, times):
    rows = (f"{t},{0.01 * i:g}" for i, t in enumerate(times))
    return "\n".join([f"{header},jawOpen", *rows]) + "\n"


def frames(key, times):
    return json.dumps([{key: t, "jawOpen": 0.01 * i} for i, t in enumerate(times)])


def lists(key, times):
    return json.dumps({key: times, "jawOpen": [0.01 * i for i in range(len(times))]})


def matrix(key, times):
    rows = [[0.01 * i] for i in range(len(times))]
    return json.dumps({"names": ["jawOpen"], "frames": rows, key: times})


def matrix_of_tables(key, times):
    rows = [{key: t, "weights": [0.01 * i]} for i, t in enumerate(times)]
    return json.dumps({"names": ["jawOpen"], "frames": rows})


FORMS = {
    "csv": table, "frames.json": frames, "lists.json": lists, "matrix.json": matrix,
    "tables.json": matrix_of_tables,
}  # fmt: skip
STEPS = np.arange(10)
SPELLINGS = [
    ("time (us)", 33333), ("Time [µs]", 33333), ("timestamp_us", 33333), ("time (ns)", 33333333),
    ("timestamp (nanosec)", 33333333), ("time (min)", 1 / 1800), ("Time (millisec)", 33.333),
    ("time_millis", 33.333), ("timestamp_ms", 33.333), ("time in seconds", 1 / 30),
    ("elapsed (Sec.)", 1 / 30), ("time (h)", 1 / 108000),
    # These names of columns contain no unit, but the time steps are too large for seconds.
    ("timestamp", 33), ("time", 33333.0), ("t", 33333333),
]  # fmt: skip


@pytest.mark.parametrize(("header", "step"), SPELLINGS)
def test_units_in_any_spelling_are_seconds_in_every_reader(tmp_path, header, step):
    times = (STEPS * step).tolist()
    found = {}
    for name, form in FORMS.items():
        (tmp_path / name).write_text(form(header, times), encoding="utf-8")
        found[name] = importing.read(tmp_path / name).clip
        assert found[name].names == ("jawOpen",)
    for clip in found.values():
        np.testing.assert_allclose(clip.frame_times(), STEPS / 30, rtol=0.02, atol=1e-6)


@pytest.mark.parametrize("form", FORMS)
def test_dates_count_from_the_first_frame(tmp_path, form):
    for start, step in ((1700000000000, 33), (1700000000.25, 1 / 30), (1700000000123456, 33333)):
        times = [start + i * step for i in range(4)]
        (tmp_path / form).write_text(FORMS[form]("timestamp", times))
        found = importing.read(tmp_path / form)
        np.testing.assert_allclose(found.clip.frame_times(), STEPS[:4] / 30, atol=2e-3)
        assert "its times are dates: they count from the first frame" in found.notes


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("header", ["time (fortnights)", "Timestamp [ticks]", "time ()"])
def test_an_unknown_unit_is_refused_and_the_known_ones_are_listed(tmp_path, form, header, capsys):
    code, _ = convert(tmp_path, form, FORMS[form](header, [0, 33, 66, 100]))
    said = capsys.readouterr().err
    assert code == 1
    assert "unit of time is not known" in said
    assert "known are s, ms, us, ns, min, h, frames, rows" in said
    assert "--time-unit" in said
    code, clip = convert(tmp_path, form, FORMS[form](header, [0, 33, 66, 99]), "--time-unit", "ms")
    assert code == 0
    np.testing.assert_allclose(clip.frame_times(), np.arange(4) * 0.033, atol=1e-9)


@pytest.mark.parametrize("form", FORMS)
def test_few_times_too_far_apart_for_seconds_are_asked_for(tmp_path, form, capsys):
    text = FORMS[form]("time", [0, 33, 66])
    assert convert(tmp_path, form, text)[0] == 1
    assert "go up by 33 from frame to frame" in capsys.readouterr().err
    _, clip = convert(tmp_path, form, text, "--time-unit", "s")
    assert clip.frame_times().tolist() == [0, 33, 66]


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("header", ["time (frames)", "frame", "Frame [#]", "frame_number"])
def test_frame_numbers_need_a_rate(tmp_path, form, header, capsys):
    text = FORMS[form](header, [10, 12, 14])
    assert convert(tmp_path, form, text)[0] == 1
    assert "give the rate in frames a second (clip convert --input-rate;" in capsys.readouterr().err
    _, clip = convert(tmp_path, form, text, "--input-rate", "24")
    np.testing.assert_allclose(clip.frame_times(), np.array([10, 12, 14]) / 24, atol=1e-9)


def stopped(form):
    """A take whose times are whole seconds, so that 20 frames have the same time."""
    return FORMS[form]("time (s)", [i // 20 for i in range(60)])


def set_back(_):
    """A take of Live Link Face whose clock is set back an hour in the middle."""
    seconds = 36000.0 + np.arange(60) / 30.0
    seconds[30:] -= 3600.0
    return live_link_face(capture(60, FEW), seconds, names=FEW)


def same(_):
    return live_link_face(capture(60, FEW), np.full(60, 36000.0), names=FEW)


@pytest.mark.parametrize(
    ("make", "form"), [(set_back, "csv"), (same, "csv"), *((stopped, form) for form in FORMS)]
)
def test_a_take_that_loses_over_a_third_names_what_mends_it(tmp_path, make, form, capsys):
    assert convert(tmp_path, form, make(form))[0] == 1
    said = capsys.readouterr().err
    assert "of 60 frames whose time is not after the one before" in said
    assert "clip convert --time-unit rows with --input-rate" in said
    assert convert(tmp_path, form, make(form), "--time-unit", "rows")[0] == 1
    assert "give the rate in frames a second (clip convert --input-rate" in capsys.readouterr().err
    rows = ("--time-unit", "rows", "--input-rate", "30")
    code, clip = convert(tmp_path, form, make(form), *rows)
    assert code == 0
    np.testing.assert_allclose(clip.frame_times(), np.arange(60) / 30, atol=1e-6)


@pytest.mark.parametrize(
    "base", [15, 36, 40, 45, 72, 75, 80, 90, 100, 110, 120, 144, 200, 240, 1000]
)
def test_timecodes_of_any_rate_are_measured(tmp_path, base):
    """Takes of 2.5 s have every frame, every frame but some lost ones, or every third frame."""
    for stride, first, lost in ((1, 0, ()), (1, 7, (9, 10, 33)), (3, 2, ())):
        count = np.delete(np.arange(first, first + base * 5 // 2, stride), lost)
        text = live_link_face(capture(count.size, FEW), 36600 + count / base, names=FEW, base=base)
        (tmp_path / "take.csv").write_text(text)
        found = importing.read(tmp_path / "take.csv")
        assert f"the timecode counts {base} frames a second" in found.notes
        wanted = (count - count[0]) / base
        np.testing.assert_allclose(found.clip.frame_times(), wanted, atol=2e-5)


@pytest.mark.parametrize("base", [30, 48, 50, 60])
def test_rows_lost_where_the_second_turns_make_no_rate_of_their_own(tmp_path, base):
    """Takes of 1.5 s lack rows before, after or around the change of the second."""
    for lost in (range(base - 3, base), range(base, base + 4), range(base - 3, base + 3)):
        count = np.delete(np.arange(base * 3 // 2), [*lost, 3, 4, base + 9])
        text = live_link_face(capture(count.size, FEW), 36600 + count / base, names=FEW, base=base)
        (tmp_path / "take.csv").write_text(text)
        try:
            found = importing.read(tmp_path / "take.csv")
        except importing.AnimationFileError as error:
            assert "give the timecode rate (clip convert --timecode-rate" in str(error)
            continue
        note = next(note for note in found.notes if note.startswith("the timecode counts"))
        # If rows at the change of the second are lost, 48 and 50 frames a second look like 60, the
        # rate of nearly all phones.
        assert note.split()[3] in (str(base), "60")


def test_a_short_take_of_many_frames_a_second_is_asked_for(tmp_path, capsys):
    text = live_link_face(capture(80, FEW), 36600 + np.arange(80) / 120, names=FEW, base=120)
    assert convert(tmp_path, "take.csv", text)[0] == 1
    assert "(the largest frame number is 79): give the timecode rate" in capsys.readouterr().err
    code, clip = convert(tmp_path, "take.csv", text, "--timecode-rate", "120")
    assert code == 0
    np.testing.assert_allclose(clip.frame_times(), np.arange(80) / 120, atol=2e-5)


def test_times_that_make_no_sense_as_an_option(tmp_path):
    (tmp_path / "a.csv").write_text("time,jawOpen\n0,0\n")
    with pytest.raises(ValueError, match="time_unit: one of s, ms, .* was expected, found 'weeks'"):
        importing.read(tmp_path / "a.csv", time_unit="weeks")
