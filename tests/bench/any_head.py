# SPDX-License-Identifier: MIT
"""Measures automatic rigs of heads with a known true shape, and compares them with all targets.

    python tests/bench/any_head.py [--heads 20] [--first 400] [--kind decimated] [--ict ict.npz]
        [--only registration]

Every fourth seed gives an identity of ICT FaceKit, to which ICT's own skin is registered; without
ICT's file these rows are NOT RUN. The other seeds give random people of the sample's generator, to
which the sample man is registered. The heads use the remeshings of KINDS in turn; none of them
welds the lips. Eyes and teeth come from the template. Contacts (*gap*, *cut*, *lips*) are measured
with the expressions of the default template, on ICT's heads too.

Columns, in mm: *surface*, mean distance of trusted vertices from the head; *along*, their mean
error along the surface; *corner*, the largest error of the six corners of eyes and mouth; *rows*,
the percentage of expressions and correctives within 0.3 mm on average and 1.2 mm for 95 % of the
vertices that they move; *worst mean* and *worst 95 %*, the largest of these two errors (before
repair, at strength 1); after repair *gap*, the widest gap of closed lids, *cut*, the deepest cut of
lids into an eye (0.05 mm count as none), and *lips*, the gap of the lips where the jaw opens and
the mouth closes; *misses*, the targets that the head does not reach. CPU seconds are of the whole
head. With --only registration, expressions are left out.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import risorius

sys.path.insert(0, str(Path(__file__).parents[1] / "python" / "support"))
sys.path.insert(0, str(Path(__file__).parents[1] / "python"))

import any_head_contact as contact
import any_head_transfer as truth
import any_heads
from risorius.anyhead.default import default_template
from risorius.anyhead.landmarks.find import Hints, find_form
from risorius.anyhead.laying import Laid, lay
from risorius.anyhead.onto import whole_ways
from risorius.anyhead.standing import stand
from risorius.anyhead.surface import Surface
from risorius.anyhead.transfer.template import Jaw, TemplateFace, read_template
from risorius.anyhead.transfer.transfer import TransferOptions, transfer
from risorius.author.heads.parts import HeadPart, Wishes
from risorius.author.heads.turning import jaw_turn
from risorius.author.input.obj import ObjMesh
from risorius.base.errors import RisoriusError
from risorius_people.blend_shape_face import assemble
from risorius_people.people import MAN

MM = 10.0  # mm per cm
KINDS = {"triangulated": 1.0, "decimated": 0.4, "scan": 1.0, "subdivided": 4.0, "dressed": 0.5}
ICT = Path(__file__).parents[3] / "shared" / "data" / "real" / "ict" / "ict.npz"
ICT_EACH, ICT_SKIN = 4, 11248  # every fourth seed; the first vertices of ICT are its skin
CORNERS = (
    "eye_inner_L",
    "eye_inner_R",
    "eye_outer_L",
    "eye_outer_R",
    "mouth_corner_L",
    "mouth_corner_R",
)
UPRIGHT = Hints(up=np.eye(3)[1], front=np.eye(3)[2])
COLUMNS = ("surface", "along", "corner", "rows", "worst mean", "worst 95 %", "gap", "cut", "lips")
LIMITS = (0.1, 1.0, 1.5, 100.0, 0.3, 1.2, 0.15, 0.05, 0.3)


@dataclass
class Source:
    """A template whose vertices are known on other heads, and its corners of eyes and mouth."""

    face: TemplateFace
    corners: list[int]


def source_of(face: TemplateFace) -> Source:
    marks = find_form(face.surface, UPRIGHT).landmarks.points
    points = face.surface.points
    return Source(
        face, [int(((points - marks[name]) ** 2).sum(axis=1).argmin()) for name in CORNERS]
    )


def noisy(skin: Surface, random: np.random.Generator) -> Surface:
    """The surface with noise of 0.12 mm and five holes in its back, like a scan."""
    points = skin.points + random.normal(0, 0.012, skin.points.shape)
    middles = points[skin.triangles].mean(axis=1)
    back = middles[middles[:, 2] < np.median(middles[:, 2])]
    kept = np.ones(len(middles), bool)
    for middle in back[random.integers(len(back), size=5)]:
        kept &= np.linalg.norm(middles - middle, axis=1) > random.uniform(0.3, 1.2)
    return Surface(points, skin.triangles[kept])


def dressed(skin: Surface, true: np.ndarray) -> Surface:
    """The surface plus layers for hair 12 mm over the skull and a collar 8 mm over the neck."""
    top, front = true[:, 1].max(), true[:, 2].max()
    normals = skin.normals()
    middles = skin.points[skin.triangles].mean(axis=1)
    hair = (middles[:, 1] > top - 9) & (middles[:, 2] < front - 7)
    collar = middles[:, 1] < true[:, 1].min() + 3
    points, triangles = [skin.points], [skin.triangles]
    for chosen, thickness in ((hair, 1.2), (collar, 0.8)):
        triangles.append(skin.triangles[chosen] + len(skin.points) * len(points))
        points.append(skin.points + thickness * normals)
    return Surface(np.concatenate(points), np.concatenate(triangles))


def target_of(kind: str, true: Surface, seed: int) -> Surface:
    """A remeshed head of one of KINDS; its vertices do not correspond to the template's."""
    skin = any_heads.remeshed(true, KINDS[kind], seed)
    if kind == "scan":
        return noisy(skin, np.random.default_rng(seed))
    return dressed(skin, true.points) if kind == "dressed" else skin


