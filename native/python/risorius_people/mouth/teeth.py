# SPDX-License-Identifier: MIT
"""Makes teeth and gums in place of the base mesh's teeth, which are bare strips.

A crown is a stack of rings between the biting edge and the gum. Its measures are means of adults
(Wheeler's Dental Anatomy, tables of the crowns). Lengths are in decimetres on the base mesh. Each
vertex is an affine combination of a strip's vertices, so that teeth fit every head and move with
the strip.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..part import Part
from ..polygons import Floats, Ints, Operator, Polygons
from ..source import BaseMesh

MM = 0.01


@dataclass(frozen=True)
class Tooth:
    """Measures of a crown in mm: `wide` along the arch, `thick` from lip to tongue, and `high` from
    the biting edge to the gum."""

    kind: str  # "incisor", "canine" or "molar"
    wide: float
    thick: float
    high: float


UPPER = (
    Tooth("incisor", 8.5, 7.0, 10.0),
    Tooth("incisor", 6.5, 6.0, 8.8),
    Tooth("canine", 7.5, 8.0, 9.8),
    Tooth("molar", 7.0, 9.0, 8.2),
    Tooth("molar", 7.0, 9.0, 7.7),
    Tooth("molar", 10.0, 11.0, 7.2),
    Tooth("molar", 9.0, 11.0, 6.8),
)
LOWER = (
    Tooth("incisor", 5.3, 5.8, 8.8),
    Tooth("incisor", 5.7, 6.2, 9.2),
    Tooth("canine", 6.8, 7.6, 10.2),
    Tooth("molar", 7.0, 7.5, 8.6),
    Tooth("molar", 7.0, 8.0, 8.0),
    Tooth("molar", 11.0, 10.2, 7.3),
    Tooth("molar", 10.4, 10.0, 6.9),
)
# Heights of the rows of a crown: 0 at the edge, 1 at the gum, above 1 in the root.
_HEIGHTS = (0.0, 0.05, 0.16, 0.38, 0.66, 0.88, 1.02, 1.25)
# Kind of tooth -> three lists with a number for each of _HEIGHTS: fraction of half the width,
# fraction of half the thickness, and offset of the lip side in mm.
_PROFILES = {
    "incisor": (
        (0.84, 0.93, 0.98, 1.0, 0.94, 0.86, 0.8, 0.72),
        (0.12, 0.19, 0.28, 0.46, 0.8, 0.96, 0.96, 0.9),
        (-0.35, -0.08, 0.1, 0.3, 0.4, 0.25, -0.1, -0.6),
    ),
    "canine": (
        (0.5, 0.66, 0.86, 1.0, 0.94, 0.86, 0.8, 0.72),
        (0.14, 0.24, 0.38, 0.6, 0.88, 1.0, 0.98, 0.92),
        (-0.5, -0.15, 0.2, 0.5, 0.5, 0.3, -0.1, -0.6),
    ),
    "molar": (
        (0.66, 0.84, 0.95, 1.0, 0.95, 0.9, 0.86, 0.8),
        (0.5, 0.68, 0.84, 0.97, 1.0, 0.97, 0.94, 0.9),
        (-1.6, -0.9, -0.35, 0.15, 0.35, 0.2, -0.1, -0.5),
    ),
}
# Rows of the gum on the side of the lip: mm from the gum's margin away from the biting edge.
_GUM_HEIGHTS = (-0.15, 0.25, 1.0, 2.6, 5.2, 7.2)
_GUM_OUT = (-0.9, 0.1, 0.4, 0.45, 0.0, -2.6)  # mm outside the crown's lip side
# Rows of the gum on the side of the tongue: mm from the gum's margin away from the biting edge.
_PALATE_HEIGHTS = (-0.2, 0.3, 1.6, 4.2)
_PALATE_IN = (0.9, -0.2, -1.6, -6.0)


class Arch:
    """The curve of a jaw's biting edges, as a function of the distance along it from the middle."""

    def __init__(self, edge: Floats, up: float) -> None:
        """Fits the curve to points of its left half; the right half mirrors it.

        Args:
            edge: float64[n, 3] in decimetres, points from the middle outward.
            up: 1 for the upper jaw, -1 for the lower jaw: sign of y from the edge to the gum.
        """
        # Polynomials in the fraction of the length make a smooth curve from few points. The points
        # are symmetric, so y and z become even functions.
        way = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(edge, axis=0), axis=1))])
        both = np.concatenate([-way[:0:-1], way])
        points = np.concatenate([edge[:0:-1] * (-1, 1, 1), edge])
        fine = np.linspace(-1, 1, 801)
        self._points = np.stack(
            [
                np.polyval(np.polyfit(both / way[-1], points[:, k], degree), fine)
                for k, degree in enumerate((7, 6, 6))
            ],
            axis=1,
        )
        steps = np.linalg.norm(np.diff(self._points, axis=0), axis=1)
        length = np.concatenate([[0], np.cumsum(steps)])
        self._length = length - length[-1] / 2
        self.half = float(length[-1] / 2)
        # The direction to the gum is the normal of the plane that fits the biting edges.
        middle = points - points.mean(axis=0)
        normal = np.linalg.svd(middle)[2][2]
        self.up = up * normal * np.sign(normal[1])

    def at(self, way: Floats) -> tuple[Floats, Floats, Floats]:
        """Points of the arch, its directions there to the character's left, and the directions
        towards the lips.

        Args:
            way: float64[n], decimetres along the arch from the middle, positive on the left.

        Returns:
            float64[n, 3] each.
        """

        def place(where: Floats) -> Floats:
            inside = np.clip(where, -self.half, self.half)
            out = np.stack(
                [np.interp(inside, self._length, self._points[:, k]) for k in range(3)], axis=1
            )
            ends = self._points[[0, -1]] - self._points[[1, -2]]
            ends /= np.linalg.norm(ends, axis=1, keepdims=True)
            out += np.maximum(where - self.half, 0)[:, None] * ends[1]
            return np.asarray(out + np.maximum(-where - self.half, 0)[:, None] * ends[0])

        step = 0.2 * MM
        along = place(way + step) - place(way - step)
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        out = np.cross(along, self.up)
        out *= np.sign(out @ (0, 0, 1) + np.sum(out * place(way) * (1, 0, 0), axis=1) * 10)[:, None]
        return place(way), along, out


