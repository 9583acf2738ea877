# SPDX-License-Identifier: MIT
"""Makes pairs of heads with different vertices and known correspondences.

A head by formula is a function from directions to points: points in the same direction correspond,
whatever the vertices of the two meshes. All people of the generator have corresponding vertices;
`remeshed` replaces the vertices of one of them.
"""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
from risorius import _native
from risorius.anyhead.surface import Surface

HEAD_MM = 240.0
# Landmarks of a head by formula: angles to the left and up from the front, in degrees.
MARKS = (
    *((-24, 12), (24, 12), (-9, 12), (9, 12), (0, -8), (-14, -26), (14, -26), (0, -52)),
    *((90, 0), (-90, 0), (0, 89)),
)
# Bumps of a head: angles to the left and up, and width, in degrees; height as a fraction of the
# head's radius.
_BUMPS = (
    (0, -8, 9, 0.22),  # nose
    (-17, 12, 9, -0.10),  # eyes
    (17, 12, 9, -0.10),
    (0, 28, 22, 0.05),  # brow
    (0, -27, 12, 0.05),  # mouth
    (0, -50, 15, 0.10),  # chin
    (-90, 0, 12, 0.12),  # ears
    (90, 0, 12, 0.12),
)


def direction(left: float, up: float) -> np.ndarray:
    """Unit vector float64[3] for angles to the left and up in degrees; (0, 0) is the front."""
    a, b = np.radians([left, up])
    return np.array([np.sin(a) * np.cos(b), np.sin(b), np.cos(a) * np.cos(b)])


def form(directions: np.ndarray, seed: int = 0, size: float = 12.0) -> np.ndarray:
    """Points of a head by formula in the given directions, float64[n, 3].

    Args:
        directions: float64[n, 3] unit vectors.
        seed: 0: the template; other seeds change proportions and the places, widths and heights of
            bumps.
        size: half the height of the head, in any unit.
    """
    random = np.random.default_rng(seed)
    much = 1.0 if seed else 0.0
    points = np.ones(len(directions))
    for left, up, width, height in _BUMPS:
        aside, above, wider, higher = much * random.normal(0, (1.5, 1.5, 0.08, 0.15))
        middle = direction(left + np.sign(left) * aside, up + above)
        away = np.degrees(np.arccos(np.clip(directions @ middle, -1, 1))) / (width * (1 + wider))
        points += height * (1 + higher) * np.exp(-0.5 * away**2)
    scales = np.array([0.72, 1.0, 0.85]) * (1 + much * random.normal(0, 0.05, 3))
    return directions * points[:, None] * scales * size


