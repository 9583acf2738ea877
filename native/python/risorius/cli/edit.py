# SPDX-License-Identifier: MIT
"""risorius edit: changes a DNA file.

regroup rebuilds its joint groups; lighten removes joints, correctives and LODs.
"""

from __future__ import annotations

import argparse
import csv
import io
import json
import math
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import risorius

from ..base import toml
from ..base.budget import BudgetError
from ..base.errors import ArgumentError
from ..base.reading import TEXT
from ..base.words import counted
from ..lightening import LightenReport, lighten
from ..rigs import edit
from .convert import json_text, version_of, warnings_as_lines, write
from .files import (
    CommandLineError,
    InputError,
    kind_of,
    label,
    number,
    parse_lods,
    read,
    read_bytes,
    refuse_same_file,
    require_suffix,
    require_writable,
    summary,
    whole_number,
)

_DESCRIPTION = """\
Puts joints with the same controls into one dense joint group, whatever the groups of INPUT are, and
removes small coefficients of a control on joints foreign to it. Prints sizes, the largest change of
any joint with every raw control at 1 and in random combinations, and the time of an evaluation.
The suffix decides: .dna or .json; "-" is a .dna on the standard input or output. An existing OUTPUT
is replaced as a whole or, after an error, not at all."""
_CHANGES = {
    "translation_mm": ("a joint against its parent", "mm"),
    "rotation_degrees": ("a joint's rotation", "degrees"),
    "scale": ("a joint's scale", ""),
    "position_mm": ("a joint in the face", "mm"),
}
_PLOTS = (".png", ".svg")
_LIGHTEN = """\
Reduces joints, correctives and LODs of a finished face. Animation of INPUT still plays: controls
keep their names and numbers, remaining joints keep their names and motions. It removes joints that
other joints can replace, refits the skin weights over all expressions, and removes the correctives
that move vertices least. Prints sizes, the time of an evaluation and the worst expressions;
--report writes the error of every expression. See docs/authoring.md."""
_REPORTS = (".json", ".csv")
_WORST = 20  # number of printed expressions with the largest errors


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    edits = subparsers.add_parser("edit", help="change a DNA file")
    kinds = edits.add_subparsers(dest="kind", required=True)
    _add_regroup(kinds)
    _add_lighten(kinds)


