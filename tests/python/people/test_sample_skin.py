# SPDX-License-Identifier: MIT
"""Tests the skin texture of sample people: layout, rasters, patterns, colours of regions."""

import dataclasses

import numpy as np
import pytest
from risorius_people import people
from risorius_people.paint import form, layout, patterns, raster, regions, relief, skin
from risorius_people.part import Part
from risorius_people.polygons import Polygons

SIDE = 33


def grid(x, y, first=0):
    """Quads of a grid whose vertices are numbered row by row, beginning with `first`."""
    wide = len(x)
    return [
        [
            first + r * wide + c,
            first + r * wide + c + 1,
            first + (r + 1) * wide + c + 1,
            first + (r + 1) * wide + c,
        ]
        for r in range(len(y) - 1)
        for c in range(wide - 1)
    ]


@pytest.fixture(scope="module")
def islands():
    """A mesh with a large UV island and two small ones, placed like the base mesh's islands."""
    at = np.linspace(0, 1, 9)
    faces, places = [], []
    for number, (low, size) in enumerate(
        (((0.64, 0.14), (0.36, 0.70)), ((0.0, 0.5), (0.07, 0.1)), ((0.3, 0.9), (0.2, 0.1)))
    ):
        count = 9 if number == 0 else 4
        across, up = np.meshgrid(np.linspace(0, 1, count), np.linspace(0, 1, count))
        faces += grid(at[:count], at[:count], sum(len(p) for p in places))
        places.append(np.column_stack([across.ravel(), up.ravel()]) * size + low)
    uvs = np.concatenate(places)
    return Polygons(faces, faces, uvs, len(uvs))


def test_the_face_gets_the_texture_and_nothing_lies_on_another(islands):
    out = layout.packed(islands)
    assert out.min() > 0
    assert out.max() < 1
    label = layout.islands(islands)
    assert label.tolist() == [0] * 81 + [1] * 16 + [2] * 16
    face = out[label == 0]
    assert face[:, 1].min() > layout.STRIP
    assert np.ptp(face, axis=0) == pytest.approx([0.988, 0.768])
    count = np.zeros((256, 256), int)
    for number in range(3):
        own = [f for f in islands.faces if label[f[0]] == number]
        count += raster.Raster(Polygons(own, own, out, len(out)), out, 256).covered
    assert count.max() == 1
    # The face's UV island is rotated upright: the point with the largest u in the mesh is the
    # lowest point in the texture. The island's centre gets more texels than its rim.
    rows = face.reshape(9, 9, 2)
    assert (np.diff(rows[..., 1], axis=1) < 0).all()
    widths = np.diff(rows[:, 0, 0])
    assert widths[3:5].min() > 1.7 * widths[[0, -1]].max()


def test_values_between_corners_are_linear():
    faces = [[0, 1, 2, 3]]
    uvs = np.array([[0.25, 0.25], [0.75, 0.25], [0.75, 0.75], [0.25, 0.75]])
    found = raster.Raster(Polygons(faces, faces, uvs, 4), uvs, 64)
    image = found.image(uvs)
    rows, columns = np.nonzero(found.covered)
    assert (len(rows), rows.min(), rows.max()) == (32 * 32, 16, 47)
    want = (np.column_stack([columns, rows]) + 0.5) / 64
    np.testing.assert_allclose(image[rows, columns], want, atol=1e-6)
    assert not image[~found.covered].any()
    places = np.column_stack([3 * uvs[:, 0], 5 * uvs[:, 1], 0 * uvs[:, 0]])
    np.testing.assert_allclose(
        found.steps(places), np.tile([3 / 64, 5 / 64], (32 * 32, 1)), rtol=1e-5
    )


def test_bare_texels_take_the_colour_of_what_is_near():
    image = np.zeros((64, 64, 3))
    covered = np.zeros((64, 64), bool)
    for left, colour in ((4, (1, 0, 0)), (44, (0, 0, 1))):
        covered[8:56, left : left + 16] = True
        image[8:56, left : left + 16] = colour
    out = raster.filled(image, covered)
    np.testing.assert_array_equal(out[covered], image[covered])
    np.testing.assert_allclose(out[30, 21], (1, 0, 0), atol=1e-6)
    np.testing.assert_allclose(out[30, 42], (0, 0, 1), atol=1e-6)
    assert np.allclose(out.sum(axis=2), 1, atol=1e-5)  # never darker at a rim


