# SPDX-License-Identifier: MIT
"""Tests idle movement: equal seeds give equal clips, and values are in range.

Blinks and gazes are as fast and as frequent as those of people.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from risorius import Layer, Mixer
from risorius.anim.idle import Life, idle, lid, make_blinks, make_saccades

P = "CTRL_expressions."
EVENTS = [2.627142, 4.442169, 5.256676, 6.696148, 7.151234, 12.052773, 15.843215, 19.376299]
BROW = [0.008751106, 0.0261953, 0.02282599, 0.004662689, 0.006181408]
LOOK = [0, 0, 0, 0, 0.006762466]


def blinks_and_saccades(seed, length=600.0, life=None, loop=False):
    life = life or Life()
    saccades = make_saccades(seed, length, life, loop)
    return make_blinks(seed, length, life, loop, saccades), saccades


def angles(clip, side="L"):
    """Rotation of an eye in degrees: to the face's left, and up."""
    look = {d: clip.curve(f"{P}eyeLook{d}{side}") for d in ("Left", "Right", "Up", "Down")}
    return (look["Left"] - look["Right"]) * 35.0, (look["Up"] - look["Down"]) * 30.0


def test_a_seed_gives_the_same_everywhere():
    # The constants were recorded in one run. On another machine, NumPy's random bits or arithmetic
    # could differ.
    clip = idle(7, 20.0)
    assert [round(e.time, 6) for e in clip.events] == EVENTS
    np.testing.assert_allclose(clip.curve(P + "browRaiseInL")[::300], BROW, atol=1e-6)
    np.testing.assert_allclose(clip.curve(P + "eyeLookLeftR")[::300], LOOK, atol=1e-6)
    assert (idle(7, 20.0).curves == clip.curves).all()
    assert (idle(8, 20.0).curves != clip.curves).any()


@pytest.mark.parametrize("seed", range(4))
def test_is_in_range_and_of_standard_controls(seed, standard_controls):
    clip = idle(seed, 60.0, 50.0, start=3.0)
    assert set(clip.names) <= set(standard_controls)
    assert (clip.curves >= 0.0).all()
    assert (clip.curves <= 1.0).all()
    assert (clip.frame_count, clip.start, clip.rate) == (3001, 3.0, 50.0)


def test_blinks_come_as_often_and_last_as_long_as_peoples():
    everything = [blinks_and_saccades(seed)[0] for seed in range(8)]
    blinks = [b for some in everything for b in some]
    assert 14.0 < len(blinks) / 80.0 < 22.0  # blinks per minute
    lengths = np.array([b.close + b.hold + b.open for b in blinks])
    assert lengths.min() > 0.15
    assert lengths.max() < 0.33
    assert all(b.open > 2.2 * b.close for b in blinks)
    gaps = np.concatenate([np.diff([b.start for b in some]) for some in everything])
    assert np.mean(gaps) > 1.15 * np.median(gaps)  # long tails, as in log-normal intervals
    assert 0.02 < (gaps < 0.6).mean() < 0.25  # fraction of short gaps: double blinks
    for some in everything:
        assert all(b.start >= a.end for a, b in pairwise(some))


def test_a_lid_falls_faster_than_it_rises():
    blink = blinks_and_saccades(1)[0][0]
    times = blink.start + np.arange(-0.1, 0.5, 0.001)
    curve = lid(blink, times)
    peak = int(np.argmax(curve))
    assert curve[0] == curve[-1] == 0.0
    assert curve.max() == pytest.approx(blink.amount)
    assert (np.diff(curve[:peak]) >= 0).all()
    assert np.diff(curve).max() > 1.3 * -np.diff(curve).min()