class Builder:
    """Collects grids of vertices and faces into one mesh."""

    def __init__(self) -> None:
        self.points: list[Floats] = []
        self.uvs: list[Floats] = []
        self.faces: list[list[int]] = []
        self._count = 0

    def add(self, points: Floats, uvs: Floats) -> int:
        """Adds vertices; returns the index of the first.

        Args:
            points: float64[n, 3], in decimetres.
            uvs: float64[n, 2], texture coordinates.
        """
        first = self._count
        self.points.append(points)
        self.uvs.append(uvs)
        self._count += len(points)
        return first

    def sheet(self, points: Floats, uvs: Floats, closed: bool, flip: bool) -> int:
        """Adds a grid of vertices with quads between its rows; returns the index of the first
        vertex.

        Args:
            points: float64[rows, columns, 3], in decimetres.
            uvs: float64[rows, columns, 2], texture coordinates.
            closed: whether faces join the last column and the first one.
            flip: whether to reverse the winding of the faces.
        """
        rows, columns = points.shape[:2]
        first = self.add(points.reshape(-1, 3), uvs.reshape(-1, 2))
        for r in range(rows - 1):
            for c in range(columns if closed else columns - 1):
                d = (c + 1) % columns
                face = [
                    r * columns + c,
                    r * columns + d,
                    (r + 1) * columns + d,
                    (r + 1) * columns + c,
                ]
                self.faces.append([first + i for i in (face[::-1] if flip else face)])
        return first

    def polygons(self) -> tuple[Polygons, Floats]:
        """The mesh, and float64[v, 3], positions of its vertices."""
        points = np.concatenate(self.points)
        uvs = np.concatenate(self.uvs)
        return Polygons(self.faces, self.faces, uvs, len(points)), points


def arches(base: BaseMesh) -> dict[str, Arch]:
    """The arches "upper" and "lower", from the strips of the base mesh.

    The lower teeth are behind the upper teeth, as in most people.

    Args:
        base: the base mesh.
    """
    out = {}
    for name, up in (("upper", 1.0), ("lower", -1.0)):
        used = np.unique([c[0] for f in base.faces[f"helper-{name}-teeth"] for c in f])
        p = base.positions[used]
        half = p[p[:, 0] > -1e-6]
        # The edge is the outermost row of points on the biting side. The row is not level, so the
        # points are compared with an inclined line that is fitted to the row in each round.
        edge = half
        for _ in range(6):
            slope = np.polyfit(edge[:, 2], edge[:, 1], 1)[0]
            level = up * (half[:, 1] - slope * half[:, 2])
            edge = half[level < level.min() + 0.03]
        edge = edge[np.argsort(-edge[:, 2] + edge[:, 0])]
        edge = edge[np.concatenate([[True], np.diff(edge[:, 2]) < -1e-4])]
        if name == "lower":
            edge = edge - (0, 0, 2.4 * MM)
            edge[:, 0] *= 0.95
        out[name] = Arch(edge, up)
    return out


