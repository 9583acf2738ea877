# SPDX-License-Identifier: MIT
"""Measures how the fit's time and memory grow with vertices, expressions and joints.

    python tests/bench/author_growth.py [--largest] [--picture GROWTH.png]

The input is a ball of polygons, whose expressions are bumps at many places in many directions. Each
size is measured in a separate process, so that its memory can be measured; seconds are CPU time.
--largest adds a run with 24,000 vertices, 260 expressions and 800 joints.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys

import numpy as np

MIDDLE = (6000, 64, 100)
ROWS = {
    "vertices": [(1500, 64, 100), (3000, 64, 100), (6000, 64, 100), (12000, 64, 100),
                 (24000, 64, 100)],
    "expressions": [(6000, 32, 100), (6000, 64, 100), (6000, 130, 100), (6000, 260, 100)],
    "joints": [(6000, 64, 50), (6000, 64, 100), (6000, 64, 200), (6000, 64, 400), (6000, 64, 800)],
}  # fmt: skip


def ball(vertices):
    """Positions [V, 3] and edges of a sphere with radius 12 and about `vertices` vertices."""
    rings = max(4, round(np.sqrt(vertices / 2)))
    across = vertices // rings
    down, round_ = np.meshgrid(
        (np.arange(rings) + 0.5) / rings * np.pi,
        (np.arange(across) + 0.5) / across * 2 * np.pi,
        indexing="ij",
    )
    points = np.stack(
        [np.sin(down) * np.sin(round_), np.cos(down), np.sin(down) * np.cos(round_)], axis=-1
    )
    number = np.arange(rings * across).reshape(rings, across)
    edges = np.concatenate(
        [
            np.stack([number, np.roll(number, 1, axis=1)], axis=-1).reshape(-1, 2),
            np.stack([number[:-1], number[1:]], axis=-1).reshape(-1, 2),
        ]
    )
    return 12 * points.reshape(-1, 3), edges.astype(np.uint32)


def one(vertices, expressions, joints):
    """Result of one fit: "cpu", its CPU seconds; "mb", the growth of the peak memory in MB."""
    from risorius.author import FitOptions, fit_joints

    positions, edges = ball(vertices)
    random = np.random.default_rng(1)
    moved = np.zeros((expressions, len(positions), 3), np.float32)
    for row in range(expressions):
        for _ in range(3):
            middle = positions[random.integers(len(positions))]
            width = random.uniform(2.0, 5.0)
            bump = np.exp(-((positions - middle) ** 2).sum(axis=1) / width**2)
            moved[row] += bump[:, None] * random.normal(0, 0.4, 3)
    before = resource.getrusage(resource.RUSAGE_SELF)
    still = np.broadcast_to(np.eye(3, 4), (expressions, 1, 3, 4))
    fit_joints(
        positions, moved, edges,
        given=np.zeros((1, 3)), motions=still, options=FitOptions(joints=joints),
    )  # fmt: skip
    after = resource.getrusage(resource.RUSAGE_SELF)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return {"cpu": cpu, "mb": (after.ru_maxrss - before.ru_maxrss) / 1024}


def measured(size):
    done = subprocess.run(
        [sys.executable, __file__, "--one", *map(str, size)],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    return json.loads(done.stdout)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--one", type=int, nargs=3, help=argparse.SUPPRESS)
    parser.add_argument("--largest", action="store_true")
    parser.add_argument("--picture")
    args = parser.parse_args()
    if args.one:
        print(json.dumps(one(*args.one)))
        return
    found = {}
    for kind, sizes in ROWS.items():
        column = list(ROWS).index(kind)
        for size in sizes:
            if size not in found:
                found[size] = measured(size)
        xs = np.log([size[column] for size in sizes])
        slope = np.polyfit(xs, np.log([found[size]["cpu"] for size in sizes]), 1)[0]
        print(f"{kind}: CPU seconds grow with the power {slope:.2f}")
        for size in sizes:
            print(f"  {size[column]:6} {found[size]['cpu']:8.1f} s {found[size]['mb']:8.0f} MB")
    if args.largest:
        row = measured((24000, 260, 800))
        print(f"24,000 x 260 x 800: {row['cpu']:.0f} s of CPU, {row['mb']:.0f} MB")
    if args.picture:
        draw(found, args.picture)


def draw(found, path):
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 3, figsize=(10, 3.2), sharey=True, layout="constrained")
    for column, (axis, (kind, sizes)) in enumerate(zip(axes, ROWS.items(), strict=True)):
        xs = np.array([size[column] for size in sizes], float)
        ys = np.array([found[size]["cpu"] for size in sizes])
        at = sizes.index(MIDDLE)
        axis.loglog(xs, ys, "o-", color="#2b6cb0", label="measured")
        axis.loglog(xs, ys[at] * xs / xs[at], "--", color="#888888", label="in proportion")
        axis.set_xlabel(kind)
        axis.grid(visible=True, which="both", alpha=0.25)
    axes[0].set_ylabel("CPU seconds")
    axes[0].legend()
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    main()
