# SPDX-License-Identifier: MIT
"""Tests the processing steps of clips, such as smoothing. Each step is compared with a formula."""

from __future__ import annotations

import numpy as np
import pytest
from risorius import Clip, Event
from risorius.importing import process

RIG = "CTRL_expressions."
AT = np.arange(120) / 60.0


def clip(curve, **options):
    return Clip([RIG + "jawOpen"], [curve], 60.0, **options)


def only(result):
    assert len(result.names) == 1
    return result.curves[0].astype(float)


def test_resamples_on_straight_lines():
    out = process.resample(clip(AT, times=AT**1.5), 24.0)
    np.testing.assert_allclose(
        only(out), np.interp(np.arange(out.frame_count) / 24.0, AT**1.5, AT), atol=1e-6
    )
    with pytest.raises(ValueError, match="rate above 0"):
        process.resample(out, 0.0)


@pytest.mark.parametrize("times", [None, AT + 0.5])
def test_shifts_frames_and_events(times):
    events = [Event(1.0, "x")]
    before = clip(AT, times=times, events=events)
    after = process.shift(before, -0.25)
    np.testing.assert_allclose(after.frame_times(), before.frame_times() - 0.25)
    assert after.events[0].time == 0.75


@pytest.mark.parametrize("times", [None, AT])
def test_cuts_frames_and_events(times):
    before = clip(AT, times=times, events=[Event(0.4, "in"), Event(1.5, "out")])
    after = process.cut(before, 0.25, 0.5)
    np.testing.assert_allclose(after.frame_times(), np.arange(15, 31) / 60.0)
    np.testing.assert_allclose(only(after), after.frame_times(), atol=1e-6)
    assert [event.name for event in after.events] == ["in"]
    with pytest.raises(ValueError, match="frames from 5 s to 6 s were expected, the clip goes"):
        process.cut(before, 5, 6)


def test_gains_and_offsets_by_pattern():
    before = Clip([RIG + "jawOpen", RIG + "eyeBlinkL", "head.yaw"], [[0.5], [0.5], [0.5]])
    after = process.adjust(before, {"jaw*": 1.5, "*": 2.0}, {RIG + "eyeBlinkL": 0.25})
    np.testing.assert_allclose(after.curves[:, 0], [1.5, 1.25, 1.0])
    with pytest.raises(ValueError, match="ear: fits no control of the clip"):
        process.adjust(before, {"ear": 1.0})
    assert process.parse_amounts(["jaw*=1.2", "a=b=-1"]) == {"jaw*": 1.2, "a=b": -1.0}
    for bad in ("jaw", "jaw=x", "=1", "a=nan"):
        with pytest.raises(ValueError, match="PATTERN=NUMBER was expected"):
            process.parse_amounts([bad])


def test_the_neutral_becomes_0_and_full_stays_1():
    curves = [[0.2, 0.2, 0.6, 1.0, 0.1], [0.3, 0.1, 0.5, -0.4, 0.2], [-0.5, 0.0, 1.0, 0.5, 0.0]]
    before = Clip([RIG + "jawOpen", "head.yaw", RIG + "odd"], curves)
    after = process.calibrate(before, 0, 1)
    np.testing.assert_allclose(after.curves[0], [0, 0, 0.5, 1.0, 0.0], atol=1e-6)
    np.testing.assert_allclose(after.curves[1], np.array(curves[1]) - 0.2, atol=1e-6)
    np.testing.assert_allclose(after.curves[2], (np.array(curves[2]) + 0.25) / 1.25, atol=1e-6)
    held = process.calibrate(clip([0.99, 1.0]), 0)
    np.testing.assert_allclose(only(held), [0.0, 0.01 / 0.05], atol=1e-5)
    for frames in ((5,), (-1,), (3, 2), (0, 5)):
        with pytest.raises(ValueError, match="frames from 0 to 4 were expected"):
            process.calibrate(before, *frames)


def test_a_face_at_rest_with_shut_lips_keeps_them_shut():
    """At rest the jaw is slightly open and mouthLipsTogether is 1; later shut lips still give 1."""
    lips = RIG + "mouthLipsTogetherDL"
    before = Clip([lips, RIG + "jawOpen"], [[1.0, 1.0, 0.5], [0.04, 0.52, 0.52]])
    after = process.calibrate(before, 0)
    np.testing.assert_allclose(after.curve(RIG + "jawOpen"), [0, 0.5, 0.5], atol=1e-6)
    np.testing.assert_allclose(after.curve(lips), [0, 1, (0.26 - 0.04) / 0.48], atol=1e-6)
    alone = process.calibrate(Clip([lips], [[0.5, 0.75]]), 0)
    np.testing.assert_allclose(alone.curve(lips), [0, 0.5])


def test_smoothing_passes_cubics_and_takes_noise():
    cubic = 0.2 + AT - 0.7 * AT**2 + 0.2 * AT**3
    np.testing.assert_allclose(only(process.smooth(clip(cubic), 0.2)), cubic, atol=1e-5)
    noise = np.random.default_rng(1).normal(size=5000)
    out = only(process.smooth(clip(noise), 0.2))  # half width 6: 13 frames
    # Remaining variance of noise at the middle of a cubic fit to 2 m + 1 = 13 samples: 3 (3 m^2 + 3
    # m - 1) / ((2m+3)(2m+1)(2m-1)).
    expected = 3 * (3 * 36 + 18 - 1) / (15 * 13 * 11)
    assert abs(out[20:-20].var() / expected - 1.0) < 0.1


