# SPDX-License-Identifier: MIT
"""risorius author: makes a joint rig from a mesh and its expressions."""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from ... import Dna
from ...anim.reactions import load_exclusives
from ...anyhead.tables import copy_maps
from ...author.correctives import (
    CorrectiveOptions,
    Found,
    add_correctives,
    correct_again,
    find_correctives,
)
from ...author.fitting import bounded
from ...author.heads.textures import metadata_of, texture_folder, textures_of
from ...author.input import said as sayings
from ...author.input.library import about_library, library_files, library_folder
from ...author.input.matching import Assignment
from ...author.input.spec import Read, Spec, read_face, read_spec
from ...author.joint_rig import JointRig, lighten, make_joint_rig
from ...author.work import TOLERANCE, RigOptions
from ...base.words import counted
from ...controls.vocabulary import vocabulary
from ...files import fileio
from ..files import CommandLineError, number, require_suffix, whole_number
from ..pages.authoring import need_plot, report_page
from . import conform
from .onto import add_arguments, check_arguments, read_onto, spec_of

_DESCRIPTION = """\
Finds joints, skin weights and joint motions that repeat the expressions of a face, and writes them
as a DNA file; what joints leave beyond a tolerance stays as blend shapes. HEAD is a glTF or FBX
file, a folder of OBJ files, or a SPEC.toml that says where the face is (one of these, or a DNA file
whose expressions are blend shapes) and what the rig is to be: see docs/authoring.md. With --onto
the head needs no expressions, and HEAD is a DNA file that has them; with --conform HEAD is a DNA
file that takes another head's form: see docs/anyhead.md."""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    parser = subparsers.add_parser(
        "author", help="make a joint rig from expressions", description=_DESCRIPTION
    )
    parser.add_argument("spec", type=Path, nargs="?", metavar="HEAD")
    parser.add_argument("-o", "--out", type=Path, metavar="OUT.dna", help="the DNA file to write")
    parser.add_argument(
        "--names",
        nargs="?",
        const="",
        metavar="NAMES.toml",
        help="print which control each expression is, and end; with a file, take its table "
        "[controls] over that of the spec, and print it where there is no -o",
    )
    parser.add_argument(
        "--joints-only", action="store_true", help="no blend shapes, whatever the spec says"
    )
    parser.add_argument(
        "--exact",
        action="store_true",
        help="blend shapes for all that joints leave, also where these are heavier than the input",
    )
    parser.add_argument(
        "--tolerance",
        type=_tolerance,
        metavar="N[mm|%]",
        help="blend shapes keep what joints leave beyond it: in mm, or in %% of the head's height "
        f"({100 * TOLERANCE:.2g}%% without it)",
    )
    parser.add_argument(
        "--bound",
        action="store_true",
        help="fight the largest error for several times as long",
    )
    size = parser.add_mutually_exclusive_group()
    size.add_argument(
        "--height-mm",
        type=number(1.0, 1e6),
        metavar="MM",
        help="height from the chin to the top of the head; else the unit is guessed",
    )
    size.add_argument(
        "--scale",
        type=number(1e-6, 1e6),
        metavar="FACTOR",
        help="what the head's numbers are multiplied with",
    )
    parser.add_argument(
        "--correctives",
        type=whole_number(0, 65_535),
        metavar="N",
        help="find N at most for what goes wrong where expressions meet",
    )
    parser.add_argument(
        "--report", type=Path, metavar="PAGE.html", help="a page with pictures of errors and levels"
    )
    parser.add_argument(
        "--threads",
        type=whole_number(0, 1024),
        default=0,
        metavar="N",
        help="0: one for each core",
    )
    parser.add_argument("--json", action="store_true", help="the errors for a program")
    add_arguments(parser)
    conform.add_arguments(parser)
    parser.set_defaults(func=run)