def sphere(rows: int, columns: int, turn: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Directions float64[V, 3] and triangles int64[T, 3] of a closed sphere.

    Args:
        rows: number of rows of vertices between the poles.
        columns: number of vertices of a row.
        turn: angle in radians between the line of the poles and the vertical.
    """
    up = (np.arange(rows) + 1) / (rows + 1) * np.pi - np.pi / 2
    around = np.arange(columns) / columns * 2 * np.pi
    ring = np.stack([np.sin(around), np.zeros(columns), np.cos(around)], 1)
    grid = np.cos(up)[:, None, None] * ring + np.sin(up)[:, None, None] * np.array([0, 1, 0])
    points = np.concatenate([grid.reshape(-1, 3), [[0, -1, 0], [0, 1, 0]]])
    bottom, top = rows * columns, rows * columns + 1
    triangles = []
    for c in range(columns):
        d = (c + 1) % columns
        triangles += [(bottom, d, c), (top, (rows - 1) * columns + c, (rows - 1) * columns + d)]
        for r in range(rows - 1):
            a, b = r * columns + c, r * columns + d
            triangles += [(a, b, b + columns), (a, b + columns, a + columns)]
    s, c = np.sin(turn), np.cos(turn)
    return points @ np.array([[1, 0, 0], [0, c, s], [0, -s, c]]), np.array(triangles)


def formula_heads(seed: int, size: float = 12.0) -> tuple[Surface, Surface, np.ndarray]:
    """Template, target, and the template's vertices at their true places on the target, [V, 3].

    Args:
        seed: seed of the target's proportions and bumps; 0: the same form as the template.
        size: half the height of the target; half the height of the template is always 12.
    """
    directions, triangles = sphere(30, 44)
    others, corners = sphere(47, 61, turn=0.9)
    template = Surface(form(directions), triangles)
    return template, Surface(form(others, seed, size), corners), form(directions, seed, size)


def marked(template: Surface, true: np.ndarray, noise: float = 0.0, seed: int = 0) -> list:
    """(template vertex at the landmark, its position in `true` plus an error) for each of MARKS.

    Args:
        template: head by formula.
        true: float64[V, 3], positions of the template's vertices on another head.
        noise: standard deviation of the normal error that is added to each coordinate, in the unit
            of `true`.
        seed: seed of the error.
    """
    random = np.random.default_rng(seed)
    looks = template.points / np.linalg.norm(template.points, axis=1, keepdims=True)
    vertices = [int(np.argmax(looks @ direction(*mark))) for mark in MARKS]
    return [(v, true[v] + random.normal(0, noise, 3)) for v in vertices]


def errors(template: Surface, found: np.ndarray, true: np.ndarray) -> np.ndarray:
    """float64[V]: for each vertex, the length of the part of `found - true` along the surface.

    Args:
        template: head with the triangles of both arrays.
        found: float64[V, 3], positions to judge.
        true: float64[V, 3], correct positions; their surface gives the tangent planes.
    """
    normals = Surface(true, template.triangles).normals()
    away = found - true
    return np.linalg.norm(away - (away * normals).sum(1, keepdims=True) * normals, axis=1)


@functools.cache
def generator():
    """The data of the generator's people; without this data, the test is skipped."""
    import sample_people

    return sample_people.data()


def random_person(seed: int, source):
    """A person with random gender, age, build, origin and facial features.

    Args:
        seed: the same seed gives the same person.
        source: a risorius_people Source, whose target files are the possible features.
    """
    from risorius_people.people import MAN
    from risorius_people.source import TARGETS

    random = np.random.default_rng(seed)
    folders = ("chin", "cheek", "mouth", "nose", "forehead", "head", "eyes", "ears", "neck")
    names = {
        name.removeprefix(TARGETS).removesuffix(".target.gz")
        for name in source._names
        if name.startswith(TARGETS)
    }
    pool = sorted(
        {
            n.split("/")[0] + "/" + n.split("/")[-1].removeprefix("l-")
            for n in names
            if n.split("/")[0] in folders and not n.split("/")[-1].startswith("r-")
        }
    )
    features: dict[str, float] = {}
    for name in random.choice(pool, 14, replace=False):
        swaps = (("incr", "decr"), ("decr", "incr"))
        if not any(name.replace(a, b) in features for a, b in swaps if a in name):
            features[str(name)] = float(random.uniform(0.1, 0.6))
    shares = random.dirichlet([1, 1, 1]).tolist()
    return dataclasses.replace(
        MAN,
        name=f"Drawn{seed}",
        gender=str(random.choice(["male", "female"])),
        age=int(random.integers(14, 75)),
        muscle=float(random.uniform(0.2, 0.8)),
        weight=float(random.uniform(0.2, 0.8)),
        features=features,
        origin=dict(zip(("caucasian", "african", "asian"), shares, strict=True)),
        asymmetry={},
    )


def skin_of(person, source) -> Surface:
    """A person's skin at LOD 0 in centimetres; vertices of all people correspond."""
    from risorius_people import blend_shape_face

    _, parts, body = blend_shape_face.assemble(source, lambda _: None, person)
    part = next(p for p in parts if p.name == "head_lod0_mesh")
    points = part.carry(body.positions) * blend_shape_face.CM
    return Surface.of_polygons(points, part.polygons.faces)


def remeshed(skin: Surface, share: float = 0.5, seed: int = 0) -> Surface:
    """The same surface, subdivided at random places of its edges and then simplified.

    Args:
        skin: the surface.
        share: number of triangles of the result, relative to the skin's.
        seed: seed of the random places.
    """
    random = np.random.default_rng(seed)
    edges = skin.edges()
    number = {(int(a), int(b)): i for i, (a, b) in enumerate(edges)}
    at = random.uniform(0.3, 0.7, (len(edges), 1))
    cuts = (1 - at) * skin.points[edges[:, 0]] + at * skin.points[edges[:, 1]]
    first = len(skin.points)
    triangles = []
    for a, b, c in skin.triangles.tolist():
        x, y, z = (first + number[min(p, q), max(p, q)] for p, q in ((a, b), (b, c), (c, a)))
        triangles += [(a, x, z), (x, b, y), (z, y, c), (x, y, z)]
    points = np.concatenate([skin.points, cuts])
    count = int(share * len(skin.triangles))
    kept, _ = _native.simplify(
        points.astype(np.float32), np.zeros((len(points), 0), np.float32),
        np.array(triangles, np.uint32), count,
    )  # fmt: skip
    used, corners = np.unique(kept, return_inverse=True)
    return Surface(points[used], corners.reshape(-1, 3))
