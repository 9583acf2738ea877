# SPDX-License-Identifier: MIT
"""risorius author --conform: conform a DNA file to a head."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Protocol

import numpy as np

from ... import Dna
from ...anyhead.conform import Conformed, conform_face
from ...anyhead.conform.axes import mm_of
from ...anyhead.conform.head import parts_of
from ...anyhead.conform.parts import skin_of
from ...anyhead.landmarks.marks import landmarks_path, read_landmarks
from ...anyhead.reading import read_head
from ...author.heads.parts import HeadPart, Wishes
from ...base.words import counted
from ...files import fileio
from ...mixing.mix import Mix
from ...mixing.regions import Masks
from ...mixing.textures import mix_textures, texture_folder
from ..files import CommandLineError, read, refuse_same_file

# Options of `risorius author` that --conform excludes. Most configure a new rig, and a conformed
# face keeps its rig.
_NOT_ITS = (
    "names", "joints_only", "exact", "tolerance", "bound", "correctives", "report", "onto",
    "strength", "no_repair", "write_landmarks", "rig",
)  # fmt: skip


class Clock(Protocol):
    """Prints the current step and its progress."""

    def line(self, text: str) -> None: ...
    def __call__(self, share: float) -> None: ...


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the option --conform.

    Args:
        parser: parser of `risorius author`.
    """
    parser.add_argument(
        "--conform",
        type=Path,
        metavar="HEAD",
        help="conform the DNA file to this head (OBJ, glTF, FBX, a folder of OBJ files, another "
        "DNA file, or a sculpt of the face): its topology, names, counts and layers stay",
    )


def run(args: argparse.Namespace, clock: Clock) -> int:
    """Run `risorius author --conform HEAD FACE.dna -o OUT.dna`: give FACE.dna the form of HEAD, and
    write OUT.dna and copies of the textures of FACE.dna. Returns the exit code 0.

    Args:
        args: arguments of `risorius author`.
        clock: prints the steps.

    Raises:
        CommandLineError: options exclude each other.
        RisoriusError: the face, the head or landmarks cannot be used.
        OSError: a file cannot be read or written.
    """
    _check(args)
    fileio.check_writable(args.out)
    refuse_same_file(str(args.spec), str(args.out))
    dna = read(str(args.spec), "dna")
    parts, unit = _head(args.conform)
    marks, known = None, args.landmarks or landmarks_path(args.conform)
    if args.landmarks is not None or known.is_file():
        clock.line(f"landmarks of {known}")
        marks = read_landmarks(known)
    wishes = Wishes(height_mm=args.height_mm or 0.0, scale=args.scale or 0.0)
    clock.line(f"{args.spec.name} is conformed to {args.conform.name}")
    made = conform_face(
        dna,
        parts,
        marks,
        clock,
        where=str(args.conform),
        unit=unit,
        wishes=wishes,
        threads=args.threads,
    )
    pictures, _ = mix_textures([dna], [args.spec], Mix([1.0]), Masks(dna))
    folder = texture_folder(args.out)
    data = made.dna.to_bytes(f"2.{min(max(dna.version, 1), 8)}")
    fileio.write_all({args.out: data} | {folder / n: own for n, own in pictures.items()})
    if args.json:
        print(json.dumps(as_json(dna, made)))
    else:
        print("\n".join([*(f"note: {note}" for note in made.notes), as_line(args.out, dna, made)]))
    return 0


def _head(path: Path) -> tuple[list[HeadPart], str]:
    """The meshes of a head, and the length unit of its file. The file may be a DNA file."""
    if path.suffix.lower() != ".dna":
        return read_head(path)
    other = read(str(path), "dna")
    return parts_of(other), other.translation_unit


def _check(args: argparse.Namespace) -> None:
    for name in _NOT_ITS:
        if getattr(args, name, None) not in (None, False):
            said = name.replace("_", "-")
            raise CommandLineError(
                f"author: --conform takes no --{said}, because the face has a rig already"
            )
    if args.spec is None:
        raise CommandLineError("author: --conform HEAD FACE.dna was expected, found no FACE.dna")
    if args.out is None:
        raise CommandLineError("author: -o OUT.dna was expected")


def _moved_mm(dna: Dna, made: Conformed) -> tuple[float, float]:
    """Mean and largest distance in mm that skin vertices moved, relative to the skin's centre."""
    before = np.asarray(dna.meshes[skin_of(dna)].positions, np.float64)
    way = made.moved - made.moved.mean(axis=0) - before + before.mean(axis=0)
    far = mm_of(dna) * np.linalg.norm(way, axis=1)
    return float(far.mean()), float(far.max())


def as_json(dna: Dna, made: Conformed) -> dict[str, object]:
    """The result as JSON.

    Args:
        dna: the source face.
        made: the conformed face.
    """
    mean, largest = _moved_mm(dna, made)
    return {
        "registered": not made.sculpted,
        "sculpted": made.sculpted,
        "moved_mean_mm": mean,
        "moved_largest_mm": largest,
        "notes": made.notes,
    }


def as_line(path: Path, dna: Dna, made: Conformed) -> str:
    """The result as a line of text.

    Args:
        path: the written file.
        dna: the source face.
        made: the conformed face.
    """
    mean, largest = _moved_mm(dna, made)
    return (
        f"{path}: {counted(len(dna.joint_names), 'joint')} and {counted(len(dna.meshes), 'mesh')} "
        f"conformed to the head; skin vertices moved by {mean:.1f} mm on average and by "
        f"{largest:.1f} mm at most"
    )