def places_of(teeth: tuple[Tooth, ...], arch: Arch) -> tuple[Floats, float]:
    """Distances of the crowns' middles from the arch's middle, float64[n], in decimetres.

    Also returns the factor on their widths, at most 1, that makes all crowns fit the arch.

    Args:
        teeth: the teeth of one half, from the middle outward.
        arch: arch of the teeth.
    """
    wide = np.array([t.wide for t in teeth]) * MM
    scale = min(1.0, 0.97 * arch.half / wide.sum())
    return scale * (np.cumsum(wide) - wide / 2), float(scale)


def add_crown(
    out: Builder, arch: Arch, tooth: Tooth, way: float, scale: float, around: int
) -> None:
    """Adds one tooth.

    Args:
        out: mesh under construction; changed.
        arch: arch of the tooth.
        tooth: measures of the tooth.
        way: position of the tooth's middle on the arch, decimetres from the arch's middle.
        scale: factor on its width and thickness.
        around: number of vertices per ring.
    """
    place, along, outward = (v[0] for v in arch.at(np.array([way])))
    up = arch.up
    half_wide, half_thick = scale * tooth.wide * MM / 2 * 1.01, scale * tooth.thick * MM / 2
    wide, thick, stand = (np.array(p) for p in _PROFILES[tooth.kind])
    angle = 2 * np.pi * (np.arange(around) + 0.5) / around
    power = 2 / 2.7
    c = np.sign(np.cos(angle)) * np.abs(np.cos(angle)) ** power
    s = np.sign(np.sin(angle)) * np.abs(np.sin(angle)) ** power
    high = tooth.high * MM * np.array(_HEIGHTS)
    a = half_wide * wide[:, None] * c
    lip = stand[:, None] * MM - half_thick * thick[:, None] * (1 - s)
    lip = lip + 0.05 * high[:, None] * (1 if tooth.kind != "molar" else 0.3)  # the roots lean back
    lip = lip - (0.06 if tooth.kind != "molar" else 0.0) * a**2 / MM  # the lip side is round
    rise = np.repeat(high[:, None], around, axis=1)
    share = np.clip(1 - np.array(_HEIGHTS) / 0.4, 0, 1)[:, None]
    if tooth.kind == "incisor":
        rise = rise + share * 0.55 * MM * np.abs(c) ** 4
    elif tooth.kind == "canine":
        rise = rise + share * 1.5 * MM * np.abs(c)
    else:
        rise = rise + share * 0.55 * MM * (1 - np.abs(np.cos(2 * angle)))
    points = place + a[..., None] * along + lip[..., None] * outward + rise[..., None] * up
    uvs = np.stack(
        [
            np.broadcast_to(0.5 + 0.5 * c, a.shape),
            np.broadcast_to(np.array(_HEIGHTS)[:, None], a.shape),
        ],
        axis=-1,
    )
    flip = bool(np.dot(np.cross(along, outward), up) < 0)
    first = out.sheet(points, uvs, True, flip)
    middle = points[0].mean(axis=0) + (1.1 * MM if tooth.kind == "molar" else -0.02 * MM) * up
    top = out.add(middle[None], np.array([[0.5, 0.0]]))
    for k in range(around):
        face = [first + (k + 1) % around, first + k, top]
        out.faces.append(face[::-1] if flip else face)


