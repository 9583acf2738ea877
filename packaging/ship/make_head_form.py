# SPDX-License-Identifier: MIT
"""Makes heads.npz, the statistical shape model with which the package finds the parts of a face.

    python packaging/ship/make_head_form.py

Run it again if landmarks/names.toml or this file changes, and build the wheel after it. It takes
about a minute and needs the venv of packaging/setup.sh.

The model is a principal component analysis of random heads from the CC0 data of the sample people.
Age, gender, origin, build and about three hundred features vary. A quarter of the heads has
features stronger than those of real people, like stylised drawings.
"""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from risorius.base import toml
from risorius.files import fileio
from risorius_people.body import group_indices
from risorius_people.people import ORIGINS, Person
from risorius_people.proportions import affine_form
from risorius_people.source import FACE_UNITS, TARGETS, BaseMesh, Source, fetch

Doubles = NDArray[np.float64]
Ints = NDArray[np.int64]

HEADS, COMPONENTS, SEED = 1600, 120, 56
STYLISED = 0.25  # fraction of heads with features stronger than those of people
# Limits in decimetres on the base mesh: triangles below y = CUT or beyond |x| = WIDE are left out.
CUT, WIDE = 5.75, 0.95
FEATURES = (
    "eyes", "asym", "ears", "mouth", "nose", "head", "neck", "cheek", "chin", "forehead",
    "eyebrows",
)  # fmt: skip
ENDS = (
    ("decr", "incr"), ("down", "up"), ("in", "out"), ("backward", "forward"),
    ("concave", "convex"), ("compress", "uncompress"),
)  # fmt: skip
TEETH = "helper-lower-teeth"
EXPRESSIONS = {
    "jaw_open": ("jawOpen",),
    "blink": ("eyeBlinkLeft", "eyeBlinkRight"),
    "smile": ("mouthSmileLeft", "mouthSmileRight"),
    "pucker": ("mouthPucker",),
    "wide": ("eyeWideLeft", "eyeWideRight"),
}
TEETH_SEEN, TEETH_STEP = 0.5, 3  # least weight of the vertices of the regression; every third one
TEETH_NOISE = 1.0  # cm^2, sum over all heads of the squared error of registration at a vertex
DIRECTIONS = 40  # number of directions from which visible triangles are found
PIXELS = 220  # pixels per decimetre of the pictures that find visible triangles
PACKAGE = Path(__file__).parents[2] / "native" / "python" / "risorius" / "anyhead"


def quads_of(base: BaseMesh, *groups: str) -> Ints:
    return np.array([[c[0] for c in face] for group in groups for face in base.faces[group]])


def triangles_of(quads: Ints) -> Ints:
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def seen(points: Doubles, triangles: Ints) -> NDArray[np.bool_]:
    """bool[T]: whether a triangle is visible from at least one of DIRECTIONS around the head."""
    out = np.zeros(len(triangles), bool)
    k = np.arange(DIRECTIONS) + 0.5
    height, turn = 1 - 2 * k / DIRECTIONS, np.pi * (1 + 5**0.5) * k
    for y, angle in zip(height, turn, strict=True):
        front = np.array(
            [np.cos(angle) * (1 - y * y) ** 0.5, y, np.sin(angle) * (1 - y * y) ** 0.5]
        )
        side = np.cross([0.0, 1.0, 0.0], front)
        side /= np.linalg.norm(side)
        turned = points @ np.stack([side, np.cross(front, side), front]).T
        out[np.unique(nearest_triangles(turned, triangles))] = True
    return out


def nearest_triangles(points: Doubles, triangles: Ints) -> Ints:
    """Indices of the triangles that a view along -z shows.

    A triangle whose back is seen hides others, but is not in the result.
    """
    corners = points[triangles]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2]
    low = corners[:, :, :2].reshape(-1, 2).min(axis=0)
    grid = (corners[:, :, :2] - low) * PIXELS
    size = np.ceil(grid.reshape(-1, 2).max(axis=0)).astype(int) + 2
    depth, shown = np.full(size, -np.inf), np.full(size, -1)
    for t in np.flatnonzero(np.abs(across) > 1e-12):
        a, b, c = grid[t]
        first = np.floor(grid[t].min(axis=0)).astype(int)
        last = np.ceil(grid[t].max(axis=0)).astype(int) + 1
        x, y = np.mgrid[first[0] : last[0], first[1] : last[1]]
        whole = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        u = ((x - a[0]) * (c[1] - a[1]) - (y - a[1]) * (c[0] - a[0])) / whole
        v = ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / whole
        z = corners[t, 0, 2] * (1 - u - v) + corners[t, 1, 2] * u + corners[t, 2, 2] * v
        window = (slice(first[0], last[0]), slice(first[1], last[1]))
        nearer = (u >= 0) & (v >= 0) & (u + v <= 1) & (z > depth[window])
        depth[window][nearer] = z[nearer]
        shown[window][nearer] = t if across[t] > 0 else -1
    return np.asarray(shown[shown >= 0])


