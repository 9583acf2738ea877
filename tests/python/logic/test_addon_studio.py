# SPDX-License-Identifier: MIT
"""The studio's camera shows head and shoulders, and its lights follow portrait photography."""

from __future__ import annotations

import importlib
import math
from typing import Any

import pytest
import test_addon_logic  # noqa: F401  loads the package

studio: Any = importlib.import_module("risorius_addon_logic.character.studio_plan")

GROWN = (0.063, (-0.2, -0.1, -0.42), (0.2, 0.2, 0.125))  # an adult, with shoulders
GIRL = (0.056, (-0.1, -0.09, -0.2), (0.1, 0.14, 0.13))  # a child whose mesh ends at the neck


def edges(plan):
    """Heights of the picture's lower and upper edge above the eyes, in m, in the eyes' plane."""
    x, y, z = plan.camera
    away, whole = math.hypot(x, y), math.dist(plan.camera[:2], plan.target[:2])
    middle = z + (plan.target[2] - z) * away / whole
    half = away * studio.SENSOR / plan.lens / 2
    return middle - half, middle + half


def test_the_eyes_lie_on_the_upper_third_of_head_and_shoulders():
    low, high = edges(studio.plan(*GROWN))
    assert high / (high - low) == pytest.approx(1 / 3, abs=0.02)
    assert 0.125 < high < 0.2
    assert low > GROWN[1][2]


def test_a_neck_that_ends_is_below_the_picture_and_high_hair_in_it():
    low, high = edges(studio.plan(*GIRL))
    assert low > GIRL[1][2]
    assert high > GIRL[2][2]
    bun = (0.1, 0.14, 0.24)
    assert edges(studio.plan(*GIRL[:2], bun))[1] > bun[2]


def test_a_head_that_ends_at_the_chin_is_in_the_picture_whole():
    for end in (-0.1, -0.135, -0.18):  # the last: eyes are estimated
        low, high = edges(studio.plan(0.063, (-0.08, -0.1, end), (0.08, 0.1, 0.12)))
        assert low < end
        assert high > 0.12


def test_it_grows_with_the_head():
    one = studio.plan(*GROWN)
    ten = studio.plan(*[[10 * x for x in v] if isinstance(v, tuple) else 10 * v for v in GROWN])
    assert ten.camera == pytest.approx([10 * x for x in one.camera])
    assert ten.wall_size == pytest.approx([10 * x for x in one.wall_size])
    for small, large in zip(one.lamps, ten.lamps, strict=True):
        assert large.place == pytest.approx([10 * x for x in small.place])
        assert large.watts == pytest.approx(100 * small.watts)


def test_lens_and_lights_are_a_portrait_s():
    plan = studio.plan(*GROWN)
    assert 85 <= plan.lens <= 105
    assert plan.camera[2] > 0 > plan.camera[1]
    light = {}
    for lamp in plan.lamps:
        x, y, z = lamp.place
        far = math.hypot(x, y, z)
        light[lamp.name] = lamp.watts / (math.pi * far * far)
        up, aside = math.degrees(math.asin(z / far)), math.degrees(math.atan2(x, -y))
        if lamp.name == "Key":
            assert (up, abs(aside)) == (pytest.approx(30), pytest.approx(45))
        elif lamp.name == "Rim":
            assert abs(aside) > 120
            assert up > 20
    assert math.log2(light["Key"] / light["Fill"]) == pytest.approx(2)


def test_lamps_and_backdrop_are_outside_of_the_picture_and_behind_it():
    plan = studio.plan(*GROWN)
    camera, target = plan.camera, plan.target
    way = [t - c for t, c in zip(target, camera, strict=True)]
    slope = studio.SENSOR / plan.lens / 2 * 16 / 9  # half the width of a 16:9 picture
    for lamp in plan.lamps:
        off = [p - c for p, c in zip(lamp.place, camera, strict=True)]
        along = sum(a * b for a, b in zip(off, way, strict=True)) / math.hypot(*way)
        across = math.sqrt(max(math.hypot(*off) ** 2 - along**2, 0.0)) - max(lamp.size) / 2
        assert along < 0 or across > slope * along, lamp.name
    assert plan.wall[1] > GROWN[2][1]
    assert plan.wall_size[0] > 2 * slope * math.dist(plan.wall, camera)


@pytest.mark.parametrize("apart", [0.0, -1.0, math.nan, math.inf])
def test_eyes_without_distance_are_refused(apart):
    with pytest.raises(ValueError, match="apart: a distance above 0"):
        studio.plan(apart, *GROWN[1:])
