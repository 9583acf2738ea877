# SPDX-License-Identifier: MIT
"""Measures frames per second and core of `risorius batch`, relative to single evaluations.

    python tests/bench/batch_throughput.py CHARACTER.dna [--clips 80] [--frames 3600] [--lod 0]

In the generated clips a third of the controls move as sines of different speeds, at 60 frames per
second. Rows of a bake evaluate one clip in this process. Rows of a batch evaluate all clips, or a
tenth of them if files are written, and include the start of processes and the reading of clips. CPU
time is summed over all processes, so frames per CPU second are the speed of one core. On a busy
machine compare CPU times and not wall times.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
import risorius
from risorius.baking.bake import bake
from risorius.baking.face import Face, load_face, played
from risorius.batch.jobs import read_jobs
from risorius.batch.pool import default_workers
from risorius.batch.running import run

PARTS = ("joints", "shapes", "maps")


def about() -> str:
    """Line of text above the table: CPU, version of Python, and commit."""
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


class Clock:
    """Measures wall and CPU seconds of this process and its finished child processes."""

    def __enter__(self) -> Clock:
        self._wall, self._cpu = time.perf_counter(), self._spent()
        return self

    def __exit__(self, *error: object) -> None:
        self.wall = time.perf_counter() - self._wall
        self.cpu = self._spent() - self._cpu

    def _spent(self) -> float:
        return time.process_time() + sum(os.times()[2:4])


class Table:
    """Prints rows of frames per second, each with its ratio to the first row."""

    def __init__(self) -> None:
        self._alone = 0.0
        print(f"{'frames per second':<42}{'of CPU time':>13}{'of single':>11}{'of wall time':>14}")

    def row(self, what: str, frames: int, clock: Clock, note: str = "") -> None:
        speed = frames / max(clock.cpu, 1e-9)
        self._alone = self._alone or speed
        ratio, wall = speed / self._alone, frames / clock.wall
        print(f"{what:<42}{speed:>13,.0f}{ratio:>11.2f}{wall:>14,.0f}  {note}", flush=True)


def single(clip: risorius.Clip, face: Face, lod: int) -> Clock:
    """Total time to evaluate the clip with one call of Rig.evaluate for each frame."""
    raw, _ = clip.raw_controls(face.rig.raw_control_names)
    with Clock() as clock:
        for frame in raw:
            face.rig.evaluate(frame, lod=lod)
    return clock


def in_chunks(clip: risorius.Clip, face: Face, lod: int) -> Clock:
    """Time to evaluate the clip in chunks of frames on one core. The poses are not kept."""
    with Clock() as clock:
        for _ in played(clip, face, lod):
            pass
    return clock


def bakes(table: Table, clip: risorius.Clip, face: Face, lod: int, folder: Path) -> None:
    """Measure a bake in this process without files, and with each kind of output file."""
    for kind, compress in (("", False), ("npz", False), ("npz", True), ("csv", False)):
        path = folder / f"out.{kind}"
        with Clock() as clock:
            bake(clip, face, lod, {kind: path} if kind else {}, parts=PARTS, compress=compress)
        size = path.stat().st_size / clip.frame_count if kind else 0
        what = f"bake: {kind or 'statistics'}{' --compress' * compress}"
        table.row(what, clip.frame_count, clock, f"{size:,.0f} bytes a frame" if kind else "")


def batches(table: Table, dna: Path, lod: int, folder: Path) -> None:
    """Measure batches with one and all workers; a tenth of the clips if files are written."""
    for write, pattern in (("", "*"), ("npz", "*0")):
        for workers in sorted({1, default_workers()}):
            jobs = folder / f"jobs{write}{workers}.toml"
            jobs.write_text(
                f"output = '{jobs.stem}'\n[[jobs]]\nclips = 'clips/{pattern}.rzc'\n"
                f"characters = '{dna}'\nlods = [{lod}]\nwrite = {[write] if write else []}\n"
            )
            with Clock() as clock:
                report = run(read_jobs(jobs), workers=workers, scheduler=None, restart=True)
            if report.failed():
                raise SystemExit(report.failed()[0].error)
            what = f"batch: {write or 'statistics'}, {workers} worker{'s' * (workers > 1)}"
            table.row(what, report.frames, clock, shares(folder / jobs.stem / "summary.json"))
            shutil.rmtree(folder / jobs.stem)


def shares(summary: Path) -> str:
    """Text with the percentages of the jobs' time that reading, evaluating and the rest take.

    Args:
        summary: path of summary.json, which the batch has written.
    """
    rows = json.loads(summary.read_text())["jobs"]
    total = sum(row["job_seconds"] for row in rows)
    load = sum(row["load_seconds"] for row in rows) / total
    evaluation = sum(row["evaluation_seconds"] for row in rows) / total
    rest = 1 - load - evaluation
    return f"jobs: {load:.0%} reading, {evaluation:.0%} evaluating, {rest:.0%} facts and writing"


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("dna", type=Path)
    parser.add_argument("--clips", type=int, default=80)
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
        f"{4 * numbers:,} bytes of pose a frame; {args.clips} clips of {args.frames} frames"
    )
    table = Table()
    table.row("Rig.evaluate, frame by frame", args.frames, single(clip, face, args.lod))
    table.row("evaluate_batch in chunks", args.frames, in_chunks(clip, face, args.lod))
    with tempfile.TemporaryDirectory(dir=args.folder) as name:
        folder = Path(name)
        bakes(table, clip, face, args.lod, folder)
        (folder / "clips").mkdir()
        for i in range(args.clips):
            make_clip(names, args.frames, i).save(folder / "clips" / f"clip{i:03}.rzc")
        batches(table, dna, args.lod, folder)
    if hasattr(os, "getloadavg"):
        print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
