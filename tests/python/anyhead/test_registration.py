# SPDX-License-Identifier: MIT
"""Tests of the registration on computed heads, whose corresponding points are known exactly."""

from __future__ import annotations

import dataclasses

import any_heads
import numpy as np
import pytest
from risorius.anyhead.registration import (
    RegisterOptions,
    RegistrationError,
    StoppedError,
    register,
)
from risorius.anyhead.surface import Surface

OPTIONS = RegisterOptions(nodes=300)
MM = any_heads.HEAD_MM / 24  # mm per unit of the template


@pytest.fixture(scope="module")
def heads():
    return any_heads.formula_heads(seed=5, size=0.3)  # another unit than the template's


@pytest.fixture(scope="module")
def found(heads):
    template, target, true = heads
    pairs = any_heads.marked(template, true, noise=0.005)
    return register(template, target, pairs, OPTIONS)


def _mm(template, found, true):
    """Errors of vertices along the surface, in mm for a head of 240 mm."""
    return any_heads.errors(template, found, true) * any_heads.HEAD_MM / np.ptp(true[:, 1])


def test_vertices_lie_on_the_target_at_their_places(heads, found) -> None:
    template, target, true = heads
    scale = any_heads.HEAD_MM / np.ptp(true[:, 1])
    assert found.trusted.mean() > 0.98
    assert (found.distance[found.trusted] * scale).mean() < 0.1
    on = target.at(found.triangle, found.shares)
    assert np.linalg.norm(on - found.points, axis=1) == pytest.approx(found.distance, abs=1e-9)
    wrong = _mm(template, found.points, true)
    assert wrong.mean() < 1.5
    assert np.percentile(wrong, 95) < 4


def test_threads_turn_and_size_of_the_target_change_nothing(heads, found) -> None:
    template, target, true = heads
    turn = np.array([[0, 0, 1.0], [0, 1, 0], [-1, 0, 0]])
    far = np.array([100.0, -40, 7])
    pairs = any_heads.marked(template, true, noise=0.005)
    turned = register(
        template,
        Surface(target.points @ turn.T * 50 + far, target.triangles),
        [(v, turn @ point * 50 + far) for v, point in pairs],
        dataclasses.replace(OPTIONS, threads=1),
    )
    back = (turned.points - far) @ turn / 50
    away = np.linalg.norm(back - found.points, axis=1) * any_heads.HEAD_MM / np.ptp(true[:, 1])
    assert np.median(away) < 0.5


def test_what_is_missing_on_the_target_is_carried_along(heads) -> None:
    template, target, true = heads
    hole = target.points[target.triangles].mean(axis=1)
    open_ = np.linalg.norm(hole - true[any_heads.marked(template, true)[8][0]], axis=1) > 0.12
    holed = Surface(target.points, target.triangles[open_])
    laid = register(template, holed, any_heads.marked(template, true), OPTIONS)
    lost = np.linalg.norm(true - true[any_heads.marked(template, true)[8][0]], axis=1) < 0.08
    assert lost.sum() > 10
    assert not laid.trusted[lost].any()
    assert _mm(template, laid.points, true)[lost].mean() < 8
    mirrored = _other_sides(template)
    options = dataclasses.replace(OPTIONS, mirrored=mirrored, symmetry=0.5)
    alike = register(template, holed, any_heads.marked(template, true), options)
    assert np.isfinite(alike.points).all()


def _other_sides(template: Surface) -> np.ndarray:
    turned = template.points * [-1, 1, 1]
    away = ((turned[:, None] - template.points[None]) ** 2).sum(axis=2)
    return away.argmin(axis=1)


def test_a_start_needs_no_pairs(heads) -> None:
    template, target, true = heads
    start = true + 0.004 * np.sin(20 * true)
    laid = register(template, target, start=start, options=OPTIONS)
    assert _mm(template, laid.points, true).mean() < 3


