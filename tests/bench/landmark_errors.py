# SPDX-License-Identifier: MIT
"""Prints a table of the errors of automatically found landmarks.

    python tests/bench/landmark_errors.py [--seeds 1 2 3] [--ict ../shared/data/real/ict/ict.npz]

Heads are random people from the data of the sample people. Their meshes are changed so that their
vertices do not correspond to the template's: subdivided with noise of 0.1 mm, or made coarser. The
true place of a landmark is the template's landmark on the vertices that all people share. Lengths
are millimetres on heads scaled to a height of 24 cm. Takes a second per head and kind of mesh.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from risorius import _native
from risorius.anyhead.form.standing import coarsened
from risorius.anyhead.landmarks.find import Found, Hints, find_form
from risorius.anyhead.landmarks.marks import LandmarkError
from risorius.anyhead.surface import Surface

Doubles = NDArray[np.float64]
CORNERS = ("eye_inner", "eye_outer", "mouth_corner")
LOW, WIDE = 5.2, 1.4  # dm: skin above LOW and at most WIDE from the middle is kept
HIGH = 240.0  # mm, the height to which errors are scaled


def random_people(seeds: list[int]) -> tuple[NDArray[np.int64], list[Doubles]]:
    """Triangles of the skin, and the vertices of each head in cm; the sample man is first."""
    from risorius_people.body import Body
    from risorius_people.people import MAN, ORIGINS
    from risorius_people.source import TARGETS, Source, fetch

    source = Source(fetch(offline=True))
    base = source.base_mesh()
    quads = np.array([[c[0] for c in face] for face in base.faces["body"]])
    kept = (base.positions[quads][:, :, 1] > LOW).all(axis=1)
    kept &= (np.abs(base.positions[quads][:, :, 0]) < WIDE).all(axis=1)
    triangles = np.concatenate([quads[kept][:, [0, 1, 2]], quads[kept][:, [0, 2, 3]]])
    own, folders = np.unique(triangles), ("chin", "cheek", "mouth", "nose", "forehead", "head")
    names = sorted(
        n.removeprefix(TARGETS).removesuffix(".target.gz")
        for n in source._names
        if n.startswith(TARGETS) and n.removeprefix(TARGETS).split("/")[0] in folders
    )
    heads = [Body(source, base, MAN).positions[own] * 10]
    for seed in seeds:
        dice = np.random.default_rng(seed)
        features = {str(n): float(dice.uniform(0.1, 0.6)) for n in dice.choice(names, 12, False)}
        person = replace(
            MAN, gender=str(dice.choice(["male", "female"])), age=int(dice.integers(14, 75)),
            muscle=float(dice.uniform(0.2, 0.8)), weight=float(dice.uniform(0.2, 0.8)),
            origin=dict(zip(ORIGINS, dice.dirichlet([1, 1, 1]).tolist(), strict=True)),
            features=features,
        )  # fmt: skip
        heads.append(Body(source, base, person).positions[own] * 10)
    return np.searchsorted(own, triangles), heads


def ict_heads(path: Path) -> tuple[NDArray[np.int64], list[Doubles]]:
    """Triangles of ICT FaceKit's skin, and the vertices of its template and identities."""
    with np.load(path) as data:
        faces, neutral = data["faces"].astype(np.int64), data["neutral"].astype(np.float64)
        heads = [neutral, *(neutral + delta for delta in data["identity_delta"])]
    faces = faces[faces.max(axis=1) < 11248]
    triangles = np.concatenate([faces[:, :3], faces[faces[:, 3] >= 0][:, [0, 2, 3]]])
    own = np.unique(triangles)
    return np.searchsorted(own, triangles), [head[own] for head in heads]


def subdivided(surface: Surface, dice: np.random.Generator) -> Surface:
    """The surface with each triangle divided into four, and with noise of 0.1 mm."""
    edges = np.sort(surface.triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2)
    sides, back = np.unique(edges.reshape(-1, 2), axis=0, return_inverse=True)
    ab, bc, ca = (len(surface.points) + back.reshape(-1, 3)).T
    a, b, c = surface.triangles.T
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    points = np.concatenate([surface.points, surface.points[sides].mean(axis=1)])
    triangles = np.concatenate([np.stack(part, axis=1) for part in parts])
    return Surface(points + dice.normal(0, 0.01, points.shape), triangles)


def errors(
    template: Surface, first: Found, points: Doubles, mesh: Surface, name: str
) -> dict[str, float]:
    """Landmark -> error in mm, scaled to a head 24 cm high; empty if no landmarks were found.

    Args:
        template: the first head, with the vertices that all heads share.
        first: landmarks of the template.
        points: the shared vertices of another head, which give the true places.
        mesh: the other head with changed vertices, on which landmarks are searched.
        name: name of the head in error messages.
    """
    names = list(first.landmarks.points)
    closest = _native.ClosestPoints(template.points, template.triangles)
    triangle, shares, _ = closest.nearest([first.landmarks.points[n] for n in names])
    goal = Surface(points, template.triangles).at(triangle, shares)
    try:
        have = find_form(mesh, Hints(name)).landmarks
    except LandmarkError as error:
        print(error)
        return {}
    tall = float(np.linalg.norm(goal[names.index("nose_root")] - goal[names.index("chin")])) * 2.25
    return {
        n: float(np.linalg.norm(have.points[n] - goal[k])) / tall * HIGH
        for k, n in enumerate(names)
        if n in have.points
    }


def run(
    title: str, triangles: NDArray[np.int64], heads: list[Doubles], kinds: tuple[str, ...]
) -> None:
    template = Surface(heads[0], triangles)
    first = find_form(template, Hints(title))
    rows, worst = [], []
    for number, points in enumerate(heads[1:], 1):
        for kind in kinds:
            mesh = Surface(points, triangles)
            if kind == "subdivided":
                mesh = subdivided(mesh, np.random.default_rng(number))
            elif kind == "coarse":
                mesh = coarsened(mesh)
            row = errors(template, first, points, mesh, f"{title} {number} {kind}")
            at_corners = [v for n, v in row.items() if n.startswith(CORNERS)]
            worst.append(max(at_corners, default=np.inf))
            rows.append(row)
            print(f"{title} {number} {kind}: corners at most {worst[-1]:.2f} mm", flush=True)
    print(f"\n{title}: corners within 1.5 mm on {np.sum(np.array(worst) <= 1.5)} of {len(worst)}\n")
    print("| landmark | mean, mm | largest, mm |\n|---|---|---|")
    for name in first.landmarks.points:
        values = [row[name] for row in rows if name in row]
        if values and not name.endswith("_R"):
            print(f"| `{name}` | {np.mean(values):.2f} | {np.max(values):.2f} |")


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seeds", type=int, nargs="*", default=list(range(1, 9)))
    parser.add_argument("--ict", type=Path, default=Path("../shared/data/real/ict/ict.npz"))
    given = parser.parse_args()
    if given.seeds:
        run("people", *random_people(given.seeds), ("subdivided", "coarse"))
    if given.ict.exists():
        run("ICT", *ict_heads(given.ict), ("same", "subdivided", "coarse"))
    else:
        print(f"NOT RUN: {given.ict} is not there")


if __name__ == "__main__":
    main()
