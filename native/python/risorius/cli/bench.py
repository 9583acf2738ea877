# SPDX-License-Identifier: MIT
"""risorius bench: evaluation speed of a face on this machine."""

from __future__ import annotations

import argparse
import io
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path
from typing import BinaryIO

import numpy as np

import risorius
from risorius.base.errors import RisoriusError
from risorius.base.npz import DAMAGED, hold_arrays
from risorius.base.reading import MESH, read_file

from .files import InputError

FRAMES = ("active_20", "active_60", "active_260")

LEGEND = """
us         microseconds for one face and one frame, median
csr        a plain sparse matrix (compressed sparse rows) times the controls: the yardstick
times csr  how many times faster than that; asked: how many were aimed at for a face of full size
active     controls that are not 0; one face: as an animation plays it, from warm caches
KB, read   bytes of the active columns, and how long the tightest loop takes to read just these
reads      what an evaluation takes beyond 1.3 us, in such reads
cold       from memory, after other work has had the caches; crowd, clip: many poses in one call
"""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    parser = subparsers.add_parser(
        "bench",
        help="measure the evaluation speed of a face",
        description="Measures the evaluator against a plain sparse matrix (CSR) in the same run: "
        "medians, one core, never the same frame twice in a row. Takes about a minute; close "
        "other programs.",
    )
    parser.add_argument("file", type=Path)
    parser.add_argument(
        "--frames",
        type=Path,
        metavar="FRAMES.npz",
        help=f"float32[frames, raw controls] as {', '.join(FRAMES)}; default: generated frames",
    )
    parser.add_argument(
        "--sweep", action="store_true", help="print the cost by problem size as CSV"
    )
    parser.add_argument(
        "--quick", action="store_true", help="seconds instead of a minute, less accurate"
    )
    parser.set_defaults(func=run)


def program() -> Path | None:
    """The path of the benchmark program rig_bench, in the scripts folder of this Python or in a
    folder of the environment variable PATH. None if it is not installed; wheels do not contain
    it."""
    places = [sysconfig.get_path("scripts"), *os.get_exec_path()]
    found = shutil.which("rig_bench", path=os.pathsep.join(places))
    return Path(found) if found else None


def export_frames(source: Path, raw_count: int, folder: Path) -> list[str]:
    """Write the frames of an .npz as files for the benchmark program.

    Args:
        source: path of the .npz.
        raw_count: number of raw controls of the face, and of columns of the frames.
        folder: folder for the files.

    Returns:
        Paths of three files with float32 numbers, one file for each array: frames with 20, 60 and
        260 active controls, in this order.

    Raises:
        InputError: not an .npz, or an array is missing, has a wrong shape or fewer than 2 frames.
    """
    try:
        return _export_frames(source, raw_count, folder)
    except (RisoriusError, OSError):
        raise
    except DAMAGED as error:  # an error of NumPy
        raise InputError(f"{source}: an .npz of arrays was expected: {error}") from error


def _export_frames(source: Path, raw_count: int, folder: Path) -> list[str]:
    opened = io.BytesIO(read_file(source, MESH))  # a pipe cannot seek
    hold_arrays(opened)
    return _write_frames(source, opened, raw_count, folder)


def _write_frames(source: Path, opened: BinaryIO, raw_count: int, folder: Path) -> list[str]:
    paths = []
    with np.load(opened) as arrays:
        for name in FRAMES:
            if name not in arrays:
                raise InputError(f"{source}: an array {name!r} was expected")
            frames = np.asarray(arrays[name], "<f4")
            if frames.ndim != 2 or frames.shape[1] != raw_count or len(frames) < 2:
                raise InputError(
                    f"{source}: {name}: [2 or more frames, {raw_count} raw controls] were "
                    f"expected, found {list(frames.shape)}"
                )
            path = folder / f"{name}.f32"
            path.write_bytes(frames.tobytes())
            paths.append(str(path))
    return paths


def run(args: argparse.Namespace) -> int:
    path = program()
    if path is None:
        raise InputError(
            "the program rig_bench, which bench runs, is neither beside this Python nor on PATH: "
            "packaging/demo.sh builds it from the sources"
        )
    dna = risorius.load(args.file, layers="definition")
    with tempfile.TemporaryDirectory() as folder:
        raw = len(dna.raw_control_names)
        frames = export_frames(args.frames, raw, Path(folder)) if args.frames else []
        command = [str(path), str(args.file), *frames]
        if args.sweep:
            command.append("--sweep")
        if sys.stderr.isatty():
            command.append("--progress")
        if args.quick:
            command += ["--benchmark_min_time=0.002", "--benchmark_repetitions=3"]
        sys.stdout.flush()
        code = subprocess.run(command, check=False).returncode
    if code == 0 and not args.sweep:
        print(LEGEND)
    return code
