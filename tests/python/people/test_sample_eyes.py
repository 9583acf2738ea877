# SPDX-License-Identifier: MIT
"""Tests the eyes of sample people: their form by formulas, and lids that touch the eyes."""

import numpy as np
import pytest
import sample_people
from risorius.author.geometry.polygon_mesh import vertex_normals
from risorius_people import people, polygons
from risorius_people.eyes import eye_parts, eyeball, lids, with_eyeballs
from risorius_people.eyes.rings import COLUMNS, LOWER, ROOT, TEMPLE, UPPER, smoothed
from risorius_people.paint import eyes as paint

MM = 0.01  # in the data's unit, decimetres
LIMBUS = 5.85  # mm from the axis of the gaze, where a cornea with a radius of 7.8 mm begins


def _height(points, middle, radius, gaze):
    """Heights of points above the eyeball and its cornea, in the points' unit; negative: inside."""
    scale = radius * eyeball.IRIS / LIMBUS
    ahead = np.sqrt(radius**2 - (LIMBUS * scale) ** 2) - np.sqrt(7.8**2 - LIMBUS**2) * scale
    arm = points - middle
    ball = np.linalg.norm(arm, axis=-1) - radius
    cornea = np.linalg.norm(arm - ahead * gaze, axis=-1) - 7.8 * scale
    return np.where(arm @ gaze > 0, np.minimum(ball, cornea), ball)


def test_the_eye_has_the_measures_of_real_ones():
    """Cornea, iris and pupil have human sizes in mm if the iris is scaled to a human iris."""
    size = LIMBUS / eyeball.IRIS
    assert 12 <= size <= 15.5  # people's eyeballs have a radius of 12 mm, the data's up to 16
    top = size * float(eyeball.surface(np.zeros(1))[0])
    assert 1.0 < top - size < 2.0  # height of the cornea above the ball
    ball = size * eyeball.BALL.points()
    iris = ball[2 * eyeball.SEGMENTS : 12 * eyeball.SEGMENTS]
    depth = top - iris[:, 2]
    assert 2.5 < depth.min() < depth.max() < 3.6
    assert ball[:, 2][: eyeball.SEGMENTS].max() < iris[:, 2].min() - 1  # the pupil is a hole
    angle = np.linspace(0, np.pi, 400)
    ray = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1)
    points = size * eyeball.surface(angle)[:, None] * ray
    above = _height(points, np.zeros(3), size, np.array([0, 0, 1.0]))
    assert np.abs(above).max() < 0.1  # except at their blend the surfaces are spheres


def test_ball_and_cornea_are_seen_from_outside_and_do_not_cut_each_other():
    for shape in (eyeball.BALL, eyeball.SHELL):
        points = shape.points()
        faces = shape.faces(0, list(range(len(shape.away))), 1)
        normals = vertex_normals(points, faces)
        outer = np.linalg.norm(points, axis=1) > 0.99
        assert (np.einsum("ij,ij->i", normals, points)[outer] > 0.5).all()
        assert sorted({v for face in faces for v in face}) == list(range(len(points)))
    edges = polygons.edges_of(eyeball.BALL.faces(0, list(range(len(eyeball.BALL.away))), 1))
    assert {len(owners) for owners in edges.values()} == {2}  # closed surface
    shell = eyeball.SHELL.points()
    inner = shell[: -eyeball.SEGMENTS - 1]  # without the last ring, which is inside the ball
    assert np.linalg.norm(inner, axis=1).min() > 1.001
    assert np.linalg.norm(shell[-eyeball.SEGMENTS - 1 : -1], axis=1).max() < 0.999


def test_the_picture_of_an_eye_gives_most_of_itself_to_the_iris():
    angle = np.linspace(eyeball.side_angle(np.array([eyeball.IRIS_AT]))[0], np.pi, 50)
    np.testing.assert_allclose(eyeball.side_angle(eyeball.side_map(angle)), angle)
    image = paint.paint_eye(people.PEOPLE["woman"])
    half, reach = len(image) // 2, int(len(image) * eyeball.IRIS_AT)
    assert image[half - 10 : half + 10, half - 10 : half + 10].max() < 0.02
    ring = image[half, half + int(0.6 * reach)]
    assert ring[0] > ring[2]  # brown
    at = np.arange(len(image)) + 0.5 - half
    away = np.hypot(*np.meshgrid(at, at)) / reach
    light = image.mean(axis=2)
    rim, white = (light[np.abs(away - x) < 0.03].mean() for x in (1.0, 1.35))
    assert rim < 0.3 * white
    assert 0.55 < white < 0.85  # grey rather than white
    # The brightness has no step between the iris, with radius 1, and the white of the eye.
    profile = [light[np.abs(away - x) < 0.01].mean() for x in np.arange(0.95, 1.25, 0.02)]
    assert np.abs(np.diff(profile)).max() < 0.25 * white
    # The iris has fibres: brightness varies around the pupil, and no single frequency dominates.
    around = np.linspace(0, 2 * np.pi, 2048, endpoint=False)
    x, y = (half + 0.72 * reach * f(around) for f in (np.cos, np.sin))
    power = np.abs(np.fft.rfft(light[y.astype(int), x.astype(int)]))[8:400] ** 2
    assert power.max() < 0.15 * power.sum()


