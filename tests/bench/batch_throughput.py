# SPDX-License-Identifier: MIT
"""Frames per second of a batch on each core, beside those of evaluating one frame after the other.

    python tests/bench/batch_throughput.py CHARACTER.dna [--clips 16] [--frames 3600] [--lod 0]

Clips by formula: a third of the controls move, as sines of their own speeds, 60 frames a second.
Rows that run in this process take one clip; rows with workers take all, start of processes and
reading of clips included. What a row has beyond the evaluation is where its time goes.
"""

from __future__ import annotations

import argparse
import os
import platform
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import risorius
from risorius.batch.baking import bake
from risorius.batch.face import Face, load_face, played
from risorius.batch.jobs import read_jobs
from risorius.batch.pool import default_workers
from risorius.batch.running import run

PARTS = ("joints", "shapes", "maps")


def about() -> str:
    """CPU and commit, for the head of the table."""
    cpu = platform.processor()
    info = Path("/proc/cpuinfo")
    if info.is_file():
        rows = (row.partition(":") for row in info.read_text().splitlines())
        cpu = next((v.strip() for k, _, v in rows if k.strip() == "model name"), cpu)
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"],
        cwd=Path(__file__).parent, capture_output=True, text=True, check=False,
    ).stdout.strip()  # fmt: skip
    return f"{cpu}; Python {platform.python_version()}; commit {commit}"


def make_clip(names: list[str], frames: int, seed: int) -> risorius.Clip:
    rng = np.random.default_rng(seed)
    some = sorted(rng.choice(len(names), max(1, len(names) // 3), replace=False))
    speeds, phases = rng.uniform(0.3, 9.0, len(some)), rng.uniform(0.0, 6.28, len(some))
    t = np.arange(frames) / 60.0
    curves = 0.5 + 0.5 * np.sin(np.outer(speeds, t) + phases[:, None])
    return risorius.Clip([names[i] for i in some], curves, 60.0)


def single(clip: risorius.Clip, face: Face, lod: int) -> float:
    """Seconds of Rig.evaluate, frame by frame."""
    raw, _ = clip.raw_controls(face.rig.raw_control_names)
    started = time.perf_counter()
    for frame in raw:
        face.rig.evaluate(frame, lod=lod)
    return time.perf_counter() - started


def in_chunks(clip: risorius.Clip, face: Face, lod: int) -> float:
    """Seconds of evaluate_batch on one core, poses thrown away."""
    started = time.perf_counter()
    for _ in played(clip, face, lod):
        pass
    return time.perf_counter() - started


def baked(
    clip: risorius.Clip, face: Face, lod: int, folder: Path, kind: str, compress: bool
) -> tuple[float, int]:
    """Seconds and bytes of one bake; kind "" for the facts only."""
    outputs = {kind: folder / f"out.{kind}"} if kind else {}
    started = time.perf_counter()
    bake(clip, face, lod, outputs, parts=PARTS, compress=compress)
    seconds = time.perf_counter() - started
    size = sum(path.stat().st_size for path in outputs.values())
    for path in outputs.values():
        path.unlink()
    return seconds, size


def batched(folder: Path, dna: Path, lod: int, workers: int, write: str) -> float:
    """Seconds of a whole batch."""
    jobs = folder / f"jobs_{write or 'facts'}_{workers}.toml"
    jobs.write_text(
        f'output = "{jobs.stem}"\n[[jobs]]\nclips = "clips/*.rzc"\n'
        f"characters = '{dna}'\nlods = [{lod}]\nwrite = {[write] if write else []}\n"
    )
    started = time.perf_counter()
    report = run(read_jobs(jobs), workers=workers, scheduler=None, restart=True)
    seconds = time.perf_counter() - started
    if report.failed():
        raise SystemExit(report.failed()[0].error)
    for path in (folder / jobs.stem).rglob("*.npz"):
        path.unlink()
    return seconds


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("dna", type=Path)
    parser.add_argument("--clips", type=int, default=16)
    parser.add_argument("--frames", type=int, default=3600)
    parser.add_argument("--lod", type=int, default=0)
    parser.add_argument("--folder", type=Path, help="where to write, else the temporary folder")
    args = parser.parse_args()
    dna = args.dna.resolve()
    face = load_face(dna)
    names = face.rig.raw_control_names
    clip = make_clip(names, args.frames, 0)
    numbers = face.rig.joint_count * 9 + face.rig.blend_shape_count + face.rig.animated_map_count
    print(about())
    print(
        f"{dna.name}, LOD {args.lod}: {len(names)} controls, {face.rig.joint_count} joints, "
        f"{4 * numbers:,} bytes of pose a frame; clips of {args.frames} frames"
    )
    print(f"{'':<44}{'frames/s a core':>16}{'of single':>12}{'bytes a frame':>15}")
    alone = args.frames / single(clip, face, args.lod)

    def row(what: str, frames: float, seconds: float, cores: int = 1, size: int = 0) -> None:
        speed = frames / seconds / cores
        tail = f"{size / frames:>15,.0f}" if size else ""
        print(f"{what:<44}{speed:>16,.0f}{speed / alone:>12.2f}{tail}", flush=True)

    row("Rig.evaluate, frame by frame", args.frames, args.frames / alone)
    row("evaluate_batch in chunks", args.frames, in_chunks(clip, face, args.lod))
    with tempfile.TemporaryDirectory(dir=args.folder) as name:
        folder = Path(name)
        for what, kind, compress in (
            ("bake: statistics", "", False),
            ("bake: .npz", "npz", False),
            ("bake: .npz --compress", "npz", True),
            ("bake: .csv", "csv", False),
        ):
            seconds, size = baked(clip, face, args.lod, folder, kind, compress)
            row(what, args.frames, seconds, 1, size)
        (folder / "clips").mkdir()
        for i in range(args.clips):
            make_clip(names, args.frames, i).save(folder / "clips" / f"clip{i:03}.rzc")
        cores = default_workers()
        for write in ("", "npz"):
            for workers in sorted({1, cores}):
                seconds = batched(folder, dna, args.lod, workers, write)
                what = f"batch: {(write and '.' + write) or 'statistics'}, {args.clips} clips"
                what += f", {workers} worker{'s' * (workers > 1)}"
                row(what, args.clips * args.frames, seconds, workers)
    print(f"{os.cpu_count()} cores; load {os.getloadavg() if hasattr(os, 'getloadavg') else '?'}")


if __name__ == "__main__":
    sys.exit(main())