def test_smoothing_fits_a_polynomial_around_every_frame_and_keeps_the_range():
    values = np.random.default_rng(4).uniform(size=60)
    out = only(process.smooth(clip(values), 0.2))
    for i in range(60):
        first = min(max(i - 6, 0), 60 - 13)
        window = np.arange(first, first + 13)
        fit = np.polyval(np.polyfit(window - i, values[window], 3), 0.0)
        assert out[i] == pytest.approx(np.clip(fit, values.min(), values.max()), abs=1e-5)
    step = only(process.smooth(clip(np.where(AT < 1.0, 0.0, 1.0)), 0.2))
    assert (step.min(), step.max()) == (0.0, 1.0)


def test_smoothing_keeps_a_peaks_height_and_time():
    blink = np.exp(-0.5 * ((AT - 1.0) / 0.05) ** 2)
    kept = only(process.smooth(clip(blink), 0.1))
    assert int(np.argmax(kept)) == 60
    assert kept.max() > 0.97
    soft = only(process.gaussian(clip(blink), 0.05))
    assert int(np.argmax(soft)) == 60
    # The squared widths of successive Gaussians add up. Blink and filter are both 0.05 s wide, so
    # the blink becomes sqrt(2) times as wide, and its height falls by this factor.
    assert soft.max() == pytest.approx(1 / np.sqrt(2), abs=0.01)


def test_short_clips_and_wrong_widths():
    one = clip([0.5])
    assert process.smooth(one, 0.2) is one
    assert only(process.gaussian(one, 0.2)).tolist() == [0.5]
    for run in (lambda: process.smooth(one, 0.0), lambda: process.gaussian(one, -1.0)):
        with pytest.raises(ValueError, match="above 0 s was expected"):
            run()


def test_one_euro_holds_noise_and_follows_motion():
    """The filter gives the values of the paper's algorithm, written here as a plain loop."""
    rng = np.random.default_rng(2)
    values = np.where(AT > 1.0, 1.0, 0.0) + rng.normal(scale=0.01, size=120)
    out = only(process.one_euro(clip(values), 1.5, 5.0))
    last, speed, expected = np.float32(values[0]), 0.0, []
    for i, value in enumerate(np.float32(values).astype(float)):
        if i:
            step = 1 / 60
            alpha = 1 / (1 + 1 / (2 * np.pi * 1.0 * step))
            speed = alpha * (value - last) / step + (1 - alpha) * speed
            alpha = 1 / (1 + 1 / (2 * np.pi * (1.5 + 5.0 * abs(speed)) * step))
            last = alpha * value + (1 - alpha) * last
        expected.append(last)
    np.testing.assert_allclose(out, expected, atol=1e-5)
    assert out[40:60].std() < 0.5 * values[40:60].std()
    assert out[66] > 0.8


def test_one_euro_live_is_the_same_and_knows_late_frames():
    running = process.OneEuro()
    first = running(0.0, [0.0])
    assert running(0.0, [1.0]).tolist() == first.tolist()
    assert running(0.1, [0.5, 0.5]).tolist() == [0.5, 0.5]
    with pytest.raises(ValueError, match="cutoffs above 0"):
        process.OneEuro(0.0)


def test_gaps_are_filled_with_straight_lines_or_held():
    keep = np.ones(120, bool)
    keep[[10, 50, 51, 52, 53, 54, 55]] = False
    before = clip(AT[keep], times=AT[keep])
    full = process.fill_gaps(before)
    np.testing.assert_allclose(full.frame_times(), AT, atol=1e-9)
    assert full.times is None
    np.testing.assert_allclose(only(full), AT, atol=1e-6)
    held = only(process.fill_gaps(before, longest=0.05))
    np.testing.assert_allclose(held[50:56], AT[49], atol=1e-6)
    np.testing.assert_allclose(held[10], AT[10], atol=1e-6)


def test_repeated_frames_go_and_the_length_stays():
    after = process.drop_repeats(Clip("ab", [[0, 0, 1, 1, 1], [5, 5, 5, 6, 6]], 10.0))
    np.testing.assert_allclose(after.frame_times(), [0, 0.2, 0.3, 0.4])
    assert after.curves.tolist() == [[0, 1, 1, 1], [5, 5, 6, 6]]


def test_mirror_swaps_sides():
    pairs = {
        "mouthCornerPullL": "mouthCornerPullR", "eyeLookLeftL": "eyeLookRightR",
        "eyeLookUpL": "eyeLookUpR", "jawLeft": "jawRight", "teethLeftU": "teethRightU",
        "mouthLipsStickyLPh2": "mouthLipsStickyRPh2", "mouthPressUL": "mouthPressUR",
        "jawOpen": "jawOpen", "mouthUp": "mouthUp", "mouthStickyUINL": "mouthStickyUINR",
        "eyeParallelLookDirection": "eyeParallelLookDirection", "neckSwallowPh1": "neckSwallowPh1",
    }  # fmt: skip
    for left, right in pairs.items():
        assert process.mirrored_name(RIG + left) == RIG + right
        assert process.mirrored_name(RIG + right) == RIG + left
    names = [RIG + "jawLeft", "head.yaw", "head.pitch", "head.roll", "eyeL.yaw", "eyeR.pitch"]
    out = process.mirror(Clip(names, [[0.1], [0.2], [0.3], [0.6], [0.4], [0.5]]))
    assert out.names[0] == RIG + "jawRight"
    assert out.names[1:] == ("head.yaw", "head.pitch", "head.roll", "eyeR.yaw", "eyeL.pitch")
    np.testing.assert_allclose(out.curves[:, 0], [0.1, -0.2, 0.3, -0.6, -0.4, 0.5])
