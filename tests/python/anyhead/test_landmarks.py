# SPDX-License-Identifier: MIT
"""Landmarks without clicks, on heads that the model of form makes: they need no data."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from risorius.anyhead.form.fitting import Pose, Target
from risorius.anyhead.form.heads import head_form
from risorius.anyhead.landmarks import checks
from risorius.anyhead.landmarks.find import Found, Hints, find_form
from risorius.anyhead.landmarks.marks import (
    FOUND,
    MOVED,
    LandmarkError,
    Landmarks,
    landmarks_path,
    landmarks_text,
    read_landmarks,
)
from risorius.anyhead.landmarks.names import landmark_words, needed_landmarks, other_side
from risorius.anyhead.landmarks.start import pairs_of, start_of
from risorius.anyhead.surface import Surface

Y, Z = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
STANDS = Hints("head.obj", up=Y, front=Z)  # a sixth of a second; from any direction three


@cache
def formed(seed: int) -> np.ndarray:
    form = head_form()
    parts = np.random.default_rng(seed).normal(size=len(form.parts)) * 0.7
    return form.shaped(parts, np.zeros(len(form.expressions)))


def head(seed: int) -> tuple[Surface, dict[str, np.ndarray]]:
    """A head of the model's form and its landmarks."""
    form, points = head_form(), formed(seed)
    places = {name: points[vertex] for name, vertex in form.places.items()}
    return Surface(points[: form.skin], form.triangles), places


def chin() -> np.ndarray:
    """A little before the chin of head 3."""
    return np.asarray(head(3)[1]["chin"] + np.array([0.0, 0.0, 0.1]))


@cache
def found(seed: int) -> Found:
    """Of the head 3 an eyeball and the chin are given."""
    given = Hints("head.obj", {"chin": chin()}, Y, Z, (formed(3)[head_form().skin],))
    return find_form(head(seed)[0], given if seed == 3 else STANDS)


def worst(have: dict[str, np.ndarray], wanted: dict[str, np.ndarray]) -> float:
    return max(float(np.linalg.norm(have[name] - wanted[name])) for name in wanted)


def closed(surface: Surface, around: np.ndarray) -> Surface:
    """A surface whose hole at a place is covered."""
    sides = surface.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    there = {(int(a), int(b)) for a, b in sides}
    open_ = np.array([(a, b) for a, b in there if (b, a) not in there])
    middles = surface.points[open_].mean(axis=1)
    near = open_[np.linalg.norm(middles - around, axis=1) < 3.2]
    middle = surface.points[np.unique(near)].mean(axis=0)
    fan = [(b, a, len(surface.points)) for a, b in near]
    return joined(surface, Surface(middle[None], np.array(fan) - len(surface.points)))


def joined(one: Surface, other: Surface) -> Surface:
    """Two surfaces as one; a vertex of the other counts from the end of the one."""
    return Surface(
        np.concatenate([one.points, other.points]),
        np.concatenate([one.triangles, other.triangles + len(one.points)]),
    )


def test_landmarks_of_a_head_that_stands() -> None:
    _, places = head(1)
    assert worst(found(1).landmarks.points, places) < 0.15
    assert found(1).landmarks.missing == []
    assert found(1).lips_apart


def test_a_head_in_metres_that_lies_on_its_back() -> None:
    surface, places = head(2)
    turn = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    lying = Surface((surface.points @ turn.T + [30, 5, 90]) * 0.01, surface.triangles)
    have = find_form(lying, Hints("head.obj"))
    goal = {name: (turn @ place + [30, 5, 90]) * 0.01 for name, place in places.items()}
    assert worst(have.landmarks.points, goal) < 0.0015
    assert have.pose.rotation == pytest.approx(turn, abs=0.1)
    assert have.pose.scale == pytest.approx(0.01, rel=0.05)


def test_a_head_starts_near_another() -> None:
    (template, _), (target, _) = head(1), head(3)
    start = start_of(template, target, found(1), found(3))
    away = np.linalg.norm(start - target.points, axis=1)
    face = head_form().weights[: head_form().skin] > 0.6
    assert away[face].mean() < 0.06
    pairs = dict(pairs_of(template, found(1), found(3)))
    assert max(np.linalg.norm(target.points[v] - p) for v, p in pairs.items()) < 0.2


def test_a_landmark_that_is_given_is_kept() -> None:
    points, how = dict(found(3).landmarks.points), dict(found(3).landmarks.how)
    places = head(3)[1]
    assert (points.pop("chin") == chin()).all()
    assert how.pop("chin") == MOVED
    assert set(how.values()) == {FOUND}
    places.pop("chin")
    assert worst(points, places) < 0.2


def ball() -> Surface:
    a, b = np.meshgrid(np.linspace(0.01, np.pi - 0.01, 30), np.linspace(0, 2 * np.pi, 41)[:-1])
    points = np.stack([np.sin(a) * np.cos(b), np.cos(a), np.sin(a) * np.sin(b)], axis=-1)
    at = np.arange(1200).reshape(40, 30)
    next_ = np.roll(at, -1, axis=0)
    corners = [at[:, :-1], next_[:, :-1], next_[:, 1:], at[:, 1:]]
    quads = np.stack(corners, axis=-1).reshape(-1, 4)
    return Surface.of_polygons(points.reshape(-1, 3), quads.tolist())


