# SPDX-License-Identifier: MIT
"""Tests that a head's eyes, teeth, tongue and lashes are found, or taken from a template."""

import sys
from pathlib import Path

import numpy as np
import pytest
from risorius.anyhead.fittings import complete, head_parts, sort_parts
from risorius.anyhead.fittings.following import Followers
from risorius.anyhead.fittings.similarity import similarity
from risorius.anyhead.surface import Surface
from risorius.author.heads.joining import join
from risorius.author.heads.parts import Wishes
from risorius.author.input.shape_face import make_shape_face, shape_set
from risorius.base.errors import ArgumentError

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from support.plain_head import EYE, MOUTH, RADIUS, ball, eyes_and_teeth, mask, part


@pytest.fixture(scope="module")
def head():
    return mask()


def strip(side):
    """Points and quads of upper lashes: a narrow band in front of the upper lid's edge."""
    x = np.linspace(-0.8, 0.8, 12)
    y = 0.5 * np.sqrt(1 - (x / 1.05) ** 2)
    root = np.stack([x, y, np.sqrt(RADIUS**2 * 1.12 - x**2 - y**2)], axis=1) + EYE
    points = np.concatenate([root, root + np.array([0, 0.25, 0.5])]) * [side, 1, 1]
    return points, [[k, k + 1, k + 13, k + 12] for k in range(11)]


@pytest.fixture(scope="module")
def template(head):
    """The test head with eyes, teeth and the lashes of the left eye, as a Dna."""
    face = part("head", head.points, head.faces)
    face.shapes = dict(head.ways)
    lashes = part("eyelashes", *strip(1))
    wishes = Wishes("head", "", "+x", "+y", "+z", "cm", 1.0)
    names = {name: [name] for name in head.ways}
    joined = join("plain", [face, *eyes_and_teeth(), lashes], "cm", wishes, names)
    return make_shape_face(shape_set("plain", joined), names)


def kinds(found):
    return sorted((row.kind, row.side, row.hangs) for row in found.rows)


@pytest.mark.parametrize("named", [True, False])
def test_eyes_and_teeth_are_known_by_their_names_or_without(head, named):
    found = sort_parts([part("skin", head.points, head.faces), *eyes_and_teeth(named)])
    assert found.face.name == "skin"
    assert kinds(found) == [
        ("eye", "L", ""), ("eye", "R", ""), ("teeth", "", "head"), ("teeth", "", "jaw"),
    ]  # fmt: skip
    assert np.abs(found.eyes["L"].middle - EYE).max() < 1e-6
    assert found.eyes["R"].radius == pytest.approx(RADIUS)


def test_islands_of_one_mesh_are_taken_apart(head):
    points, faces = [head.points], list(head.faces)
    for other in eyes_and_teeth():
        start = sum(map(len, points))
        points.append(other.mesh.positions)
        faces += [[v + start for v in face] for face in other.mesh.faces]
    found = sort_parts([part("avatar", np.concatenate(points), faces)])
    assert len(found.face.mesh.positions) == len(np.unique(np.concatenate(head.faces)))
    assert [kind for kind, *_ in kinds(found)] == ["eye", "eye", "teeth", "teeth"]
    assert {row.hangs for row in found.of("teeth")} == {"head", "jaw"}


def test_crumbs_of_a_scan_stay_in_its_mesh(head):
    crumb = np.array([[0, 6, 9.5], [0.2, 6, 9.5], [0, 6.2, 9.5]])
    faces = [*head.faces, [len(head.points) + k for k in range(3)]]
    scan = part("scan", np.concatenate([head.points, crumb]), faces)
    found = sort_parts([scan])
    assert found.face is scan
    assert found.rows == []
    assert found.eyes == {}


def test_no_mesh_is_refused():
    with pytest.raises(ArgumentError, match="a mesh with polygons was expected"):
        sort_parts([part("empty", np.zeros((3, 3)), [])])


@pytest.fixture(scope="module")
def larger(head, template):
    """(parts of a head that is 1.5 times as large, function that maps points to this head).

    Only the skin is given; the other parts come from the template.
    """
    move = lambda points: 1.5 * np.asarray(points) + [0, 10, 3]  # noqa: E731
    found = sort_parts([part("skin", move(head.points), head.faces)])
    return complete(found, template, move(template.meshes[0].positions)), move


