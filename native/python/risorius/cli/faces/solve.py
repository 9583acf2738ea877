# SPDX-License-Identifier: MIT
"""risorius solve: finds the control curves that reproduce the motion of a mesh."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import numpy as np

import risorius

from ...author.work import require_sizes
from ...solving.performance import Performance, fitted, read_performance
from ..files import (
    CommandLineError,
    InputError,
    number,
    require_suffix,
    require_writable,
    whole_number,
)


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    parser = subparsers.add_parser(
        "solve",
        help="the control curves of a mesh that moves",
        description="Finds the controls of a face that repeat a performance: the vertices of its "
        "own topology frame by frame, as another program baked or captured them. Curves stay in "
        "their limits; of several ways the one with less of each control is taken.",
    )
    parser.add_argument("face", type=Path, metavar="FACE.dna")
    parser.add_argument(
        "performance", type=Path, metavar="PERFORMANCE",
        help="Alembic (.abc, needs risorius[alembic]), or an .npz with vertices [frames, V, 3] and "
        "perhaps rate and neutral [V, 3]",
    )  # fmt: skip
    parser.add_argument("-o", "--out", type=Path, required=True, metavar="OUT.rzc", help="the clip")
    parser.add_argument(
        "--mesh", metavar="NAME", help="of the face (default: its first one with as many vertices)"
    )
    parser.add_argument(
        "--object", metavar="NAME", help="the mesh in an Alembic file (default: as many vertices)"
    )
    parser.add_argument(
        "--rate", type=number(0.01, 1e6), metavar="FPS", help="(default: as the file says, 30)"
    )
    parser.add_argument(
        "--relative", action="store_true",
        help="take the movement and not the shape: for another face of the same topology, whose "
        "first frame (or neutral of the .npz) is at rest",
    )  # fmt: skip
    parser.add_argument(
        "--sparse", type=number(0.0, 1e9), default=1.0, metavar="X", help="price of a control"
    )
    parser.add_argument(
        "--smooth", type=number(0.0, 1e9), default=1.0, metavar="X", help="price of a jerk"
    )
    parser.add_argument(
        "--lod",
        type=whole_number(0, 65_535),
        default=0,
        metavar="N",
        help="0 is the finest (default)",
    )
    parser.add_argument("--report", action="store_true", help="what is left, frame by frame, in mm")
    parser.add_argument("--json", action="store_true", help="report as JSON")
    parser.set_defaults(func=run)


def run(args: argparse.Namespace) -> int:
    require_suffix(args.out, (".rzc",), "-o")
    require_writable(args.out)
    dna = risorius.load(args.face)
    try:
        require_sizes(dna)
    except risorius.RisoriusError as error:
        raise InputError(f"{args.face}: {error}") from None
    rig = risorius.Rig(dna)
    if not 0 <= args.lod < max(1, rig.lod_count):
        last = max(1, rig.lod_count) - 1
        raise CommandLineError(f"--lod: 0 to {last} was expected, found {args.lod}")
    surface = risorius.Surface(dna, rig, args.lod)
    if not surface.mesh_indices:
        raise InputError(f"{args.face}: a face with meshes at LOD {args.lod} was expected")
    take = read_performance(args.performance, args.object, _counts(dna, surface, args))
    mesh = _mesh(dna, surface, args, take)
    take = fitted(take, dna.meshes[mesh].positions)
    neutral = None
    if args.relative:
        neutral = {mesh: take.frames[0] if take.neutral is None else take.neutral}
    shown = sys.stderr.isatty()

    def progress(share: float) -> None:
        print(f"\rsolving {share:4.0%}", end="\n" if share >= 1.0 else "", file=sys.stderr)

    solved = risorius.solve_clip(
        surface, {mesh: take.frames}, rate=args.rate or take.rate, start=take.start,
        neutral=neutral, sparse=args.sparse, smooth=args.smooth,
        progress=progress if shown else None,
    )  # fmt: skip
    clip = solved.clip.replaced(metadata={"source": args.performance.name})
    clip.save(args.out)
    _tell(args, take, clip, solved, surface.mm)
    return 0


def _counts(
    dna: risorius.Dna, surface: risorius.Surface, args: argparse.Namespace
) -> dict[int, int]:
    """Mesh index -> vertex count, for the mesh that --mesh names; without --mesh, for all meshes of
    `surface`.

    Raises:
        CommandLineError: the face lacks this mesh.
    """
    if args.mesh is None:
        return {m: surface.vertex_counts[m] for m in surface.mesh_indices}
    names = list(dna.mesh_names)[: len(surface.vertex_counts)]
    if args.mesh not in names:
        raise CommandLineError(f"--mesh: one of {', '.join(names)} was expected, found {args.mesh}")
    mesh = names.index(args.mesh)
    return {mesh: surface.vertex_counts[mesh]}


def _mesh(
    dna: risorius.Dna, surface: risorius.Surface, args: argparse.Namespace, take: Performance
) -> int:
    """Index of the mesh with the take's number of vertices. Raises: InputError: none has it."""
    counts = _counts(dna, surface, args)
    found = take.frames.shape[1]
    for mesh, count in counts.items():
        if count == found:
            return mesh
    there = ", ".join(f"{dna.mesh_names[m]} {n}" for m, n in counts.items())
    raise InputError(f"{args.performance}: vertices of {there} were expected, found {found}")


def _tell(
    args: argparse.Namespace,
    take: Performance,
    clip: risorius.Clip,
    solved: risorius.SolvedClip,
    mm: float,
) -> None:
    frames = solved.frame_residual * mm
    facts = {
        "frames": clip.frame_count,
        "rate": clip.rate,
        "controls": len(clip.names),
        "residual_mm": round(float(np.sqrt((frames.astype(np.float64) ** 2).mean())), 4),
        "largest_mm": round(solved.largest * mm, 4),
        "noise_mm": round(solved.noise * mm, 4),
        "placed": take.note,
    }
    if args.json:
        rows = {"frame_residual_mm": [round(float(v), 4) for v in frames]} if args.report else {}
        print(json.dumps({**facts, **rows}, indent=1))
        return
    print(
        f"{args.out}: {facts['frames']} frames at {clip.rate:g} fps, {facts['controls']} controls; "
        f"left over {facts['residual_mm']:.3f} mm, at most {facts['largest_mm']:.3f} mm"
    )
    if take.note:
        print(f"placed: {take.note}")
    if args.report:
        times = clip.frame_times()
        worst = np.argsort(-frames, kind="stable")[:10]
        print(f"noise of the mesh: {facts['noise_mm']:.3f} mm\nthe frames with most left over:")
        for f in sorted(worst.tolist()):
            print(f"  {times[f]:8.3f} s  {frames[f]:.3f} mm")
