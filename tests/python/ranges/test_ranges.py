# SPDX-License-Identifier: MIT
"""Tests capture ranges of a person's controls: learned, stored, edited and applied to takes."""

from __future__ import annotations

import numpy as np
import pytest
from animation_files import COLUMNS, camel, live_link_face
from conftest import SHARED
from risorius import Clip, importing
from risorius.cli import main
from risorius.live import Frame, Shaper, livelink
from risorius.live import Take as LiveTake
from risorius.ranges import (
    Range,
    Ranges,
    Remap,
    is_captured,
    learn,
    load_ranges,
    parse_ranges,
    ranges_text,
)

REAL = SHARED / "data" / "real" / "livelink" / "rom_134s.csv"
RIG = "CTRL_expressions."
RATE = 60
HEIGHTS = (0.67, 0.66, 0.64, 0.665, 0.65, 0.4, 0.66, 0.64)  # of blinks; one is half
BLINKS = [90 + 120 * n for n in range(len(HEIGHTS))]  # frames of the blinks


def bump(count, at, width, height):
    """A curve that rises over `width` frames, is flat for 3 frames around `at`, and falls again.

    Args:
        count: number of frames of the curve.
        at: frame of the middle of the flat top.
        width: frames of the rise and of the fall, which are half cosines.
        height: value of the flat top.
    """
    distance = np.maximum(np.abs(np.arange(count) - at) - 1.0, 0.0)
    return height * np.where(distance < width, 0.5 + 0.5 * np.cos(np.pi * distance / width), 0.0)


def performance():
    """A man who speaks and blinks, whose phone never reports shut eyes, float[frames, columns]."""
    count, random = 1100, np.random.default_rng(5)
    lids = 0.05 + sum(
        bump(count, at, 7, height - 0.05) for at, height in zip(BLINKS, HEIGHTS, strict=True)
    )
    words = sum(bump(count, at, 12, random.uniform(0.1, 0.7)) for at in range(60, 1040, 31))
    curves = {
        "EyeBlinkLeft": lids + random.normal(0.0, 0.001, count),
        "EyeBlinkRight": 0.95 * lids + random.normal(0.0, 0.001, count),
        "JawOpen": words,
        "CheekPuff": np.maximum(0.1 + random.normal(0.0, 0.03, count), 0.0),
        "MouthSmileLeft": bump(count, 500, 60, 0.7),
    }
    return table(count, curves)


def range_of_motion():
    """A take with extremes one after the other, a jaw spike of one frame, and a trembling brow."""
    count, random = 1500, np.random.default_rng(6)
    curves = {
        "EyeBlinkLeft": 0.1 + bump(count, 200, 40, 0.70),
        "EyeBlinkRight": 0.1 + bump(count, 200, 40, 0.65),
        "JawOpen": bump(count, 400, 50, 0.8),
        "MouthClose": bump(count, 400, 50, 0.5),
        "MouthSmileLeft": bump(count, 600, 50, 0.85) + bump(count, 900, 50, 0.7),
        "MouthSmileRight": bump(count, 600, 50, 0.85) + bump(count, 760, 50, 0.7),
        "BrowInnerUp": np.maximum(0.25 + random.normal(0.0, 0.12, count), 0.0),
        "MouthPucker": bump(count, 1000, 50, 0.4),
        "NoseSneerLeft": np.full(count, 0.4) + bump(count, 1100, 50, 0.5),
        "EyeLookUpLeft": bump(count, 1200, 50, 0.8),
        "JawForward": 0.05 + bump(count, 1300, 50, 0.05),
    }
    curves["JawOpen"][900] = 1.0
    return table(count, curves)


def table(count, curves):
    values = np.zeros((count, len(COLUMNS)))
    for name, curve in curves.items():
        values[:, COLUMNS.index(name)] = curve
    return values