class Identities:
    """The skins of ICT FaceKit; all have the same vertices and the same expressions."""

    def __init__(self, path: Path) -> None:
        with np.load(path) as data:
            faces = [[int(v) for v in face if v >= 0] for face in data["faces"]]
            faces = [face for face in faces if max(face) < ICT_SKIN]
            neutral = data["neutral"][:ICT_SKIN].astype(np.float64)
            self.ways = data["identity_delta"][:, :ICT_SKIN].astype(np.float64)
            begin, names = data["expression_begin"], data["expression_names"].tolist()
            shapes = {}
            for k, name in enumerate(names):
                at = slice(begin[k], begin[k + 1])
                way = np.zeros((len(data["neutral"]), 3), np.float32)
                way[data["expression_vertex"][at]] = data["expression_delta"][at]
                if np.abs(way[:ICT_SKIN]).max() > 1e-3:
                    shapes[str(name)] = way[:ICT_SKIN]
        self.face = TemplateFace(
            "ICT", Surface.of_polygons(neutral, faces), 0, tuple(shapes),
            {(name,): way for name, way in shapes.items()}, self._jaw(neutral, shapes),
        )  # fmt: skip

    @staticmethod
    def _jaw(points: np.ndarray, shapes: dict) -> Jaw | None:
        whole = {name: way.astype(np.float64) for name, way in shapes.items()}
        turn = jaw_turn(points, whole, {n: [n] for n in whole}, whole["jawOpen"], [])
        return Jaw(turn.position, {(n,): m for n, m in turn.motions.items()}) if turn else None

    def other(self, seed: int) -> TemplateFace:
        """A random identity with the template's expressions."""
        share = np.random.default_rng(seed).uniform(-1, 1, len(self.ways))
        points = self.face.surface.points + np.tensordot(share, self.ways, 1)
        surface = Surface(points, self.face.surface.triangles)
        return TemplateFace("ICT", surface, 0, self.face.controls, self.face.ways, self.face.jaw)


def places(source: Source, laid: Laid, true: np.ndarray) -> list[float]:
    """The values of the table columns surface, along and corner: errors of a registration in mm."""
    on = laid.registered.trusted
    along = MM * any_heads.errors(source.face.surface, laid.points, true)
    corner = MM * np.linalg.norm(laid.points - true, axis=1)[source.corners].max()
    return [MM * laid.registered.distance[on].mean(), along[on].mean(), corner]