class Heads:
    """Draws random heads from the data of the sample people."""

    def __init__(self) -> None:
        self.source = Source(fetch(offline=False))
        self.base = self.source.base_mesh()
        self.count = len(self.base.positions)
        self.groups = group_indices(self.base)
        self.kept = np.arange(self.count)
        self._read: dict[str, Doubles] = {}
        self.axes = self._axes()

    def shape(self, name: str) -> Doubles:
        """float32[n, 3]: the displacements of a shape at the n vertices self.kept, dm. Cached."""
        if name not in self._read:
            self._read[name] = self.source.target(name, self.count)[self.kept].astype(np.float32)
        return self._read[name]

    def _axes(self) -> list[tuple[tuple[str, ...], tuple[str, ...]]]:
        """(shapes of the low end, shapes of the high end) of each feature of the data.

        An end has two shapes, left and right, if the feature has a shape for each side. The low
        end is empty if the feature has only one direction.
        """
        names = {
            n.removeprefix(TARGETS).removesuffix(".target.gz")
            for n in self.source._names
            if n.startswith(TARGETS) and n.endswith(".target.gz")
        }
        chosen = {n for n in names if n.split("/")[0] in FEATURES and "asymm-" not in n}
        axes: list[tuple[tuple[str, ...], tuple[str, ...]]] = []
        for name in sorted(chosen):
            last = name.rpartition("/")[2]
            if last.startswith("r-"):
                continue
            for low, high in ENDS:
                if last.endswith(f"-{high}") and name.removesuffix(high) + low in chosen:
                    axes.append((self._sided(name.removesuffix(high) + low), self._sided(name)))
                    break
            else:
                if not any(
                    last.endswith(f"-{low}") and name.removesuffix(low) + high in chosen
                    for low, high in ENDS
                ):
                    axes.append(((), self._sided(name)))
        return axes

    @staticmethod
    def _sided(name: str) -> tuple[str, ...]:
        folder, _, last = name.partition("/")
        return (name, f"{folder}/r-{last[2:]}") if last.startswith("l-") else (name,)

    def draw(self, dice: np.random.Generator) -> Doubles:
        """float64[n, 3]: positions of the n vertices self.kept of a random head, decimetres."""
        out = self.base.positions[self.kept].copy()
        shares = dice.dirichlet(np.full(len(ORIGINS), 0.6))
        person = Person(
            name="", gender=str(dice.choice(["female", "male"])), age=int(dice.integers(2, 91)),
            origin=dict(zip(ORIGINS, shares, strict=True)), skin=(0, 0, 0), flush=(0, 0, 0),
            lids=(0, 0, 0), lips=(0, 0, 0), hair=(0, 0, 0), brows=(0, 0, 0), beard=0,
            iris=((0, 0, 0), (0, 0, 0)), muscle=dice.uniform(), weight=dice.uniform(),
        )  # fmt: skip
        for name, weight in person.shape().items():
            out += weight * self.shape(f"{TARGETS}{name}.target.gz")
        strength = dice.uniform(1.0, 2.0) if dice.uniform() < STYLISED else 0.6
        for low, high in self.axes:
            value = dice.normal() * strength * (0.5 if dice.uniform() < 0.5 else 0.1)
            own = dice.normal() * 0.08
            names = high if value > 0 or not low else low
            for k, name in enumerate(names):
                weight = abs(value) + (own if k else -own)
                out += weight * self.shape(f"{TARGETS}{name}.target.gz")
        return out

    def expression(self, names: tuple[str, ...]) -> Doubles:
        """float64[n, 3]: sum of the displacements of face units at the vertices self.kept, dm."""
        return np.sum([self.shape(f"{FACE_UNITS}{name}.target") for name in names], axis=0)