def run(args: argparse.Namespace) -> int:
    say = _Clock(quiet=args.json)
    if args.conform is not None:
        return conform.run(args, say)
    spec = _spec(args)
    _size(spec, args)
    options, asked = _options(spec, args), _correctives(spec, args)
    read, beside = _read(spec, args, say)
    became = read.became
    is_table = args.names == "" or args.out is None
    for sentence in read.odd:  # comments, because the printed table can be saved and read as a file
        mark, into = "# " * is_table, sys.stderr if args.json else sys.stdout
        print(f"{mark}note: {sentence}", file=into, flush=True)
    if is_table:
        print("\n".join(as_names(became)))
        return 0
    fileio.check_writable(args.out)
    library = library_files(became, library_folder(args.out))
    textures = textures_of(read.materials, texture_folder(args.out))
    for path in (*library, *textures.files):
        fileio.check_writable(path, parents=True)
    if args.report is not None:
        require_suffix(args.report, (".html",), "--report")
        fileio.check_writable(args.report)
        if args.report.resolve() == args.out.resolve():
            raise CommandLineError("author: --report: another file than that of -o was expected")
        need_plot()
    options = replace(options, kept=(*options.kept, *read.kept))
    dna, rig = _rig(read, options, asked, say)
    rig.dna.metadata = dict(rig.dna.metadata) | metadata_of(
        rig.dna.mesh_names, read.materials, textures
    )
    files = {args.out: rig.dna.to_bytes()}
    files |= library | textures.files | beside
    if args.json:
        said = [json.dumps(as_json(rig))]
        print("\n".join(textures.notes), end="\n" if textures.notes else "", file=sys.stderr)
    else:
        about = about_library(became, library_folder(args.out))
        trade = as_trade(rig, args.out, len(files[args.out]))
        said = [*as_lines(rig), *about, *textures.notes, trade]
    if args.report is not None:
        files[args.report] = report_page(dna, rig, files[args.out], args.out.name)
    fileio.write_all(files)  # all files together, so that no face is written if the page fails
    print("\n".join(said))
    return 0


def _rig(
    read: Read, options: RigOptions, asked: CorrectiveOptions, say: _Clock
) -> tuple[Dna, JointRig]:
    """The face of blend shapes with the correctives that were found, and its finished joint rig."""
    source = dna = read.dna
    if asked.most or asked.together:
        say.line("searching for faults of combined expressions")
        found = find_correctives(dna, asked, say)
        dna = add_correctives(dna, found.skin, [(x.controls, x.shape) for x in found.correctives])
        say.line("\n".join(as_found(found)))
    rig = make_joint_rig(dna, options, say)
    if dna is not source and options.shapes and asked.once_more:
        say.line("searching again for faults, in the face of joints and shapes")
        rig.dna = correct_again(rig.dna, source, asked, say)
    if options.lighter:
        # Allows as many deltas as `source` has, which lacks the correctives that were found.
        lighten(rig, source)
    if read.template is not None:
        copy_maps(read.template, rig.dna)
    return dna, rig


def _read(spec: Spec, args: argparse.Namespace, say: _Clock) -> tuple[Read, dict[Path, bytes]]:
    """The blend shape face to convert to joints, and additional files to write: path -> bytes."""
    return (read_face(spec), {}) if args.onto is None else read_onto(args, say)


def _spec(args: argparse.Namespace) -> Spec:
    check_arguments(args)
    if args.onto is not None:
        return spec_of(args)
    if args.spec is None and args.names:  # author --names SPEC.toml
        args.spec, args.names = Path(args.names), ""
    if args.spec is None:
        raise CommandLineError("author: SPEC.toml was expected")
    if args.out is None and args.names is None:
        raise CommandLineError("author: -o OUT.dna was expected")
    spec = read_spec(args.spec)
    if args.names:
        spec.controls |= sayings.read(args.names)
    return spec


