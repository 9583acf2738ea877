# SPDX-License-Identifier: MIT
"""Tests Clip objects: valid and refused arguments, and interpolation between frames."""

from __future__ import annotations

import numpy as np
import pytest
from risorius import Clip, Event


def make(**changes):
    values = {"names": ["a", "b"], "curves": [[0, 1, 2], [4, 4, 0]], "rate": 10.0} | changes
    return Clip(**values)


def test_keeps_every_bit():
    bits = np.array([[0x7FC12345, 0x80000000, 0x00000001, 0xFF800000]], np.uint32)
    assert (Clip(["x"], bits.view(np.float32)).curves.view(np.uint32) == bits).all()


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"names": ["a", "a"]}, "a: a control may have one curve only"),
        ({"names": ["a"]}, r"found the shape \[2, 3\]"),
        ({"curves": [1, 2]}, r"found the shape \[2\]"),
        ({"rate": 0.0}, "rate above 0"),
        ({"rate": np.inf}, "rate above 0"),
        ({"start": np.nan}, "start in seconds"),
        ({"times": [0.0, 1.0]}, "3 times were expected"),
        ({"times": [0.0, 1.0, 1.0]}, "frame 2: a time after 1.0 s was expected"),
        ({"times": [0.0, np.nan, 1.0]}, "frame 1: its time is no number"),
    ],
)
def test_refuses(changes, sentence):
    with pytest.raises(ValueError, match=sentence):
        make(**changes)


def test_samples_straight_lines_and_holds_its_ends():
    clip = make(start=2.0)
    times = [0.0, 2.0, 2.05, 2.15, 2.2, 9.0]
    expected = [[0, 4], [0, 4], [0.5, 4], [1.5, 2], [2, 0], [2, 0]]
    np.testing.assert_allclose(clip.sample(times), expected, atol=1e-6)
    uneven = make(times=[0.0, 1.0, 4.0])
    np.testing.assert_allclose(uneven.sample([2.5]), [[1.5, 2.0]], atol=1e-6)
    assert uneven.duration == 4.0


def test_a_frames_own_time_gives_its_very_bits():
    rng = np.random.default_rng(5)
    curves = rng.normal(size=(3, 1000)).astype(np.float32)
    clip = Clip(["a", "b", "c"], curves, 29.97, start=1 / 3)
    assert (clip.sample(clip.frame_times()) == curves.T).all()


def test_resamples_and_selects():
    clip = make()
    twice = clip.resampled(20.0)
    np.testing.assert_allclose(twice.curve("a"), [0, 0.5, 1, 1.5, 2], atol=1e-6)
    assert twice.rate == 20.0
    assert twice.duration == clip.duration
    assert clip.selected(["b"]).names == ("b",)
    with pytest.raises(KeyError):
        clip.selected(["c"])


def test_gives_a_rig_its_controls_and_says_what_it_lacks():
    raw, unknown = make().raw_controls(["z", "b"])
    assert raw.tolist() == [[0, 4], [0, 4], [0, 0]]
    assert unknown == ["a"]


def test_events_are_in_order_of_time():
    clip = make(events=[Event(2.0, "late"), Event(1.0, "early", 0.5, "x")])
    assert [event.name for event in clip.events] == ["early", "late"]


def test_is_a_value():
    curves = np.zeros((1, 2), np.float32)
    clip = Clip(["a"], curves)
    curves[:] = 1.0
    assert (clip.curves == 0.0).all()
    with pytest.raises(ValueError, match="read-only"):
        clip.curves[0, 0] = 1.0


def test_a_time_that_is_no_number_is_the_first_frames():
    assert make().sample([np.nan]).tolist() == [[0, 4]]
    assert make(times=[0.0, 1.0, 4.0]).sample([np.nan]).tolist() == [[0, 4]]
