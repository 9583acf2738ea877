# SPDX-License-Identifier: MIT
"""risorius author --onto: transfers a template's expressions to a head without expressions."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Protocol

from ... import load
from ...anyhead.borrowing import lend_materials
from ...anyhead.default import default_template
from ...anyhead.landmarks.marks import landmarks_path, landmarks_text, read_landmarks
from ...anyhead.onto import FIT_VERTICES, OntoOptions, onto, shape_face
from ...anyhead.reading import read_head
from ...anyhead.transfer.transfer import STRENGTHS
from ...author.heads.parts import Wishes
from ...author.input.spec import Read, Spec, read_options
from ...author.work import RigOptions
from ...base.reading import require_regular
from ...files import fileio
from ..files import CommandLineError, number

_HEAD_MM = 240.0
_OWN = (
    "landmarks",
    "strength",
    "no_repair",
    "write_landmarks",
    "mesh",
    "rig",
)  # options that have no effect without --onto or --conform


class Clock(Protocol):
    """Prints the current step and its progress."""

    def line(self, text: str) -> None: ...
    def __call__(self, share: float) -> None: ...


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add --onto and its options.

    Args:
        parser: parser of `risorius author`.
    """
    group = parser.add_argument_group("a head without expressions")
    group.add_argument(
        "--onto",
        type=Path,
        metavar="HEAD",
        help="put the expressions of a template onto this head (OBJ, glTF, FBX, a folder of OBJ "
        "files); the template is the DNA file that is named, else the sample person",
    )
    group.add_argument(
        "--landmarks",
        type=Path,
        metavar="FILE",
        help="where eyes, mouth and chin are; HEAD.landmarks.json beside the head without it",
    )
    group.add_argument(
        "--write-landmarks",
        type=Path,
        metavar="FILE",
        help="write where they were found, to be moved",
    )
    group.add_argument(
        "--strength",
        type=number(*STRENGTHS),
        metavar="N",
        help="what all expressions are multiplied with, 0 to 1.5",
    )
    group.add_argument(
        "--no-repair",
        action="store_true",
        default=None,
        help="leave lids, lips and teeth as they were carried over",
    )
    group.add_argument(
        "--mesh", metavar="NAME", help="the mesh that is the face, where there are several heads"
    )
    group.add_argument(
        "--rig",
        type=Path,
        metavar="SPEC.toml",
        help="what the rig is to be: the tables [joints], [shapes], [correctives], [lods]",
    )


def check_arguments(args: argparse.Namespace) -> None:
    """Refuse options that exclude each other.

    Args:
        args: arguments of `risorius author`.

    Raises:
        CommandLineError: options exclude each other; the error names one of them.
    """
    if args.onto is None:
        given = [name for name in _OWN if getattr(args, name) is not None]
        if given:
            raise CommandLineError(
                f"author: --{given[0].replace('_', '-')} is of --onto HEAD, which is missing: "
                "the option works only with it"
            )
        return
    if args.names is not None:
        raise CommandLineError(
            "author: --names is of a head with expressions and is not possible with --onto, "
            "whose head has none"
        )
    if args.out is None:
        raise CommandLineError("author: -o OUT.dna was expected")
    if args.spec is not None and args.spec.suffix.lower() not in (".dna", ".json"):
        raise CommandLineError(
            f"author: --onto HEAD TEMPLATE.dna was expected, found {args.spec.name} as template; "
            "--rig takes a SPEC.toml"
        )


def spec_of(args: argparse.Namespace) -> Spec:
    """A spec of the head, with the rig options that the file of --rig contains.

    Args:
        args: checked arguments of `risorius author`.

    Raises:
        ShapeFileError: the file of --rig cannot be used.
        OSError: the file of --rig cannot be read.
    """
    spec = Spec(args.onto, args.onto.resolve().stem, {}, RigOptions())
    if args.rig is not None:
        spec.options, spec.correctives = read_options(args.rig)
    spec.options = replace(spec.options, fit_vertices=FIT_VERTICES)
    if spec.options.tolerance_mm is None:  # a fraction of the head, not of the whole body
        spec.options = replace(spec.options, tolerance_mm=_HEAD_MM * spec.options.tolerance)
    return spec


def read_onto(args: argparse.Namespace, clock: Clock) -> tuple[Read, dict[Path, bytes]]:
    """The head with the template's expressions, and additional files to write: path -> bytes.

    Args:
        args: checked arguments of `risorius author`.
        clock: prints the steps.

    Raises:
        RisoriusError: the head, the template or landmarks cannot be used.
        OSError: a file cannot be read.
    """
    for path in (args.out, args.write_landmarks):
        if path is not None:
            fileio.check_writable(path)
    parts, unit = read_head(args.onto)
    path = _template(args.spec, clock.line)
    template = load(path)
    known = args.landmarks or landmarks_path(args.onto)
    marks = None
    if args.landmarks is not None or known.is_file():
        clock.line(f"landmarks of {known}")
        marks = read_landmarks(known)
    options = OntoOptions(
        1.0 if args.strength is None else args.strength,
        not args.no_repair,
        marks,
        Wishes(args.mesh or "", height_mm=args.height_mm or 0.0, scale=args.scale or 0.0),
        args.threads,
    )
    made = onto(str(args.onto), parts, unit, template, options, clock, clock.line)
    made.shapes.name = args.onto.resolve().stem
    files = {}
    if args.write_landmarks is not None:
        files[args.write_landmarks] = landmarks_text(made.landmarks).encode()
    lend_materials(made.shapes.parts, template, path, {part.source for part in parts})
    clock.line("making a face of blend shapes")
    read = shape_face(made, template, str(args.onto), clock)
    clock.line("making joints, skin weights and shapes")
    return replace(read, odd=made.notes + read.odd), files


def _template(path: Path | None, say: Callable[[str], None]) -> Path:
    if path is None:
        say("the template is the sample person")
        return default_template()
    require_regular(path)
    return path