def as_names(became: Assignment) -> list[str]:
    """Lines of the TOML table [controls]: a row for each expression, with its assigned controls.

    The last line is a comment with the number of expression names that the program recognised.
    """
    lines = [f"[{sayings.TABLE}]"]
    for name, raw in became.controls.items():
        expression = became.expressions.get(name)
        value = f"@{expression}" if expression else raw[0] if len(raw) == 1 else raw
        lines.append(sayings.row(name, value))
    known = sum(became.known.values())
    by = ", ".join(
        f"{count} of {vocabulary(name).title}" if name else f"{count} by words or [controls]"
        for name, count in became.known.items()
    )
    return [*lines, f"# {known} of {len(became.controls)} names are known{': ' + by if by else ''}"]


def _options(spec: Spec, args: argparse.Namespace) -> RigOptions:
    fit = replace(spec.options.fit, threads=args.threads)
    options = replace(spec.options, fit=bounded(fit) if args.bound else fit)
    if args.joints_only:
        return replace(options, shapes=False)
    if args.exact:
        return replace(options, tolerance_mm=0.0, lighter=False)
    if args.tolerance is not None:
        value, unit = args.tolerance
        if unit == "%":
            return replace(options, tolerance_mm=None, tolerance=value / 100)
        return replace(options, tolerance_mm=value)
    return options


def _size(spec: Spec, args: argparse.Namespace) -> None:
    """Replace the head size of the spec by --height-mm or --scale, if one is given; with --onto the
    spec stays unchanged."""
    said = {"height_mm": args.height_mm, "scale": args.scale}
    said = {name: value for name, value in said.items() if value is not None}
    if args.onto is not None:
        return
    if said and "dna" in spec.source:
        raise CommandLineError(
            f"author: {next(iter(said))} is not possible with a DNA file, which has a fixed size"
        )
    if said:
        spec.source = {k: v for k, v in spec.source.items() if k not in ("height_mm", "scale")}
        spec.source |= said


def _correctives(spec: Spec, args: argparse.Namespace) -> CorrectiveOptions:
    out = replace(spec.correctives, apart=opposites())
    if args.correctives is None:
        return out
    return replace(out, most=args.correctives)


def _tolerance(text: str) -> tuple[float, str]:
    """(number, unit "mm" or "%") of an argument. Raises: ArgumentTypeError: not in this form."""
    unit = "%" if text.endswith("%") else "mm"
    return number(0.0, 100.0 if unit == "%" else 1e6)(text.removesuffix(unit).strip()), unit


class _Clock:
    """Prints the name of each step, and its progress whenever another 10 % are done."""

    def __init__(self, *, quiet: bool) -> None:
        self._quiet, self._begin, self._last = quiet, time.monotonic(), -1.0

    def line(self, text: str) -> None:
        """Print the name of the next step, whose progress begins at 0."""
        self._last = -1.0
        if not self._quiet:
            print(text, flush=True)

    def __call__(self, share: float) -> None:
        if not self._quiet and (share - self._last >= 0.1 or share >= 1):
            self._last = share
            print(f"[{time.monotonic() - self._begin:5.1f} s] {share:4.0%}", flush=True)


def opposites() -> tuple[tuple[str, str], ...]:
    """Pairs of opposite controls, without prefix; no corrective is made for such a pair."""
    pairs = load_exclusives().opposites
    return tuple((a.rpartition(".")[2], b.rpartition(".")[2]) for a, b in pairs)


def as_found(found: Found) -> list[str]:
    """Lines of text: the volume in which surfaces penetrate each other, and the numbers of faces
    that are stretched ("torn") or folded, summed over all pairs of expressions; each number first
    without and then with the correctives.
    """
    a, b = found.before, found.after
    return [
        f"{found.looked_at:,} pairs of expressions, {found.faulty:,} of them wrong; "
        f"{counted(len(found.correctives), 'corrective')}",
        f"over all pairs: {a['volume']:,.0f} mm3 inside of something, then {b['volume']:,.0f}; "
        f"{a['stretched']:,.0f} faces torn, then {b['stretched']:,.0f}; "
        f"{a['folded']:,.0f} folded, then {b['folded']:,.0f}",
    ]


