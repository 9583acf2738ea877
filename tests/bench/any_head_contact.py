# SPDX-License-Identifier: MIT
"""Measures the faults of transferred expressions before and after their repair.

    python tests/bench/any_head_contact.py HEAD.obj... [--template FACE.dna] [--deepest 3]

The template's expressions are transferred to each head with automatic landmarks, and repaired. The
table has two rows per head, before and after the repair, over all expressions and correctives:
*gap*: the widest gap between closed lids, by rays from the eye's centre;
*seen*: the largest visible area of an eye with both blinks, over five views of the face;
*cut*: the greatest depth of the outer lids in the eye;
*lips*, *lips in*: the widest gap and the deepest cut of the lips in the pose that closes the mouth
of an open jaw;
*teeth*: volume of skin in teeth and gums beyond the neutral face's, by SkinChecker, summed over the
`--deepest` expressions with the largest volume;
*torn*: number of polygons that grow to more than 2.5 times their area, over all expressions.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import risorius
from risorius._native import ClosestPoints
from risorius.anyhead.default import default_template
from risorius.anyhead.fittings import Bodies, Fittings, complete, sort_parts
from risorius.anyhead.fittings.lower_teeth import jaw_by_teeth
from risorius.anyhead.laying import lay
from risorius.anyhead.onto import whole_ways
from risorius.anyhead.reading import read_head
from risorius.anyhead.repair import Repaired, repair
from risorius.anyhead.repair.contact import Contacts
from risorius.anyhead.repair.repairing import Repairing, closing_pose
from risorius.anyhead.repair.report import Faults, Report
from risorius.anyhead.standing import Standing, stand
from risorius.anyhead.surface import Surface
from risorius.anyhead.transfer.template import TemplateFace, read_template
from risorius.anyhead.transfer.transfer import TransferOptions, transfer
from risorius.author.heads.parts import Wishes
from risorius.base.errors import RisoriusError

VIEWS = ((0, 0), (-25, 0), (25, 0), (0, 15), (0, -15))  # degrees to the side and up
PIXEL = 0.02  # cm
HEADS = ("head", "gap mm", "seen mm2", "cut mm", "lips mm", "lips in mm", "teeth mm3", "torn")


def seen_of_eyes(skin, triangles, eyes):
    """The largest visible area of a single eye in mm2, over all eyes and all VIEWS."""
    worst = 0.0
    for aside, up in VIEWS:
        a, u = np.radians(aside), np.radians(up)
        way = np.array([np.sin(a) * np.cos(u), np.sin(u), np.cos(a) * np.cos(u)])
        side = np.cross([0.0, 1.0, 0.0], way)
        side /= np.linalg.norm(side)
        high = np.cross(way, side)
        for ball in eyes.values():
            at = np.arange(-ball.radius, ball.radius, PIXEL)
            x, y = (grid.ravel() for grid in np.meshgrid(at, at))
            begin = ball.middle + x[:, None] * side + y[:, None] * high + 5 * ball.radius * way
            near = np.linalg.norm(skin - ball.middle, axis=1) < 3 * ball.radius
            own = triangles[near[triangles].any(axis=1)]
            rays = np.broadcast_to(-way, begin.shape)
            eye = ClosestPoints(ball.points, ball.triangles.astype(np.int32)).first_hit(begin, rays)
            lid = ClosestPoints(skin, own.astype(np.int32)).first_hit(begin, rays)
            hit = (eye[0] >= 0) & ((lid[0] < 0) | (eye[2] < lid[2]))
            worst = max(worst, float(hit.sum()) * PIXEL**2 * 100)
    return worst


def blinks(ways):
    return sum((way for name, way in ways.items() if name.startswith("eyeBlink")), np.zeros(1))


def row_of(target, fitted, singles, pairs, work, contacts, bodies, most):
    """The values of one table row, in the order of HEADS without the head's name.

    Args:
        target: the head's skin.
        fitted: eyes, teeth and other parts fitted to the head.
        singles: control -> displacements float64[V, 3], cm.
        pairs: tuple of controls -> displacements of their corrective.
        work: Repairing that finds the faults of a pose.
        contacts: Contacts that measures the volume of skin in teeth.
        bodies: unused.
        most: number of poses whose volume is summed.
    """
    poses = {(name,): way for name, way in singles.items()} | pairs
    faults = {pose: work.faults(pose, way) for pose, way in poses.items()}
    closing = set(closing_pose(singles, pairs))
    shut = [f for pose, f in faults.items() if closing and set(pose) == closing] or [Faults()]
    deep = sorted(faults, key=lambda pose: -faults[pose].volume)[:most]
    volume = sum(
        contacts.volume_by_checker(poses[pose], pose) for pose in deep if faults[pose].volume > 0
    )
    seen = seen_of_eyes(target.points + blinks(singles), target.triangles, fitted.eyes)
    return (
        max(f.lid_gap for f in faults.values()), seen, max(f.cut for f in faults.values()),
        shut[0].lip_gap, shut[0].lip_cut, volume, sum(f.stretched for f in faults.values()),
    )  # fmt: skip


def table(name, rows):
    for when, values in zip(("before", "after"), rows, strict=True):
        cells = " | ".join(f"{value:.2f}" for value in values[:-1])
        print(f"| {name} {when} | {cells} | {values[-1]} |", flush=True)


@dataclass
class Made:
    """A head with expressions before and after their repair."""

    target: Surface
    fitted: Fittings
    singles: dict
    pairs: dict
    out: Repaired
    seconds: float  # CPU seconds of the repair

    @property
    def report(self) -> Report:
        return self.out.report


def repaired(head: Standing, template, source: TemplateFace, strength: float = 1.0) -> Made:
    """The template's expressions on a head from stand() (upright, in cm), before and after repair.

    Args:
        head: the head's parts and landmarks.
        template: the template's Dna.
        source: the template as a TemplateFace.
        strength: strength of the transferred expressions; 1: as large as the template's.
    """
    found = sort_parts(head.parts)
    target = Surface.of_polygons(found.face.mesh.positions, found.face.mesh.faces)
    laid = lay(source, target, head.found)
    jaw = None if laid.jaw is None else jaw_by_teeth(laid.jaw, template, found)
    options = TransferOptions(strength)
    ways = whole_ways(transfer(source, target, laid.points, laid.trust, options, None, jaw).ways)
    fitted = complete(found, template, laid.points)
    singles = {pose[0]: way for pose, way in ways.items() if len(pose) == 1}
    pairs = {pose: way for pose, way in ways.items() if len(pose) > 1}
    began = time.process_time()
    faces = fitted.face.mesh.faces
    out = repair(target, faces, fitted, head.found.landmarks, laid, singles, pairs)
    return Made(target, fitted, singles, pairs, out, time.process_time() - began)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("heads", nargs="+", type=Path)
    parser.add_argument("--template", type=Path)
    parser.add_argument("--strength", type=float, default=1.0)
    parser.add_argument("--deepest", type=int, default=3)
    args = parser.parse_args()
    template = risorius.load(args.template or default_template())
    source = read_template(template)
    print("| " + " | ".join(HEADS) + " |\n|" + "---|" * len(HEADS))
    for path in args.heads:
        try:
            head = stand(path.name, *read_head(path), Wishes(), None)
            made = repaired(head, template, source, args.strength)
        except RisoriusError as error:
            print(f"| {path.stem} | {error} |")
            continue
        target, fitted, singles, pairs = made.target, made.fitted, made.singles, made.pairs
        work = Repairing(
            target, fitted.face.mesh.faces, fitted, head.found.landmarks, singles,
            closing_pose(singles, pairs),
        )  # fmt: skip
        bodies = Bodies(fitted, target, singles)
        contacts = Contacts(target, fitted.face.mesh.faces, bodies)
        rows = [
            row_of(target, fitted, *ways, work, contacts, bodies, args.deepest)
            for ways in ((singles, pairs), (made.out.expressions, made.out.combinations))
        ]
        table(path.stem, rows)
        print(f"<!-- {len(target.points):,} vertices, {made.seconds:.0f} CPU s: "
              f"{'; '.join([*fitted.notes, *made.report.notes])} -->", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