def test_patterns_begin_again_without_a_seam():
    random = np.random.default_rng(1)
    tile = patterns.mottling(128, 6, random)
    assert abs(tile.mean()) < 1e-3
    assert tile.std() == pytest.approx(1, abs=1e-3)
    inner = np.abs(np.diff(tile, axis=1)).mean()
    assert np.abs(tile[:, 0] - tile[:, -1]).mean() < 1.3 * inner
    dots = patterns.dots(128, 8, random)
    assert np.abs(dots.near[:, 0] - dots.near[:, -1]).max() < 0.3
    at = patterns.laid(np.arange(256 * 256), 256, 128)
    half = dots.over(np.full(256 * 256, 0.5), at, 0.4)
    few = dots.over(np.full(256 * 256, 0.1), at, 0.4)
    assert 0.05 < half.mean() < 0.3
    assert few.mean() < 0.4 * half.mean()
    assert not dots.over(np.zeros(256 * 256), at, 0.4).any()


@pytest.fixture(scope="module")
def mask():
    """A flat face as large as the front of a head, which looks along z, and its texels."""
    x, y = np.meshgrid(np.linspace(-0.7, 0.7, SIDE), np.linspace(-1.3, 0.9, SIDE))
    places = np.column_stack([x.ravel(), y.ravel(), np.full(SIDE**2, 0.2)])
    faces = grid(np.zeros(SIDE), np.zeros(SIDE))
    uvs = np.column_stack([(x.ravel() + 0.7) / 1.4, (y.ravel() + 1.3) / 2.2])
    polygons = Polygons(faces, faces, uvs, SIDE**2)
    still = np.zeros(SIDE**2)
    ring = np.hypot(x.ravel() / 0.27, (y.ravel() + 0.72) / 0.1) * (regions.LIPS_RINGS + 4) - 4
    face = regions.Face(
        x=places[:, 0],
        y=places[:, 1],
        z=places[:, 2],
        lids=still,
        mouth=np.minimum(ring, regions.FAR_RINGS),
        eyes=still + regions.FAR_RINGS,
        uneven=np.zeros((SIDE**2, 3)),
    )
    return face, skin.Texels(raster.Raster(polygons, uvs, 256), places)


EYE = np.array([0.3, 0.0, 0.0])


def near(texels, x, y, reach=0.05):
    return np.hypot(texels.place[:, 0] - x, texels.place[:, 1] - y) < reach


@pytest.mark.parametrize("who", people.PEOPLE)
def test_blood_and_pigment_lie_where_faces_have_them(mask, who):
    face, texels = mask
    painted = skin.Skin(people.PEOPLE[who], face, texels, EYE)
    colour = skin.linear(painted.colour(np.zeros(len(texels.place), np.float32)))

    def mean(x, y):
        return colour[near(texels, x, y)].mean(axis=0)

    def red(place):
        return place[0] / place[1]

    cheek, forehead, nose, lips = mean(0.42, -0.36), mean(0.1, 0.45), mean(0, -0.4), mean(0, -0.66)
    assert red(cheek) > 1.03 * red(forehead)
    assert red(nose) > 1.03 * red(forehead)
    assert red(lips) > 1.05 * red(cheek)
    assert forehead[1] / forehead[2] > 1.02 * cheek[1] / cheek[2]  # more yellow
    under = mean(0.25, -0.21)
    assert under.sum() < 0.97 * mean(0.25, -0.06).sum()
    # The colour is not even: it varies within a centimetre.
    inside = colour[near(texels, 0.42, -0.36, 0.1)]
    assert (inside[:, 1].std() / inside[:, 1].mean()) > 0.012
    assert red(mean(0, -0.72)) > 1.25 * red(forehead)  # the inside of the mouth


def test_stubble_fades_out_and_freckles_are_asked_for(mask):
    face, texels = mask
    man = people.PEOPLE["man"]
    still = np.zeros(len(texels.place), np.float32)

    def painted(**changes):
        return skin.Skin(dataclasses.replace(man, **changes), face, texels, EYE).colour(still)

    change = np.abs(painted(beard=0.3) - painted(beard=0.0)).max(axis=1)
    rows = [change[near(texels, 0.35, y)].mean() for y in (-1.0, -0.8, -0.72, -0.64, -0.4)]
    assert rows == sorted(rows, reverse=True)
    assert rows[0] > 0.03
    assert rows[-1] == 0
    assert 0 < rows[3] < 0.7 * rows[0]
    spots = np.abs(painted(freckles=0.8) - painted()).max(axis=1)
    assert spots[near(texels, 0.3, -0.28)].mean() > 3 * spots[near(texels, 0.3, -1.1)].mean()
    np.testing.assert_array_equal(painted(freckles=0.0), painted())