def expressions(source: Source, true: TemplateFace, target: Surface, laid: Laid) -> list[float]:
    """The table columns rows, worst mean, worst 95 %: errors of the expressions before repair."""
    options = TransferOptions()
    carried = transfer(source.face, target, laid.points, laid.trust, options, None, laid.jaw)
    on, ways = truth.truth_on(true, target)
    rows = np.array(list(truth.errors(whole_ways(carried.ways), ways, on).values()))
    kept = (rows[:, 0] <= truth.MEAN) & (rows[:, 1] <= truth.MOST)
    return [100 * kept.mean(), rows[:, 0].max(), rows[:, 1].max()]


def contacts(template, source: Source, target: Surface) -> list[float]:
    """The values of the table columns gap, cut and lips in mm.

    They are measured on the expressions that `risorius author --onto` makes, which are repaired.
    """
    faces = target.triangles.tolist()
    mesh = ObjMesh(target.points, np.zeros((0, 2)), faces, [[] for _ in faces])
    part = HeadPart("head", mesh, source="head")
    head = stand("head", [part], "cm", Wishes(), None)
    faults = contact.repaired(head, template, source.face).report.worst()
    return [faults.lid_gap, faults.cut, faults.lip_gap]


def told(name: str, values: list[float], seconds: float) -> bool:
    """Print the row of a head. Returns whether its values in all columns are within LIMITS."""
    missed, cells = [], []
    for column, value, limit in zip(COLUMNS, values, LIMITS, strict=False):
        share = column == "rows"
        cells.append(f"{value:.1f}" if share else f"{value:.3f}")
        if not (value >= limit if share else value <= limit):
            missed.append(column)
    cells = " | ".join(cells)
    print(f"| {name} | {cells} | {', '.join(missed) or 'none'} | {seconds:.0f} |", flush=True)
    return not missed


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--heads", type=int, default=20)
    parser.add_argument("--first", type=int, default=400, help="seed of the first head")
    parser.add_argument("--kind", choices=tuple(KINDS), help="of all heads")
    parser.add_argument("--ict", type=Path, default=ICT, help="file of ICT FaceKit")
    parser.add_argument("--only", choices=("registration",))
    args = parser.parse_args()
    people = any_heads.generator()
    man = source_of(read_template(assemble(people, lambda _: None, MAN)[0]))
    template = risorius.load(default_template())
    default = Source(read_template(template), [])
    identities = Identities(args.ict) if args.ict.exists() else None
    own = source_of(identities.face) if identities else None
    print(f"| head | {' | '.join(COLUMNS)} | misses | CPU s |\n|{'---|' * (len(COLUMNS) + 3)}")
    reached = ran = 0
    for number in range(args.heads):
        seed, kind = (
            args.first + number,
            args.kind or list(KINDS)[(args.first + number) % len(KINDS)],
        )
        of_ict = seed % ICT_EACH == ICT_EACH - 1
        if of_ict and identities is None:
            print(f"| {seed} ICT | NOT RUN: {args.ict} |")
            continue
        source, ran, begin = own if of_ict else man, ran + 1, time.process_time()
        name = f"{seed} {'ICT ' if of_ict else ''}{kind}"
        try:
            true = (
                identities.other(seed)
                if of_ict
                else truth.skin_of(any_heads.random_person(seed, people), people)
            )
            target = target_of(kind, true.surface, seed)
            begin = time.process_time()
            laid = lay(source.face, target, find_form(target, UPRIGHT))
            values = places(source, laid, true.surface.points)
            if args.only is None:
                values += expressions(source, true, target, laid)
                values += contacts(template, default, target)
        except RisoriusError as error:
            print(f"| {name} | {error} |", flush=True)
            continue
        reached += told(name, values, time.process_time() - begin)
    print(f"{reached} of {ran} heads reach all targets", flush=True)


if __name__ == "__main__":
    main()