def aligned(points: Doubles, like: Doubles, weight: Doubles) -> tuple[Doubles, Doubles, float]:
    """Fit points to others by a similarity, in the weighted least squares sense.

    Args:
        points: points [V, 3] to move.
        like: points [V, 3] to which they are fitted.
        weight: weight [V] of each point.

    Returns: the moved points, the rotation [3, 3] for row vectors, and the scale.
    """
    share = (weight / weight.sum())[:, None]
    middle, goal = (share * points).sum(axis=0), (share * like).sum(axis=0)
    u, s, vt = np.linalg.svd((share * (points - middle)).T @ (like - goal))
    flip = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    rotation = (u * flip) @ vt
    scale = float((s * flip).sum() / (share * (points - middle) ** 2).sum())
    return (points - middle) @ rotation * scale + goal, rotation, scale


def with_eyes(points: Doubles, eyes: list[Ints]) -> Doubles:
    """The points, followed by the middle and the foremost point of each eye.

    Args:
        points: positions [V, 3].
        eyes: vertex indices of each eye.
    """
    more = []
    for eye in eyes:
        middle = (points[eye].min(axis=0) + points[eye].max(axis=0)) / 2
        front = np.array([middle[0], middle[1], points[eye, 2].max()])
        more += [middle, front]
    return np.concatenate([points, more])


def packed(values: Doubles, kind: type) -> tuple[NDArray[np.generic], Doubles]:
    """The values as integers, and the scale of each row: values = integers * scale.

    Args:
        values: float64[rows, ...].
        kind: integer type; each row uses its full range.
    """
    flat = values.reshape(len(values), -1)
    scale = np.abs(flat).max(axis=1) / np.iinfo(kind).max
    return np.round(flat / scale[:, None]).astype(kind).reshape(values.shape), scale


def region_weights(points: Doubles, ears: NDArray[np.bool_]) -> Doubles:
    """float64[V]: weight of each vertex in the fit.

    The weight is 1 in the middle of the face, falls to 0.15 at its edge, and is 0.15 at the ears
    and behind z = -6, and 0.06 below y = -12.

    Args:
        points: positions [V, 3] in cm, with the origin between the eyes.
        ears: bool[V], whether a vertex belongs to an ear.
    """
    x, y, z = points.T
    away = np.sqrt((x / 6.5) ** 2 + ((y + 3.0) / 8.0) ** 2)
    face = np.clip(1.6 - away, 0.15, 1.0) * (z > -6.0)
    out = np.maximum(face, 0.15)
    out[ears] = 0.15
    out[y < -12.0] = 0.06
    return np.asarray(out)