def test_nose_and_lips_shine_and_pores_are_holes(mask):
    face, texels = mask
    still = np.zeros(len(texels.place), np.float32)
    painted = skin.Skin(people.PEOPLE["man"], face, texels, EYE)
    rough = relief.roughness(painted, still)

    def mean(values, x, y):
        return values[near(texels, x, y)].mean()

    assert mean(rough, 0, -0.35) < mean(rough, 0.5, -0.45) - 0.05
    assert rough[near(texels, 0, -0.72, 0.012)].mean() < 0.3
    flat = relief.normals(painted, 0 * still)
    np.testing.assert_allclose(flat, np.broadcast_to([0.5, 0.5, 1], flat.shape), atol=1e-6)
    height = relief.heights(painted, still)
    deep = relief.heights(painted, still + 1)
    assert (deep < height).all()
    rises = relief.normals(painted, 0.1 * texels.place[:, 1])
    np.testing.assert_allclose(
        rises[100, 100], 0.5 + 0.5 * np.array([0, -0.1, 1]) / np.hypot(1, 0.1), atol=0.005
    )


def test_the_relief_has_what_a_mesh_rounds_off(mask):
    face, texels = mask
    polygons = Polygons(grid(np.zeros(SIDE), np.zeros(SIDE)), [], np.empty((0, 2)), SIDE**2)
    flat = np.column_stack([face.x, face.y, face.z])
    np.testing.assert_allclose(form.form(polygons, flat, face, texels), 0, atol=1e-9)

    def groove(x, y):
        """Depth of a groove beside the nose, as a fraction of 3 mm."""
        return np.exp(-(((x - 0.3) / 0.06) ** 2)) * (np.abs(y + 0.3) < 0.35)

    dug = flat - 0.03 * groove(face.x, face.y)[:, None] * [0, 0, 1]
    found = form.form(polygons, dug, face, texels)
    inside, beside = found[near(texels, 0.3, -0.3)], found[near(texels, 0.42, -0.3)]
    assert inside.max() < -0.002
    assert beside.min() > 0.0002
    assert np.abs(found).max() <= 0.016
    assert np.abs(found[near(texels, -0.3, -0.3, 0.2)]).max() < 1e-4
    assert form.hollows(found)[near(texels, 0.3, -0.3)].min() > 0.3
    assert form.hollows(found)[near(texels, -0.3, -0.3)].max() < 1e-3
    # Where the lips meet, the relief is flat, even if a groove is there.
    dug = flat - 0.03 * groove(face.x + 0.3, face.y + 0.4)[:, None] * [0, 0, 1]
    meet = form.form(polygons, dug, face, texels)[near(texels, 0, -0.72, 0.02)]
    assert np.abs(meet).max() < 1e-5
    assert form.share_at(8) < 0.6 < form.share_at(30) == 1


def test_loops_are_counted_from_the_mouths_inside():
    """Loops of edges around the mouth are numbered from its inside.

    The mesh has two UV islands: a ring of skin around an opening, and the inside of the mouth.
    """
    turns = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    rings = np.concatenate(
        [
            np.column_stack([r * np.cos(turns), r * np.sin(turns) - 0.7, 0 * turns])
            for r in (0.05, 0.1, 0.2, 0.3)
        ]
    )

    def band(low):
        return [
            [12 * low + k, 12 * low + (k + 1) % 12, 12 * low + 12 + (k + 1) % 12, 12 * low + 12 + k]
            for k in range(12)
        ]

    faces = band(1) + band(2) + band(0)
    uv_faces = band(1) + band(2) + [[v + 48 for v in f] for f in band(0)]
    polygons = Polygons(faces, uv_faces, np.zeros((96, 2)), 48)
    mouth, eyes = regions.inner_rings(polygons, rings)
    assert [set(mouth[12 * k : 12 * k + 12]) for k in range(4)] == [{-1}, {0}, {1}, {2}]
    assert eyes.min() > regions.FAR_RINGS
    assert Part("head", polygons, []).carry(rings) is rings