@pytest.fixture(scope="module")
def faces():
    """Two results: the bodies by name, and the base mesh with eyeballs.

    The bodies are "girl" and "model". The model is the man from whom all people are made.
    """
    girl = sample_people.body("girl")
    return {"girl": girl, "model": girl.man}, with_eyeballs(sample_people.data().base_mesh())


@pytest.fixture(scope="module", params=["model", "girl"])
def face(request, faces):
    return faces[0][request.param]


def _posed(face, side, **values):
    """The lids' vertices at LOD 0 and the eye's rotation matrix, for some control values."""
    eye, letter = face.eyes.lids[side], side.upper()
    controls = {f"{name}{letter}": value for name, value in values.items()}
    grid = eye.grid(face.positions).copy()
    for name, value in controls.items():
        grid += value * eye.grid(face.units[name].displacement)
    for (a, b), shape in face.eye_correctives.items():
        share = controls.get(a, 0) * controls.get(b, 0)
        grid += (share - controls.get(a, 0) * (a == b)) * eye.grid(shape)
    turn = np.eye(3)
    for name, value in controls.items():
        if name.startswith("eyeLook"):
            vector = value * lids.LOOKS[name[7:-1]][0]
            axis = 0 if name[7:-1] in ("Up", "Down") else 1
            turn = turn @ lids.rotation(vector if name[7:-1] in ("Down", "Left") else -vector, axis)
    return smoothed(grid), turn


LOOKS = [{}, *({f"eyeLook{way}": 1.0} for way in lids.LOOKS)]
LOOKS += [{"eyeLookLeft": 0.5, "eyeLookDown": 0.5}, {"eyeLookRight": 0.5, "eyeLookUp": 0.5}]


def test_extra_a_cheek_that_is_pushed_up_lies_over_the_eye(face):
    """Skin around the lids stays 0.4 mm outside the eye if several controls raise it together."""
    for side, eye in face.eyes.lids.items():
        for pose in (
            {"eyeCheekRaise": 1.0, "eyeSquintInner": 1.0},
            {"eyeCheekRaise": 0.6, "eyeSquintInner": 0.85, "eyeBlink": 0.3, "eyeLookDown": 0.5},
            {"eyeUpperLidUp": 0.7, "eyeBlink": 0.95, "eyeLookDown": 0.4},
        ):
            grid, turn = _posed(face, side, **pose)
            gaze = turn @ eyeball.gaze(side)[:, 2]
            above = _height(grid[: ROOT + 1], eye.middle, eye.radius, gaze) / MM
            assert above.min() > 0.4, (side, pose)


def test_extra_no_eye_goes_through_its_lids(face):
    """For each gaze and each closure of the lids, an eye penetrates the lids by at most 0.5 mm."""
    for side, eye in face.eyes.lids.items():
        gaze = eyeball.gaze(side)[:, 2]
        for look in LOOKS:
            for blink in (0.0, 0.25, 0.5, 0.75, 1.0):
                grid, turn = _posed(face, side, eyeBlink=blink, **look)
                above = _height(grid[ROOT : ROOT + 3], eye.middle, eye.radius, turn @ gaze) / MM
                where = (side, look, blink)
                assert above[0].min() > 0.4, where  # the skin's edge stays a rim's width away
                assert above[2].min() > -0.5, where


def test_extra_lids_touch_their_eyes(face):
    """Lids leave no gap, because their rims bend inwards and end inside the eyeball."""
    for side, eye in face.eyes.lids.items():
        gaze = eyeball.gaze(side)[:, 2]
        for look in LOOKS[:5]:
            for blink in (0.0, 1.0) if look else (0.0, 0.25, 0.5, 0.75, 1.0):
                grid, turn = _posed(face, side, eyeBlink=blink, **look)
                above = _height(grid[ROOT + 3], eye.middle, eye.radius, turn @ gaze) / MM
                assert above.max() < 0.1, (side, look, blink)


@pytest.mark.parametrize("look", LOOKS[:5])
def test_extra_closed_lids_meet_in_one_line(face, look):
    for side in "lr":
        grid, _ = _posed(face, side, eyeBlink=1.0, **look)
        lower = np.append(np.arange(LOWER.start, LOWER.stop), [0, TEMPLE])
        for row in (ROOT, ROOT + 1, ROOT + 2):
            line = grid[row, lower]
            line = line[line[:, 0].argsort()]
            upper = grid[row, UPPER][2:-1]  # at the corner of the eye there is no gap to close
            gap = upper[:, 1] - np.interp(upper[:, 0], line[:, 0], line[:, 1])
            assert np.abs(gap).max() < 0.35 * MM