def as_json(rig: JointRig) -> dict[str, object]:
    """The errors of each LOD, mesh and expression as JSON values."""
    return {
        "joints": rig.new_joints,
        "height_mm": rig.height_mm,
        "lods": [
            {
                "joints": level.joints,
                "vertices": level.vertices,
                "deltas": level.deltas,
                "rms_mm": level.rms,
                "largest_mm": level.largest,
                "largest_with_shapes_mm": level.largest_with_shapes,
            }
            for level in rig.levels
        ],
        "combinations": [
            {
                "name": c.name,
                "without_mm": c.before,
                "joints_largest_mm": c.joints_largest,
                "largest_mm": c.largest,
            }
            for c in rig.combinations
        ],
        "deltas": {"before": rig.deltas_before, "after": rig.deltas_after},
        "tolerance": {"mm": rig.tolerance_mm, "raised": rig.raised},
        "meshes": [
            {
                "name": m.name,
                "lod": m.lod,
                "expressions": [
                    {
                        "name": name,
                        "motion_rms_mm": m.motion[e],
                        "joints_rms_mm": m.joints_rms[e],
                        "joints_largest_mm": m.joints_largest[e],
                        "largest_mm": m.largest[e],
                        "between_largest_mm": m.between_largest[e],
                        "worst_vertex": int(m.worst_vertex[e]),
                    }
                    for e, name in enumerate(m.expressions)
                ],
            }
            for m in rig.errors
        ],
    }


def as_lines(rig: JointRig) -> list[str]:
    """Lines of text with the errors of each LOD, of each mesh at LOD 0, and of the combinations.

    Args:
        rig: the finished rig.
    """
    levels = (
        f"{'LOD':>3} {'joints':>7} {'vertices':>9} {'deltas':>9} {'RMS mm':>8} {'largest mm':>11}"
    )
    out = [levels]
    for lod, x in enumerate(rig.levels):
        out.append(
            f"{lod:3} {x.joints:7,} {x.vertices:9,} {x.deltas:9,} {x.rms:8.4f} {x.largest:11.3f}"
        )
    if rig.ended:
        out.append(f"note: {rig.ended}")
    title = f"{'mesh':26} {'RMS mm':>8} {'% height':>9} {'largest mm':>11}  expression"
    out.append(title)
    for m in rig.errors:
        if m.lod > 0:
            continue
        rms = float(np.sqrt((m.joints_rms**2).mean()))
        worst = int(m.joints_largest.argmax())
        out.append(
            f"{m.name:26} {rms:8.4f} {100 * rms / rig.height_mm:9.4f} "
            f"{m.joints_largest[worst]:11.3f}  {m.expressions[worst]}"
        )
    if rig.combinations:
        off = max(rig.combinations, key=lambda c: c.joints_largest)
        out.append(
            f"{counted(len(rig.combinations), 'combination')}: by joints at most "
            f"{off.joints_largest:.3f} mm ({off.name}), without them "
            f"{max(c.before for c in rig.combinations):.3f}"
        )
    if rig.raised:
        out.append(
            f"note: blend shapes keep what joints leave beyond {rig.tolerance_mm:.3f} mm: more "
            f"than the tolerance, so that there are no more deltas than the {rig.deltas_before:,} "
            "of the input; more joints leave less"
        )
    return out


def as_trade(rig: JointRig, path: Path, size: int) -> str:
    """A line of text: numbers of joints, deltas and bytes of the rig, and its errors at LOD 0.

    Args:
        rig: the finished rig.
        path: path of the written file.
        size: size of the file in bytes.
    """
    level = rig.levels[0]
    return (
        f"{path}: {counted(len(rig.new_joints), 'new joint')}, deltas {rig.deltas_before:,} -> "
        f"{rig.deltas_after:,}, {size:,} bytes, largest error {level.largest_with_shapes:.3f} mm "
        f"(by joints alone {level.largest:.3f}), RMS by joints alone "
        f"{100 * level.rms / rig.height_mm:.4f} % of {rig.height_mm:.0f} mm"
    )