def beside() -> Surface:
    one = head(1)[0]
    return joined(one, Surface(one.points + np.array([40.0, 0, 0]), one.triangles))


def half() -> Surface:
    one = head(1)[0]
    points = one.points * [1.0, 1.0, 1.0]
    points[np.abs(points[:, 0]) < 0.25, 0] = 0.0
    kept = one.triangles[(points[one.triangles][:, :, 0] >= 0).all(axis=1)]
    own = np.unique(kept)
    return Surface(points[own], np.searchsorted(own, kept))


def no_number() -> Surface:
    one = head(1)[0]
    points = one.points.copy()
    points[7, 1] = np.nan
    return Surface(points, one.triangles)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (ball, "no face was found"),
        (beside, "one head was expected, found two"),
        (lambda: Surface(head(1)[0].points, head(1)[0].triangles[:, ::-1]), "is inside out"),
        (half, "half of the face is missing"),
        (no_number, "vertex 7: three finite numbers were expected, found"),
        (lambda: Surface(np.eye(12, 3), np.arange(12).reshape(4, 3)), "200 vertices or more"),
    ],
)
def test_what_is_no_head_is_refused_by_a_sentence(make, says: str) -> None:
    with pytest.raises(LandmarkError, match=says) as error:
        find_form(make(), STANDS)
    assert str(error.value).startswith("head.obj: ")


def test_too_many_vertices(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(checks, "MOST", 3000)
    with pytest.raises(LandmarkError, match=r"at most 3,000 vertices were expected, found 3,532"):
        find_form(head(1)[0], STANDS)


def test_welded_lips() -> None:
    one, places = head(1)
    lips = closed(one, (places["lip_upper_inner"] + places["lip_lower_inner"]) / 2)
    assert not checks.lips_apart(Target(lips), found(1).pose, places)
    with pytest.raises(LandmarkError, match="lips are welded"):
        replace(found(1), lips_apart=False).require_lips("head.obj")


def test_a_face_that_goes_through_itself() -> None:
    one = head(1)[0]
    checks.check_crossings("head.obj", Target(one), found(1).pose)
    shaken = one.points + np.random.default_rng(1).normal(size=one.points.shape) * 0.2
    with pytest.raises(LandmarkError, match=r"intersects itself at \d+ % of its edges"):
        checks.check_crossings("x", Target(Surface(shaken, one.triangles)), found(1).pose)


def test_eyes_that_are_painted_on() -> None:
    one, places = head(1)
    checks.check_eyes("head.obj", Target(one), found(1).pose, places)
    disc = np.array([[0.0, 0, 0], [2, 0, 0], [0, 2, 0], [-2, 0, 0], [0, -2, 0]])
    fan = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]])
    for side in "LR":
        one = joined(one, Surface(places[f"lid_upper_{side}"] + disc, fan))
    with pytest.raises(LandmarkError, match="no openings between the lids"):
        checks.check_eyes("head.obj", Target(one), found(1).pose, places)


def test_the_file_of_landmarks(tmp_path: Path) -> None:
    landmarks = Landmarks()
    landmarks.moved("nose_tip", np.array([0.0, 1.5, 2.0]))
    landmarks.points["chin"], landmarks.how["chin"] = np.array([0.0, -9.0, 2.0]), FOUND
    path = landmarks_path(tmp_path / "head.obj")
    assert path.name == "head.landmarks.json"
    path.write_text(landmarks_text(landmarks), encoding="utf-8")
    again = read_landmarks(path)
    assert again.how == {"nose_tip": MOVED, "chin": FOUND}
    assert again.points["nose_tip"] == pytest.approx([0.0, 1.5, 2.0])
    assert set(again.missing) == set(landmark_words()) - {"nose_tip", "chin"}
    for name in needed_landmarks() - {"eye_outer_L"}:
        again.moved(name, np.zeros(3))
    with pytest.raises(LandmarkError, match=r"outer corner of the left eye was not found: give it"):
        again.require("head.obj")


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"format": "other"}, "format"),
        ({"version": 7}, "version: 1 was expected, found 7"),
        ({"landmarks": []}, "a table was expected"),
        ({"landmarks": {"beak": {}}}, "no landmark of this name"),
        ({"landmarks": {"chin": {"how": "seen"}}}, "how"),
        ({"landmarks": {"chin": {"point": [1, 2]}}}, "three numbers were expected"),
        ({"landmarks": {"chin": {"point": [1, 2, "x"]}}}, "landmarks.chin: point: a number"),
    ],
)
def test_a_bad_file_of_landmarks(tmp_path: Path, change: dict[str, object], says: str) -> None:
    path = tmp_path / "x.json"
    path.write_text(json.dumps(json.loads(landmarks_text(Landmarks())) | change), encoding="utf-8")
    with pytest.raises(LandmarkError, match=says):
        read_landmarks(path)


def test_names_have_two_sides() -> None:
    words = landmark_words()
    assert words["eye_inner_R"] == "the inner corner of the right eye"
    assert all(other_side(name) in words for name in words)
    assert set(head_form().places) == set(words)


def test_a_pose_goes_there_and_back() -> None:
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    pose = Pose(turn, 2.0, np.array([1.0, 2, 3]))
    points = np.arange(12.0).reshape(4, 3)
    assert pose.back(pose.place(points)) == pytest.approx(points)