def test_extra_resting_eyes_are_open_and_meet_far_ahead(face):
    for side, eye in face.eyes.lids.items():
        grid, _ = _posed(face, side)
        iris = eyeball.IRIS * eye.radius
        edge = (grid[ROOT + 2] - eye.middle)[:, 1]
        assert 0.6 * MM < iris - edge[UPPER].max() < 2.6 * MM
        assert abs(iris + edge[LOWER].min()) < 0.8 * MM
        inwards = eyeball.gaze(side)[0, 2] * -np.sign(eye.middle[0])
        assert 0.3 < abs(eye.middle[0]) / np.tan(np.arcsin(inwards)) / 10 < 2.5  # metres


def test_extra_a_look_turns_the_eye_and_takes_the_lids_along(face):
    for side, eye in face.eyes.lids.items():
        own = face.groups[f"eyeball-{side}"]
        rest, _ = _posed(face, side)
        for way, (degrees, _) in lids.LOOKS.items():
            unit = face.units[f"eyeLook{way}{side.upper()}"]
            arm = face.positions[own] - eye.middle
            turned = arm + unit.displacement[own]
            np.testing.assert_allclose(np.linalg.norm(turned, axis=1), np.linalg.norm(arm, axis=1))
            cosine = eyeball.gaze(side)[:, 2] @ lids.look_rotation(way) @ eyeball.gaze(side)[:, 2]
            assert np.degrees(np.arccos(cosine)) == pytest.approx(degrees, abs=0.5)
            moved = (_posed(face, side, **{f"eyeLook{way}": 1.0})[0] - rest)[ROOT, UPPER, 1]
            if way == "Down":
                assert moved.min() < -3 * MM
            if way == "Up":
                assert moved.max() > 1.5 * MM


def test_extra_pupils_are_holes_that_grow_and_shrink(face):
    for side, eye in face.eyes.lids.items():
        own = face.groups[f"eyeball-{side}"][2 * eyeball.SEGMENTS : 3 * eyeball.SEGMENTS]

        def width(face=face, own=own, **values):
            points = face.positions[own].copy()
            for name, value in values.items():
                points += value * face.units[name].displacement[own]
            return float(np.linalg.norm(points - points.mean(axis=0), axis=1).mean()) / MM

        scale = eyeball.IRIS * eye.radius / (LIMBUS * MM)
        letter = side.upper()
        assert width() == pytest.approx(1.93 * scale, rel=0.02)
        assert 2.9 < width(**{f"eyePupilWide{letter}": 1}) / scale < 3.5
        assert 0.8 < width(**{f"eyePupilNarrow{letter}": 1}) / scale < 1.3


def test_extra_tears_and_caruncles_go_with_the_lids(faces):
    people_, base = faces
    face = people_["girl"]
    parts = {part.name: part for part in eye_parts(base, face.groups, 0)}
    for name in ("eyeEdge_lod0_mesh", "cartilage_lod0_mesh"):
        part = parts[name]
        np.testing.assert_allclose(part.carry(np.ones((len(face.positions), 1))), 1)
        rest = part.carry(face.positions)
        closed = face.units["eyeBlinkL"].displacement
        for way in (0 * closed, closed, face.units["eyeLowerLidUpL"].displacement):
            points = rest + part.carry(way)
            points = points[points[:, 0] > 0]
            eye = face.eyes.lids["l"]
            above = _height(points, eye.middle, eye.radius, eyeball.gaze("l")[:, 2]) / MM
            assert -1.2 < above.min() < above.max() < 1.8
            grid = smoothed(eye.grid(face.positions + way))[ROOT : ROOT + 4].reshape(-1, 3)
            gaps = np.linalg.norm(points[:, None] - grid[None], axis=2).min(axis=1) / MM
            assert gaps.max() < 2.5
        assert {len(face_) for face_ in part.polygons.faces} == {4}


def test_extra_rings_are_where_one_subdivision_brings_them(faces):
    people_, base = faces
    face = people_["model"]
    eye = face.eyes.lids["l"]
    assert eye.rings.shape == (13, COLUMNS)
    near = set(eye.rings.ravel().tolist())
    quads = [[c[0] for c in f] for f in base.faces["body"] if near & {c[0] for c in f}]
    mesh = polygons.Polygons(quads, quads, np.zeros((len(base.positions), 2)), len(base.positions))
    _, operator = polygons.subdivide(mesh)
    finer = operator.apply(face.positions)
    inner = eye.rings[1:-1]
    np.testing.assert_allclose(finer[inner], smoothed(eye.grid(face.positions))[1:-1], atol=1e-9)