def add_gum(out: Builder, arch: Arch, teeth: tuple[Tooth, ...], steps: int) -> None:
    """Adds the gum of one jaw, whose margin curves around the necks of the teeth.

    Args:
        out: mesh under construction; changed.
        arch: arch of the jaw.
        teeth: the teeth of one half, from the middle outward.
        steps: number of columns per tooth.
    """
    middles, scale = places_of(teeth, arch)
    wide = scale * np.array([t.wide for t in teeth]) * MM
    ends = middles[-1] + wide[-1] / 2
    half = np.linspace(0, 1, steps * len(teeth) + 1) * (ends + 1.5 * MM)
    way = np.concatenate([-half[:0:-1], half])
    tooth = np.clip(np.searchsorted(middles + wide / 2, np.abs(way)), 0, len(teeth) - 1)
    within = np.clip((np.abs(way) - middles[tooth]) / (wide[tooth] / 2), -1, 1)
    high = np.interp(np.abs(way), middles, [t.high for t in teeth]) * MM
    papilla = (
        np.interp(np.abs(way), middles, [3.6 if t.kind != "molar" else 2.2 for t in teeth]) * MM
    )
    margin = high - papilla * np.abs(within) ** 2.6
    thick = scale * np.interp(np.abs(way), middles, [t.thick for t in teeth]) * MM
    lean = np.interp(np.abs(way), middles, [0.05 if t.kind != "molar" else 0.015 for t in teeth])
    between = 0.75 * MM * np.abs(within) ** 3  # the gum recedes between two crowns
    place, _, outward = arch.at(way)
    u = way / (2 * half[-1]) + 0.5

    def sheet(heights: Floats, offsets: Floats, tongue: bool) -> None:
        rows = []
        for h, o in zip(heights, offsets, strict=True):
            # The curve of the margin fades out over 5 mm, to a gum of even height.
            rise = margin + (high - margin) * np.clip(h / 5, 0, 1) + h * MM
            lip = lean * rise + 0.3 * MM + o * MM - between * (0.4 if tongue else 1.0)
            if tongue:
                lip = lip - 0.3 * MM - thick + 2 * between
            rows.append(place + lip[:, None] * outward + rise[:, None] * arch.up)
        v = np.linspace(0.5, 1.0 if not tongue else 0.0, len(rows))
        grid = np.stack(rows)
        uvs = np.stack(np.broadcast_arrays(u[None, :], v[:, None]), axis=-1)
        upper = arch.up[1] > 0
        out.sheet(grid, uvs, False, upper == tongue)

    sheet(np.array(_GUM_HEIGHTS), np.array(_GUM_OUT), False)
    sheet(np.array(_PALATE_HEIGHTS), np.array(_PALATE_IN), True)


def affine(base: Floats, chosen: Ints, points: Floats) -> Operator:
    """The operator that makes points from vertices as affine combinations with the smallest
    weights.

    Args:
        base: float64[V, 3], vertices in decimetres.
        chosen: int[n], indices of vertices to use, which must not all be in one plane.
        points: float64[m, 3], in decimetres.
    """
    p = np.column_stack([base[chosen], np.ones(len(chosen))])
    weights = np.column_stack([points, np.ones(len(points))]) @ np.linalg.pinv(p)
    rows, columns = np.indices(weights.shape)
    return Operator(
        rows.ravel(), chosen[columns.ravel()], weights.ravel(), (len(points), len(base))
    )


def mouth_parts(base: BaseMesh, lod: int) -> list[Part]:
    """Makes the meshes of teeth and gums of one LOD.

    Args:
        base: the base mesh.
        lod: number of the LOD, 0 or 1.
    """
    around, steps = ((14, 6), (8, 4))[lod]
    made: dict[str, list[tuple[Polygons, Operator]]] = {"teeth": [], "gums": []}
    for name, arch in arches(base).items():
        row = UPPER if name == "upper" else LOWER
        crowns, gums = Builder(), Builder()
        middles, scale = places_of(row, arch)
        for tooth, middle in zip(row, middles, strict=True):
            for side in (1, -1):
                add_crown(crowns, arch, tooth, side * middle, scale, around)
        add_gum(gums, arch, row, steps)
        used = np.unique([c[0] for f in base.faces[f"helper-{name}-teeth"] for c in f])
        for kind, builder in (("teeth", crowns), ("gums", gums)):
            polygons, points = builder.polygons()
            made[kind].append((polygons, affine(base.positions, used, points)))
    return [Part(f"{kind}_lod{lod}_mesh", *joined(two), rests=True) for kind, two in made.items()]


def joined(parts: list[tuple[Polygons, Operator]]) -> tuple[Polygons, list[Operator]]:
    """Joins meshes into one mesh, and their operators into one operator, returned as a list.

    Args:
        parts: the meshes, each with the operator that makes its vertices.
    """
    faces, uv_faces, rows, columns, weights = [], [], [], [], []
    count = uv_count = 0
    for polygons, operator in parts:
        faces += [[i + count for i in face] for face in polygons.faces]
        uv_faces += [[i + uv_count for i in face] for face in polygons.uv_faces]
        rows.append(operator.rows + count)
        columns.append(operator.columns)
        weights.append(operator.weights)
        count += polygons.vertex_count
        uv_count += len(polygons.uvs)
    uvs = np.concatenate([polygons.uvs for polygons, _ in parts])
    whole = Operator(
        np.concatenate(rows),
        np.concatenate(columns),
        np.concatenate(weights),
        (count, parts[0][1].shape[1]),
    )
    return Polygons(faces, uv_faces, uvs, count), [whole]
