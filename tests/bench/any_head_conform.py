# SPDX-License-Identifier: MIT
"""Compares the expressions of a face conformed to another head with the head's own expressions.

HEAD.npz gives the true place of each vertex on the head. The errors of each expression are measured
over the vertices that move by at least 0.1 mm: mean, 95 % quantile and largest in mm. For
comparison, the errors of displacements that are copied unchanged are printed, too.

python tests/bench/any_head_conform.py FACE.dna HEAD.npz ... [--worst N] [--remeshed KIND]

With --remeshed the skin of FACE.dna is fitted to HEAD_KIND.obj, which has other vertices.

HEAD.npz has, in centimetres and with the vertices of FACE.dna's skin, NAME/points float64[V, 3],
NAME/deltas float32[E, V, 3], where NAME is the skin's mesh, and expressions, str[E]: names of raw
controls, several with + between them.
"""

import argparse
import time
from pathlib import Path

import numpy as np
import risorius
from risorius.anyhead.conform import conform, conform_face
from risorius.anyhead.conform.parts import skin_of
from risorius.anyhead.reading import read_head
from risorius.solving.surface import Surface

_MOVING = 0.01  # cm


class Posed:
    """The skin of a face in poses."""

    def __init__(self, dna):
        self.rig = risorius.Rig(dna)
        surface = Surface(dna, self.rig, 0)
        skin = skin_of(dna)
        count = len(dna.meshes[skin].positions)
        self.probe = surface.probe(np.stack([np.full(count, skin), np.arange(count)], axis=1))
        self.names = [name.rpartition(".")[2] for name in dna.raw_control_names]
        self.rest = self.at("")

    def at(self, expression):
        """float64[V, 3]: posed skin.

        Args:
            expression: names of raw controls, joined by +.
        """
        raw = np.array(self.rig.initial_raw_controls, np.float32)
        for name in filter(None, expression.split("+")):
            raw[self.names.index(name)] = 1
        return np.asarray(self.probe.positions(raw), np.float64)

    def moved(self, expression):
        return self.at(expression) - self.rest


def errors(found, true):
    """Mean, 95 % quantile and largest error in mm of the vertices that move in `true`, or None.

    Args:
        found, true: float64[V, 3], displacements in cm.
    """
    moving = np.linalg.norm(true, axis=1) > _MOVING
    if not moving.any():
        return None
    off = 10 * np.linalg.norm(found - true, axis=1)[moving]
    return off.mean(), np.quantile(off, 0.95), off.max()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("face")
    parser.add_argument("heads", nargs="+")
    parser.add_argument("--worst", type=int, default=0)
    parser.add_argument("--remeshed")
    args = parser.parse_args()
    dna = risorius.load(args.face)
    name = dna.mesh_names[skin_of(dna)]
    source = Posed(dna)
    rows = []
    print(
        f"{'head':22} {'seconds':>7}   conformed: mean, 95 %, largest   copied: the same   ", end=""
    )
    print("over 0.3 in the mean, over 1.2 at 95 %")
    for path in args.heads:
        with np.load(path) as file:
            points, true = file[f"{name}/points"], file[f"{name}/deltas"].astype(np.float64)
            expressions = [str(e) for e in file["expressions"]]
        begin = time.perf_counter()
        if args.remeshed:
            mesh = Path(path).with_name(f"{Path(path).stem}_{args.remeshed}.obj")
            face = conform_face(dna, *read_head(mesh)[:1], where=str(mesh)).dna
        else:
            face = conform(dna, {name: points})
        took = time.perf_counter() - begin
        posed = Posed(risorius.load(face.to_bytes()))
        if not args.remeshed:
            assert np.abs(posed.rest - points).max() < 1e-4, "the skin lies elsewhere"
        own = {}
        for at, expression in enumerate(expressions):
            ours = errors(posed.moved(expression), true[at])
            copied = errors(source.moved(expression), true[at])
            if ours is not None:
                own[expression] = (*ours, *copied)
        table = np.array(list(own.values()))
        rows.append(table)
        over = (table[:, 0] > 0.3).sum(), (table[:, 1] > 1.2).sum()
        print(
            path.rsplit("/", 1)[-1].ljust(22),
            f"{took:7.1f}  ",
            _line(table),
            f"   {over[0]}, {over[1]} of {len(table)}",
            flush=True,
        )
        for expression in sorted(own, key=lambda e: -own[e][0])[: args.worst]:
            print("    ", expression[:60].ljust(60), *(f"{x:6.3f}" for x in own[expression]))
    print("all".ljust(22), " " * 9, _line(np.concatenate(rows)))


def _line(table):
    mean = table.mean(axis=0)
    return (
        " ".join(f"{x:7.3f}" for x in (mean[0], mean[1], table[:, 2].max()))
        + "   "
        + " ".join(f"{x:7.3f}" for x in (mean[3], mean[4], table[:, 5].max()))
    )


if __name__ == "__main__":
    main()