def main() -> None:
    """Write native/python/risorius/anyhead/form/heads.npz."""
    heads = Heads()
    base = heads.base.positions
    skin = triangles_of(quads_of(heads.base, "body"))
    eyeballs = ["helper-l-eye", "helper-r-eye"]
    whole = np.concatenate([skin, triangles_of(quads_of(heads.base, *eyeballs))])
    inside = (base[whole][:, :, 1] > CUT).all(axis=1) & (np.abs(base[whole][:, :, 0]) < WIDE).all(
        axis=1
    )
    whole = whole[inside]
    shown = whole[seen(base, whole)]
    balls = np.concatenate([heads.groups[g] for g in eyeballs])
    shown = shown[~np.isin(shown, balls).any(axis=1)]
    own = np.unique(shown)
    teeth = heads.groups[TEETH]
    heads.kept = np.concatenate([own, balls, teeth])
    heads._read.clear()
    triangles = np.searchsorted(own, shown)
    half = len(balls) // 2
    eyes = [len(own) + np.arange(half), len(own) + half + np.arange(half)]
    dice = np.random.default_rng(SEED)
    drawn = [heads.draw(dice) for _ in range(HEADS)]
    middle = np.mean(drawn[:200], axis=0)
    root = (middle[eyes[0]].mean(axis=0) + middle[eyes[1]].mean(axis=0)) / 2
    middle = with_eyes((middle - root) * 10.0, eyes)
    ears = np.isin(own, ear_vertices(heads))
    weights = region_weights(middle[: len(own)], ears)
    rows = np.concatenate([np.arange(len(own)), np.arange(len(middle) - 4, len(middle))])
    samples = [with_eyes((d - root) * 10.0, eyes)[rows] for d in drawn]
    full = np.concatenate([weights, np.ones(4)])
    mean = middle[rows]
    for _ in range(3):
        fitted = [aligned(s, mean, full)[0] for s in samples]
        mean = np.mean(fitted, axis=0)
    mean = symmetric(mean, mirror_of(base[own]))
    table = np.stack(fitted) - mean
    share = np.sqrt(np.maximum(full, 0.1))[None, :, None]
    left, sizes, right = np.linalg.svd((table * share).reshape(HEADS, -1), full_matrices=False)
    print("variance kept:", (sizes[:COMPONENTS] ** 2).sum() / (sizes**2).sum())
    spread = sizes[:COMPONENTS] / HEADS**0.5
    parts = right[:COMPONENTS].reshape(COMPONENTS, -1, 3) / share * spread[:, None, None]
    rest = np.sqrt(
        ((table - np.einsum("hk,kvi->hvi", left[:, :COMPONENTS] * HEADS**0.5, parts)) ** 2).sum(2)
    )
    print(
        "rest, mm:",
        10 * rest[:, weights_face(full)].mean(),
        "of",
        10 * np.sqrt((table**2).sum(2))[:, weights_face(full)].mean(),
    )
    moved = np.stack(
        [expression(heads, units, eyes, root, mean, full, rows) for units in EXPRESSIONS.values()]
    )
    rows = [[c[0] for c in face] for face in heads.base.faces[TEETH]]
    strip = [np.searchsorted(teeth, face).tolist() for face in rows]
    lower = [(d - root)[-len(teeth) :] * 10.0 for d in drawn]
    told = teeth_told(mean[:-4], weights, [s[:-4] for s in samples], lower, strip)
    write(mean, parts, moved, triangles, full, mirror_of(base[own]), own, told)


def teeth_told(
    mean: Doubles, weights: Doubles, skins: list[Doubles], teeth: list[Doubles],
    strip: list[list[int]],
) -> dict[str, NDArray[np.generic]]:  # fmt: skip
    """The arrays of a ridge regression that predicts the lower teeth from the skin.

    Args:
        mean: float64[V, 3], the mean skin.
        weights: float64[V], weight of each vertex in the fit of a head.
        skins: float64[V, 3] of each head, the vertices of its skin.
        teeth: float64[n, 3] of each head, the vertices of its lower row of teeth.
        strip: polygons of the lower row of teeth.
    """
    chosen = np.flatnonzero(weights >= TEETH_SEEN)[::TEETH_STEP]
    placed, lower = [], []
    for skin, own in zip(skins, teeth, strict=True):
        both = np.concatenate([skin[chosen], own])
        weight = np.repeat([1.0, 0.0], [len(chosen), len(own)])
        goal = np.concatenate([mean[chosen], np.zeros_like(own)])
        there = aligned(both, goal, weight)[0]
        placed.append((there[: len(chosen)] - mean[chosen]).ravel())
        lower.append(there[len(chosen) :])
    middle = np.mean(lower, axis=0)
    out = np.array([[*t.mean(axis=0), *affine_form(strip, middle, t).ravel()] for t in lower])
    given = np.array(placed)
    usual, rest = out.mean(axis=0), given.mean(axis=0)
    given -= rest
    held = given @ given.T + TEETH_NOISE * np.eye(len(given))
    ways = np.linalg.solve(held, out - usual).T @ given
    small, scale = packed(ways, np.int16)
    print("rest of the teeth:", (out - usual - given @ ways.T).std(axis=0).round(4))
    return {
        "teeth_vertices": chosen.astype(np.uint16), "teeth_ways": small, "teeth_scale": scale,
        "teeth_usual": (usual - ways @ rest), "teeth_mean": usual,
        "teeth_spread": out.std(axis=0),
    }  # fmt: skip


def weights_face(weights: Doubles) -> NDArray[np.bool_]:
    return weights > 0.9