def _add_regroup(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    parser = subparsers.add_parser(
        "regroup",
        help="rebuild joint groups as dense groups without outliers",
        description=_DESCRIPTION,
    )
    parser.add_argument("input", metavar="INPUT")
    parser.add_argument("output", metavar="OUTPUT")
    parser.add_argument(
        "--threshold",
        default="0",
        metavar="T",
        help="coefficients with less effect are small: T mm, T degrees, T per cent of scale; or "
        "MM,DEGREES,SCALE (default 0: no coefficient is small, the face stays exactly the same)",
    )
    parser.add_argument(
        "--foreign-share",
        type=number(0.0, 1.0),
        default=0.25,
        metavar="S",
        help="a control is foreign to a region if it moves at most this share of it (0.25)",
    )
    parser.add_argument(
        "--regions",
        metavar="FILE",
        help="JSON or TOML: a list of joint names for each region (default: found from the "
        "controls that drive each joint, as for joints missing in the file)",
    )
    parser.add_argument(
        "--combinations",
        type=whole_number(0, 1_000_000),
        default=200,
        metavar="N",
        help="number of random poses to compare (200)",
    )
    parser.add_argument(
        "--seed", type=whole_number(0), default=0, metavar="N", help="seed of the random poses"
    )
    parser.add_argument("--plot", metavar="PICTURE", help="plot before and after, .png or .svg")
    parser.add_argument(
        "--dpi", type=whole_number(40, 600), default=150, help="resolution of the plot, 40 to 600"
    )
    parser.add_argument("--json", action="store_true", help="print the report as JSON")
    parser.add_argument("--force", action="store_true", help="OUTPUT may be INPUT itself")
    parser.set_defaults(func=run)


def _add_lighten(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    parser = subparsers.add_parser(
        "lighten", help="reduce joints, correctives and LODs", description=_LIGHTEN
    )
    parser.add_argument("input", metavar="INPUT")
    parser.add_argument("-o", "--output", required=True, metavar="OUTPUT", help=".dna or .json")
    parser.add_argument("--joints", type=whole_number(1, 65_535), metavar="N", help="N in total")
    parser.add_argument(
        "--correctives", type=whole_number(0, 65_535), metavar="N", help="N in total"
    )
    parser.add_argument("--lods", metavar="LODS", help="LODs to keep, e.g. 0 or 0-2 or 0,2,4")
    parser.add_argument(
        "--keep",
        metavar="NAMES",
        default="",
        help="joints to keep in any case, separated by commas",
    )
    parser.add_argument(
        "--shapes",
        type=number(0.0, 1000.0),
        metavar="MM",
        help="blend shapes correct vertices with a larger error than this (default: no new deltas)",
    )
    parser.add_argument(
        "--report", metavar="FILE", help="write the error of each expression: .json or .csv"
    )
    parser.add_argument("--json", action="store_true", help="print the report as JSON")
    parser.add_argument("--force", action="store_true", help="OUTPUT may be INPUT itself")
    parser.set_defaults(func=run_lighten)


def parse_threshold(text: str) -> float | list[float]:
    """Parse --threshold: the largest effect of a joint matrix coefficient that counts as small.

    Three numbers hold for translation in mm, rotation in degrees and scale in per cent. One number
    holds for all three.

    Raises:
        CommandLineError: not one or three finite numbers of 0 or more.
    """
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (1, 3) or not all(math.isfinite(n) and n >= 0 for n in numbers):
        raise CommandLineError(
            f"--threshold: one number of 0 or more, or three as MM,DEGREES,SCALE, was expected, "
            f"found {text!r}"
        )
    return numbers[0] if len(numbers) == 1 else numbers


def complain(args: argparse.Namespace) -> None:
    """Check the options before the file is opened. Raises: CommandLineError; InputError if an
    output cannot be written."""
    if args.plot is not None and Path(args.plot).suffix.lower() not in _PLOTS:
        raise CommandLineError(
            f"--plot: a name ending in {' or '.join(_PLOTS)} was expected, found {args.plot!r}"
        )
    if not args.force:
        refuse_same_file(args.input, args.output, "--force replaces it")
    require_writable(args.output, args.plot)


def read_regions(name: str) -> edit.Regions:
    """Read the joint names or indices of each region from JSON or TOML.

    The file contains {"eye": ["FACIAL_L_Eye", ...], ...}, or this table as the value of a key
    "regions", or a list of regions without names: [["FACIAL_L_Eye", ...], ...].

    Raises:
        InputError: not JSON or TOML, or a different structure.
    """
    data = read_bytes(name, TEXT)
    try:
        text = data.decode()
        found = toml.parse(text) if name.lower().endswith(".toml") else json.loads(text)
    except RecursionError as error:
        raise InputError(f"{label(name)}: not JSON that can be read: nested too deeply") from error
    except ValueError as error:  # error of the decoding, of JSON or of TOML
        raise InputError(f"{label(name)}: {error}") from error
    if isinstance(found, dict) and list(found) == ["regions"]:
        found = found["regions"]
    if not isinstance(found, dict | list) or not found:
        raise InputError(f"{label(name)}: a list of joints for each region was expected")
    named = found.items() if isinstance(found, dict) else enumerate(found)
    for region, joints in named:
        if not isinstance(joints, list) or not all(
            isinstance(joint, str | int) and not isinstance(joint, bool) for joint in joints
        ):
            raise InputError(f"{label(name)}: {region}: a list of joints was expected")
    return found


def _sizes(sizes: edit.GroupSizes) -> dict[str, int]:
    return {key: int(getattr(sizes, key)) for key in ("groups", "rows", "coefficients", "nonzero")}


def facts_of(report: edit.RegroupReport, dna: risorius.Dna) -> dict[str, Any]:
    """All results of `regroup` as plain values.

    Args:
        report: report of the regrouping.
        dna: the face, for the names of its joints.
    """
    changes = {
        key: {name: getattr(getattr(report, key), name) for name in
              ("value", "joint", "expression", "lod")}
        for key in _CHANGES
    }  # fmt: skip
    return {
        "before": _sizes(report.before),
        "after": _sizes(report.after),
        "removed": report.removed,
        "regions": [[dna.joint_names[j] for j in joints] for joints in report.regions],
        "expressions": report.expressions,
        "combinations": report.combinations,
        "largest_changes": changes,
        "microseconds": {"before": report.microseconds_before, "after": report.microseconds_after},
    }


def page(facts: dict[str, Any]) -> str:
    """The results of `regroup` as text."""
    out = [f"{'':<22}{'before':>12}{'after':>12}"]
    titles = {"groups": "joint groups", "rows": "rows", "coefficients": "coefficients stored",
              "nonzero": "coefficients not 0"}  # fmt: skip
    for key, title in titles.items():
        out.append(f"{title:<22}{facts['before'][key]:>12,}{facts['after'][key]:>12,}")
    times = facts["microseconds"]
    out.append(f"{'evaluation, us':<22}{times['before']:>12.1f}{times['after']:>12.1f}")
    if facts["before"] == facts["after"] and not facts["removed"]:
        out.append("\nnothing to do: the joint groups are as dense as they get with this threshold")
    out.append(f"\ntaken out: {counted(facts['removed'], 'coefficient')}")
    out.append(
        f"largest changes at any LOD, {counted(facts['expressions'], 'expression')} and "
        f"{counted(facts['combinations'], 'combination')}:"
    )
    for key, (title, unit) in _CHANGES.items():
        change = facts["largest_changes"][key]
        amount = f"{change['value']:.6g} {unit}".rstrip()
        where = f", {change['joint']}, {change['expression']}, LOD {change['lod']}"
        out.append(f"  {title}: {amount if change['value'] else 'none'}"
                   f"{where if change['value'] else ''}")  # fmt: skip
    return "\n".join(out)


def _plot(args: argparse.Namespace, before: risorius.Dna, after: bytes) -> None:
    """Write a plot of the face before and after the change.

    Raises:
        InputError: Matplotlib is missing, or the file cannot be written.
    """
    from ..plot import before_after
    from ..plot.content.facts import gather

    name = Path(label(args.input)).name
    data = before.to_bytes(version=f"2.{min(max(before.version, 1), 8)}")
    kind = Path(args.plot).suffix.lower().removeprefix(".")
    old, new = gather(before, data, name), gather(risorius.load(after), after, name)
    write(args.plot, before_after.render(old, new, kind, args.dpi))


def _require_plot() -> None:
    try:
        import matplotlib  # noqa: F401
    except ImportError as error:
        raise InputError(
            "--plot draws with Matplotlib, which is not installed: pip install risorius[plot]"
        ) from error


def run(args: argparse.Namespace) -> int:
    threshold = parse_threshold(args.threshold)
    complain(args)
    kinds = [
        kind_of(name, "dna" if name == "-" else None, "-") for name in (args.input, args.output)
    ]
    if args.plot is not None:
        _require_plot()
    regions = None if args.regions is None else read_regions(args.regions)
    source = read(args.input, kinds[0])
    try:
        dna, report = edit.regroup(
            source,
            regions=regions,
            threshold=threshold,
            foreign_share=args.foreign_share,
            combinations=args.combinations,
            seed=args.seed,
        )
    except ValueError as error:
        where = getattr(error, "where", "regions")
        name = args.regions if args.regions and where.startswith("regions") else args.input
        raise InputError(f"{label(name)}: {error}") from error
    with warnings_as_lines(label(args.input)):
        data = dna.to_bytes(version=version_of(source, dna, False))
    write(args.output, json_text(dna, None) if kinds[1] == "json" else data)
    if args.plot is not None:
        _plot(args, source, data)
    facts = facts_of(report, dna)
    out = sys.stderr if args.output == "-" else sys.stdout
    if not args.json:
        print(f"{label(args.output, '<stdout>')}: {summary(dna)}, {counted(len(data), 'byte')}\n",
              file=out)  # fmt: skip
    print(json.dumps(facts, indent=2) if args.json else page(facts), file=out)
    return 0


def run_lighten(args: argparse.Namespace) -> int:
    if args.joints is None and args.correctives is None and args.lods is None:
        raise CommandLineError("edit lighten: --joints, --correctives or --lods was expected")
    if not args.force:
        refuse_same_file(args.input, args.output, "--force replaces it")
    if args.report is not None:
        require_suffix(Path(args.report), _REPORTS, "--report")
        if Path(args.report).resolve() == Path(args.output).resolve():
            raise CommandLineError("--report: another file than OUTPUT was expected")
    lods = None if args.lods is None else parse_lods(args.lods)
    require_writable(args.output, args.report)
    kinds = [
        kind_of(name, "dna" if name == "-" else None, "-") for name in (args.input, args.output)
    ]
    source = read(args.input, kinds[0])
    try:
        dna, report = lighten(
            source,
            joints=args.joints,
            correctives=args.correctives,
            lods=lods,
            keep=[name for name in args.keep.split(",") if name],
            shapes_mm=args.shapes,
        )
    except (ArgumentError, BudgetError) as error:
        raise InputError(f"{label(args.input)}: {error}") from error
    with warnings_as_lines(label(args.input)):
        data = dna.to_bytes(version=version_of(source, dna, False))
    write(args.output, json_text(dna, None) if kinds[1] == "json" else data)
    if args.report is not None:
        write(args.report, report_file(report, args.report))
    out = sys.stderr if args.output == "-" else sys.stdout
    if args.json:
        print(json.dumps(asdict(report), indent=2), file=out)
    else:
        print(f"{label(args.output, '<stdout>')}: {summary(dna)}\n", file=out)
        print("\n".join(lighten_lines(report)), file=out)
    return 0


def report_file(report: LightenReport, name: str) -> bytes:
    """The report of `lighten` on all expressions, as the bytes of a file.

    Args:
        report: report of `lighten`.
        name: name of the file: .csv has a row per expression, .json has all facts.
    """
    if not name.lower().endswith(".csv"):
        return (json.dumps(asdict(report), indent=2) + "\n").encode()
    text = io.StringIO()
    rows = [asdict(expression) for expression in report.expressions]
    table = csv.DictWriter(
        text, ["name", "largest_mm", "rms_mm", "lod", "corrective"], lineterminator="\n"
    )
    table.writeheader()
    table.writerows(rows)
    return text.getvalue().encode()


def lighten_lines(report: LightenReport) -> list[str]:
    """The report of `lighten` as text: sizes, and the expressions with the largest errors."""
    titles = {
        "joints": "joints", "correctives": "correctives", "levels": "levels of detail",
        "meshes": "meshes", "channels": "blend shape channels", "deltas": "deltas",
        "coefficients": "joint coefficients", "file_bytes": "bytes",
    }  # fmt: skip
    before, after = asdict(report.before), asdict(report.after)
    out = [f"{'':<22}{'before':>14}{'after':>14}"]
    out += [f"{title:<22}{before[key]:>14,}{after[key]:>14,}" for key, title in titles.items()]
    key = "microseconds"
    out.append(f"{'evaluation, us':<22}{before[key]:>14.1f}{after[key]:>14.1f}")
    out.append("")
    rows = report.expressions
    kinds = {"": "controls", "kept": "correctives that stay", "removed": "correctives taken out"}
    for kind, title in kinds.items():
        sizes = sorted(row.largest_mm for row in rows if row.corrective == kind)
        if sizes:
            out.append(
                f"{len(sizes):,} {title}: off by {sizes[-1]:.2f} mm at most, "
                f"{sizes[len(sizes) // 2]:.2f} in the median"
            )
    worst = [row for row in rows[:_WORST] if row.largest_mm >= 0.005]
    if worst:
        out.append(f"\n{'largest mm':>10} {'RMS mm':>7} {'LOD':>4}  expression")
    for row in worst:
        note = f" ({row.corrective})" if row.corrective else ""
        out.append(
            f"{row.largest_mm:10.2f} {row.rms_mm:7.3f} {row.lod:4}  {_short(row.name)}{note}"
        )
    return out


def _short(name: str) -> str:
    """A control's name without prefix; for a corrective, the names of its first four controls."""
    parts = [part.rpartition(".")[2] for part in name.split(" + ")]
    return " + ".join(parts[:4]) + (f" + {len(parts) - 4} more" if len(parts) > 4 else "")
