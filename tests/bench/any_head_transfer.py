# SPDX-License-Identifier: MIT
"""Compares transferred expressions with the true expressions of generated heads.

    python tests/bench/any_head_transfer.py [--heads 4] [--first 300] [--known] [--threads 0]

Draws random people from the sample's generator, whose expressions are known, remeshes them, and
transfers the man's expressions to them without repair at strength 1. The template is fitted to a
head by registration with automatic landmarks, or with --known by the true vertex positions. An
expression's error is the distance from the true expression, over the vertices that it moves by more
than 0.1 mm.

The row of a head: the mean of the mean errors, the largest mean error, the largest 95 % quantile,
the numbers of expressions with a mean above 0.3 mm and with a quantile above 1.2 mm, and the number
of edges that jawOpen stretches by 5 mm too much. A second row has the errors of copying
displacements from the nearest place (by_vertex). The last rows are the 12 expressions with the
largest mean error over all heads.
"""

from __future__ import annotations

import argparse
import resource
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "python" / "support"))
sys.path.insert(0, str(Path(__file__).parents[1] / "python"))

import any_heads
from risorius._native import ClosestPoints
from risorius.anyhead.form.teeth import jaw_change, standing_pose
from risorius.anyhead.landmarks.find import Hints, find_form
from risorius.anyhead.laying import Laid, lay
from risorius.anyhead.onto import whole_ways
from risorius.anyhead.surface import Surface
from risorius.anyhead.transfer.template import TemplateFace, read_template
from risorius.anyhead.transfer.transfer import TransferOptions, transfer
from risorius_people.blend_shape_face import assemble
from risorius_people.people import MAN

MM = 10.0  # mm per cm
MOVES, MEAN, MOST = 0.1, 0.3, 1.2  # mm
TORN = 5.0  # mm
SHARES = (1.0, 0.4, 4.0)  # triangles of successive heads, relative to the drawn person's skin


def skin_of(person, source) -> TemplateFace:
    """A person's skin as a template, with the displacements of each control and corrective."""
    return read_template(assemble(source, lambda _: None, person)[0])


def truth_on(face: TemplateFace, target: Surface) -> tuple[np.ndarray, dict]:
    """The true displacements of a remeshed head.

    Args:
        face: the person's skin, whose displacements are known.
        target: the remeshed skin of the same person.

    Returns:
        bool[V]: whether a vertex of the target has a place on the person's skin; and pose ->
        float64[V, 3], the displacements of this place in cm.
    """
    own = face.surface
    near = ClosestPoints(own.points, own.triangles)
    triangle, shares, _ = near.nearest(target.points, target.normals(), 0.5, 0.1)
    on = triangle >= 0
    corners = own.triangles[np.where(on, triangle, 0)]
    weights = shares * on[:, None]
    return on, {p: np.einsum("nk,nkd->nd", weights, w[corners]) for p, w in face.ways.items()}


def by_vertex(face: TemplateFace, target: Surface, laid: Laid) -> dict:
    """Pose -> displacements [V, 3] that the nearest place of the registered template has, in cm."""
    near = ClosestPoints(laid.points, face.surface.triangles)
    triangle, shares, _ = near.nearest(target.points, target.normals(), 0.4, 1.5)
    corners = face.surface.triangles[np.maximum(triangle, 0)]
    weights = shares * (triangle >= 0)[:, None]
    return {p: np.einsum("nk,nkd->nd", weights, w[corners]) for p, w in face.ways.items()}


def errors(got: dict, true: dict, on: np.ndarray) -> dict:
    """Pose -> mean and 95 % quantile of the errors in mm, over vertices that move over 0.1 mm.

    Poses with at most 10 such vertices are omitted.

    Args:
        got: pose -> transferred displacements float64[V, 3], cm.
        true: pose -> true displacements.
        on: bool[V], vertices that count.
    """
    out = {}
    for pose, way in true.items():
        moves = on & (np.linalg.norm(way, axis=1) * MM > MOVES)
        if moves.sum() > 10 and pose in got:
            off = MM * np.linalg.norm(got[pose] - way, axis=1)[moves]
            out[pose] = off.mean(), np.percentile(off, 95)
    return out


def torn(got: dict, true: dict, target: Surface, on: np.ndarray) -> int:
    """The number of edges that jawOpen stretches by more than TORN mm beyond the truth."""
    edges = target.edges()
    edges = edges[on[edges].all(axis=1)]

    def grown(way: np.ndarray) -> np.ndarray:
        return np.linalg.norm(np.subtract(*(target.points + way)[edges].swapaxes(0, 1)), axis=1)

    pose = ("jawOpen",)
    return int((MM * (grown(got[pose]) - grown(true[pose])) > TORN).sum())


def said(label: str, found: dict, more: str = "") -> None:
    rows = np.array(list(found.values()))
    beyond = (rows[:, 0] > MEAN).sum(), (rows[:, 1] > MOST).sum()
    print(f"{label:34} {rows[:, 0].mean():6.3f} {rows[:, 0].max():6.3f} {rows[:, 1].max():6.2f}"
          f" {beyond[0]:5} {beyond[1]:5} of {len(rows)}{more}", flush=True)  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--heads", type=int, default=4)
    parser.add_argument("--first", type=int, default=300, help="seed of the first head")
    parser.add_argument("--known", action="store_true", help="by the true places")
    parser.add_argument("--threads", type=int, default=0)
    args = parser.parse_args()
    source = any_heads.generator()
    face = skin_of(MAN, source)
    stands = standing_pose(face.surface)
    upright = Hints(up=np.eye(3)[1], front=np.eye(3)[2])
    print(f"{len(face.ways)} poses of {len(face.surface.points):,} vertices; mm")
    print(f"{'head':34} {'mean':>6} {'worst':>6} {'95 %':>6} beyond {MEAN} and {MOST}")
    every: dict = {}
    for number in range(args.heads):
        seed = args.first + number
        true_face = skin_of(any_heads.random_person(seed, source), source)
        target = any_heads.remeshed(true_face.surface, SHARES[number % len(SHARES)], seed)
        begin = time.perf_counter()
        if args.known:
            true = true_face.surface.points
            jaw = jaw_change(face.surface, true, face.surface, stands)
            laid = Laid(true, np.ones(len(true)), None, jaw)
        else:
            laid = lay(face, target, find_form(target, upright), args.threads)
        middle = time.perf_counter()
        options = TransferOptions(1.0, args.threads)
        got = whole_ways(
            transfer(face, target, laid.points, laid.trust, options, None, laid.jaw).ways
        )
        end = time.perf_counter()
        on, true = truth_on(true_face, target)
        found = errors(got, true, on)
        more = f"; {middle - begin:.0f} + {end - middle:.0f} s; torn {torn(got, true, target, on)}"
        said(f"{seed}: {len(target.points):,} vertices", found, more)
        said("  vertex by vertex", errors(by_vertex(face, target, laid), true, on))
        for pose, row in found.items():
            every.setdefault(pose, []).append(row)
    means = sorted(((*np.mean(rows, axis=0), pose) for pose, rows in every.items()), reverse=True)
    for mean, most, pose in means[:12]:
        print(f"{'+'.join(pose)[:50]:50} {mean:6.3f} {most:6.2f}")
    whole = np.array([row for rows in every.values() for row in rows])
    kept = ((whole[:, 0] <= MEAN) & (whole[:, 1] <= MOST)).mean()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    print(f"{100 * kept:.1f} % of {len(whole)} within both; {peak:.1f} GB at most")


if __name__ == "__main__":
    main()