def ear_vertices(heads: Heads) -> Ints:
    """Indices of the base mesh's vertices that the data's shapes for the size of ears move."""
    moved = np.zeros(heads.count)
    for side in "lr":
        way = heads.source.target(f"{TARGETS}ears/{side}-ear-scale-incr.target.gz", heads.count)
        moved = np.maximum(moved, np.linalg.norm(way, axis=1))
    return np.flatnonzero(moved > 0.02)


def mirror_of(points: Doubles) -> Ints:
    """int64[V]: index of the vertex nearest to the mirror image of each vertex."""
    out = np.empty(len(points), np.int64)
    for k, point in enumerate(points * [-1.0, 1.0, 1.0]):
        out[k] = ((points - point) ** 2).sum(axis=1).argmin()
    return out


def symmetric(mean: Doubles, mirror: Ints) -> Doubles:
    """The average of a shape and its mirror image.

    Args:
        mean: positions [V + 4, 3]; the last four rows are middle and front of each eye.
        mirror: int64[V], index of each vertex's mirror image.
    """
    count = len(mirror)
    other = np.concatenate([mirror, count + np.array([2, 3, 0, 1])])
    return np.asarray((mean + mean[other] * [-1.0, 1.0, 1.0]) / 2)


def expression(
    heads: Heads, units: tuple[str, ...], eyes: list[Ints], root: Doubles, mean: Doubles,
    weights: Doubles, rows: Ints,
) -> Doubles:  # fmt: skip
    """float64[V, 3]: displacements of an expression in the orientation and scale of the mean shape.

    Args:
        heads: the data.
        units: names of the face units.
        eyes: vertex indices of each eye.
        root: the point between the eyes, decimetres.
        mean: the mean shape, cm.
        weights: weight of each point in the fit.
        rows: for each point of the mean shape, its index among the vertices heads.kept, followed by
            two points of each eye.
    """
    rest = heads.base.positions[heads.kept]
    # The face units (shapes of expressions) are made for the adult face of the data, but the base
    # mesh is not an adult.
    person = Person("", "male", 25, {"caucasian": 1.0}, *[(0, 0, 0)] * 6, 0, ((0, 0, 0), (0, 0, 0)))
    for name, weight in person.shape().items():
        rest = rest + weight * heads.shape(f"{TARGETS}{name}.target.gz")
    still = with_eyes((rest - root) * 10.0, eyes)[rows]
    _, rotation, scale = aligned(still, mean, weights)
    moved = heads.expression(units) * 10.0
    moved = np.concatenate([moved, np.zeros((4, 3))])[rows_of(rows, len(moved))]
    return moved @ rotation * scale


def rows_of(rows: Ints, count: int) -> Ints:
    """`rows` with `count` to `count + 3` in place of its last four entries (points of the eyes)."""
    return np.concatenate([rows[:-4], count + np.arange(4)])


def write(
    mean: Doubles, parts: Doubles, moved: Doubles, triangles: Ints, weights: Doubles,
    mirror: Ints, own: Ints, teeth: dict[str, NDArray[np.generic]],
) -> None:  # fmt: skip
    names = toml.read(PACKAGE / "landmarks" / "names.toml")
    places, labels = [], []
    for name, row in names.items():
        at = int(np.searchsorted(own, row["vertex"]))
        if at >= len(own) or own[at] != row["vertex"]:
            raise SystemExit(f"names.toml, {name}: vertex {row['vertex']} is not seen")
        for label, vertex in ((name, at), (name[:-1] + "R", int(mirror[at]))):
            if label not in labels:
                labels.append(label)
                places.append(vertex)
            if not name.endswith("_L"):
                break
    form, scale = packed(np.concatenate([mean[None], moved]), np.int16)
    small, part_scale = packed(parts, np.int8)
    out = io.BytesIO()
    np.savez_compressed(
        out, form=form, form_scale=scale, parts=small, part_scale=part_scale,
        triangles=triangles.astype(np.uint16), weights=np.round(weights * 255).astype(np.uint8),
        mirror=mirror.astype(np.uint16), names=np.array(labels), places=np.array(places, np.uint16),
        expressions=np.array(list(EXPRESSIONS)), **teeth,
    )  # fmt: skip
    path = PACKAGE / "form" / "heads.npz"
    fileio.write_bytes(path, out.getvalue())
    print(f"{path}: {path.stat().st_size} bytes, {len(mean)} vertices, {len(triangles)} triangles")


if __name__ == "__main__":
    main()