def test_progress_goes_up_and_stops(heads) -> None:
    template, target, true = heads
    told: list[float] = []

    def progress(done: float) -> bool:
        told.append(done)
        return done < 0.2

    with pytest.raises(StoppedError):
        register(template, target, any_heads.marked(template, true), OPTIONS, progress=progress)
    assert told == sorted(told)
    assert told[0] == 0.0
    assert 0.2 <= told[-1] < 0.3

    def broken(done: float) -> bool:
        raise KeyError(done)

    with pytest.raises(KeyError):
        register(template, target, any_heads.marked(template, true), OPTIONS, progress=broken)


def _without(heads, **change):
    template, target, true = heads
    given = {"template": template, "target": target, "pairs": any_heads.marked(template, true)}
    return given | {"options": OPTIONS} | change


def _spoilt(surface: Surface, value: float) -> Surface:
    points = surface.points.copy()
    points[7, 1] = value
    return Surface(points, surface.triangles)


FEW = np.array([[0, 1, 2], [3, 4, 5]])


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda t, g: {"target": _spoilt(g, np.nan)}, r"target.points\[7\]"),
        (lambda t, g: {"template": _spoilt(t, np.inf)}, r"template.points\[7\]"),
        (lambda t, g: {"target": Surface(g.points[:12], FEW)}, "at least 100 triangles"),
        (lambda t, g: {"target": Surface(g.points, FEW[:0])}, "at least 100 triangles"),
        (lambda t, g: {"target": Surface(g.points, g.triangles + 9000)}, "a vertex below"),
        (lambda t, g: {"target": Surface(g.points * 0, g.triangles)}, "with an area"),
        (lambda t, g: {"target": Surface(g.points + 1e3, g.triangles)}, "near the start"),
        (lambda t, g: {"target": Surface(np.zeros((2_000_000, 3)), FEW)}, "at most 1500000"),
        (lambda t, g: {"pairs": []}, "at least 3 pairs"),
        (lambda t, g: {"pairs": [(10**6, [0, 0, 0])] * 3}, "a vertex below"),
        (lambda t, g: {"pairs": [(0, [0, 0, 0])] * 3}, "on one line"),
        (lambda t, g: {"pairs": [(0, [np.nan, 0, 0])] * 3}, r"pairs\[0\]"),
        (lambda t, g: {"start": t.points[:5]}, "start"),
        (lambda t, g: {"start": t.points * 0}, "more than one place"),
        (lambda t, g: {"options": RegisterOptions(mm=0.0)}, "mm"),
        (lambda t, g: {"options": RegisterOptions(mm=1e6)}, "10 mm to 100 m"),
        (lambda t, g: {"options": RegisterOptions(nodes=3)}, "nodes"),
        (lambda t, g: {"options": RegisterOptions(trusted=np.ones(4, bool))}, "trusted"),
        (lambda t, g: {"options": RegisterOptions(mirrored=np.zeros(4, int))}, "mirrored"),
    ],
)
def test_bad_input_is_one_sentence(heads, change, sentence) -> None:
    template, target, _ = heads
    with pytest.raises(RegistrationError, match=sentence):
        register(**_without(heads, **change(template, target)))


def test_triangles_without_an_area_and_seams_are_no_obstacle(heads, found) -> None:
    template, target, true = heads
    doubled = np.concatenate([target.points, target.points])  # duplicate vertices, as at a seam
    half = len(target.triangles) // 2
    corners = target.triangles.copy()
    corners[half:] += len(target.points)
    flat = np.repeat(corners[:50, :1], 3, axis=1)
    laid = register(
        template,
        Surface(doubled, np.concatenate([flat, corners])),
        any_heads.marked(template, true, noise=0.005),
        OPTIONS,
    )
    assert (laid.triangle >= 50).all()
    assert np.median(np.linalg.norm(laid.points - found.points, axis=1)) < 1e-3