def test_what_lacks_is_fitted_in(larger):
    fitted, move = larger
    assert kinds(fitted) == [
        ("eye", "L", ""), ("eye", "R", ""), ("lashes", "", ""), ("teeth", "", "head"),
        ("teeth", "", "jaw"),
    ]  # fmt: skip
    for side, sign in (("L", 1), ("R", -1)):
        eye = fitted.eyes[side]
        assert np.abs(eye.middle - move(EYE * [sign, 1, 1])).max() < 0.05
        assert eye.radius == pytest.approx(1.5 * RADIUS, rel=0.02)
    lashes = fitted.of("lashes")[0].part.mesh.positions
    assert np.abs(lashes - move(strip(1)[0])).max() < 0.05
    upper = next(row for row in fitted.of("teeth") if row.hangs == "head")
    assert upper.part.mesh.positions[:, 1].min() == pytest.approx(move([0, MOUTH + 0.05, 0])[1],
                                                                 abs=0.1)  # fmt: skip
    assert fitted.notes == [
        "the left eyeball is the template's", "the right eyeball is the template's",
        "the lashes are the template's", "from the template: teeth",
    ]  # fmt: skip


def test_a_painted_eye_gets_no_eyeball(template):
    painted = mask(painted=True)
    found = sort_parts([part("skin", painted.points, painted.faces)])
    fitted = complete(found, template, template.meshes[0].positions)
    assert fitted.eyes == {}
    assert fitted.notes[0] == (
        "the left eye is painted on the skin, or closed: no eyeball is fitted in"
    )


def test_eyes_that_are_shut_get_no_eyeballs(head, template):
    """The neutral head has shut eyes, because the displacements of a blink are added to it."""
    shut = mask(short=0.0)
    points = shut.points + shut.ways["eyeBlinkL"] + shut.ways["eyeBlinkR"]
    fitted = complete(sort_parts([part("skin", points, shut.faces)]), template, points)
    assert fitted.eyes == {}


def test_another_skin_than_the_templates_is_refused(head, template):
    found = sort_parts([part("skin", head.points, head.faces)])
    with pytest.raises(ArgumentError, match=r"of the template's skin were expected, found 3"):
        complete(found, template, np.zeros((3, 3)))


def test_lashes_turn_with_the_lid_that_carries_them(head, template):
    found = sort_parts(
        [part("skin", head.points, head.faces), *eyes_and_teeth(), part("eyelashes", *strip(1))]
    )
    every = {each.name: each for each in head_parts(found, head.ways)}
    way = every["eyelashes"].shapes["eyeBlinkL"]
    assert "eyeBlinkR" not in every["eyelashes"].shapes
    root, tip = way[3:9].mean(axis=0), way[15:21].mean(axis=0)
    assert root[1] < -0.3
    assert tip[1] < root[1] - 0.1  # the lashes also rotate, so their tips go down more
    assert every["skin"].shapes.keys() == head.ways.keys()


def test_followers_keep_their_form_under_a_turn():
    points, faces = ball([0, 0, 0], 2.0)
    skin = Surface.of_polygons(points, faces)
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    hairs = np.array([[2.1, 0, 0], [2.6, 0.2, 0.1], [0, 2.3, 0]])
    follow = Followers(skin, hairs, None)
    assert np.abs(follow.carried(points @ turn.T - points) - hairs @ turn.T).max() < 1e-6
    larger = follow.carried(1.3 * points - points, sized=True)
    assert np.abs(larger - 1.3 * hairs).max() < 1e-6


def test_a_similarity_is_found_again():
    points = np.random.default_rng(5).normal(size=(20, 3))
    c, s = np.cos(0.4), np.sin(0.4)
    turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    found = similarity(points, 1.7 * points @ turn.T + [1, 2, 3])
    assert found.scale == pytest.approx(1.7)
    assert np.abs(found.turn - turn).max() < 1e-9
    assert np.abs(found.way(np.eye(3)) - 1.7 * turn.T).max() < 1e-9