def test_saccades_follow_the_main_sequence_and_come_back():
    _, saccades = blinks_and_saccades(2)
    sizes = np.array([np.hypot(*np.subtract(s.after, s.before)) for s in saccades])
    durations = np.array([s.duration for s in saccades])
    np.testing.assert_allclose(durations, 0.021 + 0.0022 * sizes, atol=1e-9)
    speed = 1.875 * sizes / durations  # peak speed of a minimum-jerk movement
    assert speed[sizes > 10].min() > 350
    assert speed.max() < 900  # degrees per second
    for before, after in pairwise(saccades):
        assert before.after == after.before
        assert after.start >= before.start + before.duration + 0.13
    x, y = angles(idle(2, 600.0))
    centre = (np.abs(x) + np.abs(y) < 4.0).mean()
    assert 0.35 < centre < 0.9
    assert np.abs(x).max() > 12.0
    assert np.abs(x).mean() > np.abs(y).mean()


def test_both_eyes_look_the_same_way_and_lids_follow():
    life = Life(blinks_per_minute=0.0)
    clip = idle(3, 120.0, life=life)
    assert (np.array(angles(clip, "L")) == np.array(angles(clip, "R"))).all()
    blinks = {round((e.time) * 60) for e in clip.events}
    down = clip.curve(P + "eyeLookDownL")
    lids = clip.curve(P + "eyeBlinkL")
    free = np.ones(clip.frame_count, bool)
    for frame in blinks:
        free[max(frame - 2, 0) : frame + 25] = False
    np.testing.assert_allclose(lids[free], life.lid_follow * down[free], atol=1e-6)
    assert down.max() > 0.1


def test_movement_at_rest_is_slow_small_and_never_repeats():
    clip = idle(4, 120.0)
    for name in ("browRaiseInL", "mouthCornerPullR", "noseNostrilDilateL", "jawOpen"):
        curve = clip.curve(P + name).astype(np.float64)
        assert 0.002 < np.ptp(curve) < 0.1
        power = np.abs(np.fft.rfft(curve - curve.mean())) ** 2
        band = np.fft.rfftfreq(curve.size, 1 / 60.0)
        assert power[band > 4.0].sum() < 0.002 * power.sum()
        part = curve - curve.mean()
        again = np.correlate(part, part, "full")[curve.size :] / (part @ part)
        assert again[300:].max() < 0.6  # correlation of the curve with itself after 5 s or more
    left, right = clip.curve(P + "browRaiseInL"), clip.curve(P + "browRaiseInR")
    assert 0.6 < np.corrcoef(left, right)[0, 1] < 0.999


def test_a_loop_closes_without_a_step():
    clip = idle(5, 30.0, loop=True)
    assert (clip.curves[:, 0] == clip.curves[:, -1]).all()
    mixer = Mixer(clip.names, [Layer(clip, extend="repeat")])
    around = mixer.evaluate_batch(30.0 + np.arange(-30, 31) / 240.0)
    assert np.abs(np.diff(around, axis=0)).max() < 0.003
    assert len(clip.events) > 3


def test_parts_can_be_turned_off():
    still = idle(6, 30.0, life=Life(blinks_per_minute=0.0, gaze=0.0, micro=0.0))
    assert not still.curves.any()
    assert still.events == ()
    eyes = idle(6, 30.0, life=Life(micro=0.0))
    assert (eyes.curve(P + "eyeBlinkL") == idle(6, 30.0).curve(P + "eyeBlinkL")).all()


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ((-1, 10.0), "seed: a whole number from 0 was expected, found -1"),
        ((1, 0.0), "duration: a number above 0"),
        ((1, np.nan), "duration"),
        ((1, 10.0, 0.0), "rate: a number above 0"),
    ],
)
def test_refuses(arguments, sentence):
    with pytest.raises(ValueError, match=sentence):
        idle(*arguments)
    with pytest.raises(ValueError, match="of a loop"):
        idle(1, 1.0, loop=True)


def test_a_short_loop_of_a_wide_gaze_closes():
    for seed in range(60):
        clip = idle(seed, 2.0, loop=True, life=Life(gaze=60.0))
        assert np.isfinite(clip.curves).all()


def test_a_loop_needs_frames():
    with pytest.raises(ValueError, match="at least 2 s"):
        idle(0, 2.0, 0.4, loop=True)