def written(path, values):
    path.write_text(live_link_face(values, 3600.0 + np.arange(len(values)) / RATE))
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with take.csv, rom.csv, and rom.range.toml that `clip learn` made of rom.csv."""
    found = tmp_path_factory.mktemp("ranges")
    written(found / "take.csv", performance())
    written(found / "rom.csv", range_of_motion())
    assert run("learn", found / "rom.csv", "-o", found / "rom.range.toml") == 0
    return found


def run(*arguments):
    return main(["clip", *map(str, arguments)])


def converted(folder, name, *options):
    assert run("convert", folder / "take.csv", "-o", folder / name, *options) == 0
    return importing.read(folder / name).clip


def test_blinks_that_never_closed_the_eyes_reach_lid_contact(folder, capsys):
    before = converted(folder, "before.csv")
    after = converted(folder, "after.csv", "--range", "self", "--report")
    assert "range self: 2 controls stretched" in capsys.readouterr().out
    for side in "LR":
        lids = after.curve(f"{RIG}eyeBlink{side}")
        tops = np.array([lids[at - 1 : at + 2].max() for at in BLINKS])
        assert before.curve(f"{RIG}eyeBlink{side}").max() < 0.68
        # At least six of the seven full blinks close the lids, and all nearly close them.
        assert (tops == 1.0).sum() >= 6
        assert np.delete(tops, 5).min() > 0.97
        assert tops[5] < 0.7  # the half blink stays half
        assert lids.max() == 1.0
        assert np.median(lids) < 0.01  # open lids are neutral
    untouched = [name for name in before.names if "eyeBlink" not in name]
    for name in untouched:  # noise, gaze and controls without extremes stay equal bit for bit
        assert np.array_equal(before.curve(name), after.curve(name)), name


def test_a_range_of_motion_tells_neutral_and_extremes(folder):
    found = load_ranges(folder / "rom.range.toml").controls
    used = {name.removeprefix(RIG) for name, row in found.items() if not row.reason}
    assert used == {
        "eyeBlinkL", "eyeBlinkR", "jawOpen", "mouthCornerPullL", "mouthCornerPullR",
    }  # fmt: skip
    lid, jaw = found[f"{RIG}eyeBlinkL"].range, found[f"{RIG}jawOpen"].range
    assert lid == pytest.approx((0.1, 0.75), abs=0.005)  # both sides use the weaker side's extreme
    assert jaw == pytest.approx((0.0, 0.8), abs=0.005)  # the spike is no extreme
    for name in ("eyeBlink", "mouthCornerPull"):
        assert found[f"{RIG}{name}L"] == found[f"{RIG}{name}R"]
    reasons = {name.removeprefix(RIG): row.reason for name, row in found.items()}
    assert reasons["mouthLipsTogetherUL"] == "is a share of another control"
    assert reasons["browRaiseInL"] == "moves no more than its noise"
    assert reasons["mouthLipsPurseUL"] == "does not come near its extreme"
    assert reasons["noseWrinkleL"] == "is never at rest"
    assert reasons["eyeLookUpL"] == "gaze is an angle"
    assert reasons["jawFwd"] == "hardly moves"


def test_the_file_is_for_editing(folder, tmp_path, capsys):
    out = tmp_path / "ada.range.toml"
    assert run("learn", folder / "rom.csv", "-o", out) == 0
    table = capsys.readouterr().out
    assert "control" in table and "left as captured" in table  # noqa: PT018
    assert "CTRL_expressions.jawFwd" in table and "hardly moves" in table  # noqa: PT018
    assert "5 controls stretched" in table
    text = out.read_text()
    assert text == ranges_text(load_ranges(out))
    assert 'source = "rom.csv"' in text
    # As a user may edit the file: use the pucker, switch the jaw off, and omit a control's prefix.
    text = text.replace(', off = "does not come near its extreme"', "")
    text = text.replace('"CTRL_expressions.jawOpen" = {', "jawOpen = { off = true,")
    out.write_text(text)
    used = load_ranges(out).used()
    assert f"{RIG}mouthLipsPurseUL" in used
    assert f"{RIG}jawOpen" not in used
    assert run("learn", folder / "rom.csv", "-o", out) == 2
    assert "it is there already" in capsys.readouterr().err
    assert out.read_text() == text


def test_what_is_at_rest_is_not_amplified_and_order_is_kept():
    random = np.random.default_rng(7)
    for width in (0.1, 0.5, 0.625, 1.0, 1.4, 1.9):
        neutral = float(random.uniform(0.0, 0.9))
        remap = Remap(["a"], {"a": Range(neutral, neutral + width)})
        at = np.linspace(-0.5, 3.0, 7001, dtype=np.float32)
        out = remap(at[:, None])[:, 0]
        assert (np.diff(out) >= -1e-6).all()
        assert np.array_equal(out[at < 0.0], at[at < 0.0])
        low, high = np.float32(neutral), np.float32(neutral + width)
        assert out[(at >= 0) & (at <= low)].max(initial=0.0) == 0.0
        assert (out[(at >= high) & (at <= 1.0)] == 1.0).all()
        if width < 0.5:  # hand-written only; learned: 2 at most
            continue
        noise = np.float32(neutral) + np.float32(0.02) * random.normal(size=400).astype(np.float32)
        calm = noise[noise >= low]
        assert np.abs(remap(calm[:, None])[:, 0]).max() <= (calm - low).max() * 1.25
    over = Remap(["a", "b"], {"a": Range(0.0, 0.8)})
    assert over(np.array([1.3, 1.3], np.float32)).tolist() == [np.float32(1.3)] * 2


def frames(values):
    """Frames of Live Link Face with the rows of a take."""
    names = livelink.NAMES
    columns = [camel(name) for name in COLUMNS[:52]]
    places = [columns.index(name) for name in names[:52]]
    rows = np.zeros((len(values), len(names)), np.float32)
    rows[:, :52] = np.round(values, 10)[:, places]
    return [Frame("Ada", n / RATE, n / RATE, n + 1, names, row) for n, row in enumerate(rows)]


def test_a_stream_gives_the_values_of_the_file(folder):
    ranges = load_ranges(folder / "rom.range.toml")
    want = converted(folder, "ranged.csv", "--range", folder / "rom.range.toml")
    shaper, take = Shaper(smoothing=0.5), LiveTake("Ada")
    shaper.ranges = ranges
    for frame in frames(performance()):
        take.add(frame)
    clip = take.clip(shaper)
    assert not is_captured(clip)
    assert clip.curve(f"{RIG}eyeBlinkL").max() > 0.8  # the extreme in rom.csv is higher
    for name in want.names:
        if not name.startswith(("head.", "eye")):
            assert np.array_equal(clip.curve(name), want.curve(name)), name
    shaper.smoothing = 0.0
    frame = frames(performance())[BLINKS[0]]
    ranged = shaper.apply(frame)
    shaper.ranges = None
    plain = shaper.apply(frame)
    lid = plain.names.index(f"{RIG}eyeBlinkL")
    assert ranged.values[lid] == want.curve(f"{RIG}eyeBlinkL")[BLINKS[0]]
    assert plain.values[lid] == np.float32(round(performance()[BLINKS[0]][0], 10))


def test_ranges_are_taken_out_once(folder, tmp_path, capsys):
    once = tmp_path / "once.rzc"
    assert run("convert", folder / "take.csv", "-o", once, "--range", "self") == 0
    assert is_captured(importing.import_file(folder / "take.csv")[0])
    assert not is_captured(Clip.load(once))
    assert run("convert", once, "-o", tmp_path / "twice.rzc", "--range", "self") == 1
    error = capsys.readouterr().err
    assert "once.rzc: a capture as it came was expected, found one whose range was" in error
    assert not (tmp_path / "twice.rzc").exists()


def test_neutral_now_is_not_taken_away_twice():
    shaper = Shaper()
    shaper.ranges = Ranges(parse_ranges(ranges_text(_lid(0.2, 0.8)), "x").controls)
    names = ("eyeBlinkLeft",)

    def shown(value):
        frame = Frame("x", 0.0, 0.0, 1, names, np.array([value], np.float32))
        return float(shaper.apply(frame).values[0])

    assert (shown(0.2), shown(0.8)) == (0.0, 1.0)
    shaper.capture(Frame("x", 0.0, 0.0, 1, names, np.array([0.2], np.float32)))
    assert (shown(0.2), shown(0.8)) == pytest.approx((0.0, 1.0), abs=1e-6)
    assert shown(0.3) > 0.05
    shaper.capture(None)
    assert (shown(0.2), shown(0.8)) == (0.0, 1.0)


def _lid(neutral, extreme):
    text = f'"eyeBlinkL" = {{ neutral = {neutral}, extreme = {extreme} }}\n'
    return parse_ranges(f'format = "risorius range 1"\n[controls]\n{text}', "x.toml")


@pytest.mark.parametrize(
    ("row", "sentence"),
    [
        ("jawOpen = 3", "controls.jawOpen: { neutral = N, extreme = N } was expected, found 3"),
        ("jawOpen = { neutral = 0.1 }", "controls.jawOpen: { neutral = N, extreme = N } was"),
        ("jawOpen = { neutral = 0.95, extreme = 1.2 }", "controls.jawOpen.neutral: 0 to 0.9 was"),
        ("jawOpen = { neutral = -0.1, extreme = 1 }", "neutral: 0 to 0.9 was expected, found -0.1"),
        ("jawOpen = { neutral = 0.1, extreme = 0.15 }", "extreme: 0.2 to 2 was expected for the"),
        ("jawOpen = { neutral = 0, extreme = 2 }", "0.1 to 1.9 was expected for the neutral 0"),
        ("jawOpen = { neutral = 0, extreme = nan }", "extreme: a number up to 100 was expected"),
        (
            "jawOpen = { neutral = true, extreme = 1 }",
            "a number up to 100 was expected, found True",
        ),
        (f"jawOpen = {{ neutral = 1{'0' * 400}, extreme = 1 }}", "a number up to 100 was expected"),
        (
            "jawOpen = { neutral = 0, extreme = 1, gain = 2 }",
            "controls.jawOpen.gain: one of neutral",
        ),
        ("jawOpen = { neutral = 0, extreme = 1, off = 7 }", "off: a reason or true was expected"),
        (f"jawOpen = {{ neutral = 0, extreme = 1 }}\n'{RIG}jawOpen' = {{ }}", "is there twice"),
        ("jawOpen = {", "a TOML file of ranges was expected: "),
    ],
)
def test_a_file_that_cannot_be_used_is_one_sentence(row, sentence, folder, tmp_path, capsys):
    path, out = tmp_path / "bad.range.toml", tmp_path / "out.csv"
    path.write_text(f'format = "risorius range 1"\n[controls]\n{row}\n')
    assert run("convert", folder / "take.csv", "-o", out, "--range", path) == 1
    error = capsys.readouterr().err
    assert sentence in error
    assert error.startswith(f"risorius: {path}: ") and error.count("\n") == 1  # noqa: PT018
    assert not out.exists()


def test_other_files_and_short_takes_are_refused(folder, tmp_path, capsys):
    other, out = tmp_path / "mapping.toml", tmp_path / "x.range.toml"
    other.write_text('base = "arkit"\n')
    assert main(["live", "--port", "0", "--seconds", "0.01", "--range", str(other)]) == 1
    assert "format: 'risorius range 1' was expected, found None" in capsys.readouterr().err
    assert main(["live", "--port", "0", "--range", str(tmp_path / "absent.toml")]) == 1
    assert "absent.toml: cannot read it" in capsys.readouterr().err
    short = written(tmp_path / "short.csv", performance()[:60])
    assert run("learn", short, "-o", out) == 1
    assert "short.csv: a take of at least 2 s was expected" in capsys.readouterr().err
    assert run("convert", short, "-o", tmp_path / "x.csv", "--range", "self") == 1
    assert "short.csv: a take of at least 2 s" in capsys.readouterr().err
    holed = Clip([f"{RIG}jawOpen"], [[0.0] * 200 + [np.nan]], 60.0)
    with pytest.raises(ValueError, match=r"jawOpen, frame 200: a finite number was expected"):
        learn(holed)
    with pytest.raises(ValueError, match="found none"):
        learn(holed.replaced(names=["head.yaw"], curves=[[0.0] * 201]))
    for options in (["-o", "x.txt"], ["-o", str(out), "--most-gain", "9"]):
        assert run("learn", folder / "take.csv", *options) == 2
    assert sorted(p.name for p in tmp_path.iterdir()) == ["mapping.toml", "short.csv"]


def test_a_real_take_closes_its_eyes():
    if not REAL.exists():
        pytest.skip("EXTRA NOT RUN: no real take of Live Link Face beside the clone")
    clip, _ = importing.import_file(REAL)
    found = learn(clip, performance=True)
    after = found.apply(clip)
    gains = [range_.gain for range_ in found.used().values()]
    assert max(gains) <= 1.6
    for side in "LR":
        lids, shut = clip.curve(f"{RIG}eyeBlink{side}"), after.curve(f"{RIG}eyeBlink{side}")
        assert (lids == 1.0).sum() == 0
        assert (shut == 1.0).sum() > 100
