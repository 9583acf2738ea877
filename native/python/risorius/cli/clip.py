# SPDX-License-Identifier: MIT
"""risorius clip: converts, inspects and maps animation from other programs."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

import numpy as np

import risorius
from risorius import Clip, importing
from risorius.importing import process

from ..base.given import GivenError, finite_text, shown, whole_text
from ..base.words import counted
from .files import CommandLineError, number, refuse_same_file, require_writable
from .ranges import add_learn, with_ranges

OUTPUTS = (".rzc", ".csv", ".json")
TABLES = (".csv", ".json")
_MAPPING = (
    "name of a mapping (see risorius clip mappings) or a TOML file; default: the mapping that fits"
)


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    parser = subparsers.add_parser(
        "clip",
        help="animation of other software as clips of a rig's controls",
        description="Reads Live Link Face takes, tables and JSON of named curves, mouth shapes of "
        "Rhubarb, Papagayo and Moho, glTF and FBX; a mapping assigns curves to controls.",
    )
    commands = parser.add_subparsers(dest="clip_command", required=True)
    _add_convert(commands)
    _add_info(commands)
    _add_mappings(commands)
    _add_check(commands)
    add_learn(commands, _add_input, load)


def _add_convert(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    parser = commands.add_parser(
        "convert",
        help="convert an animation file to raw controls: .rzc, .csv or .json",
        description="The steps run in this order: mapping, range, neutral, gain and offset, "
        "repeats, gaps, smoothing, mirror, cut, rate, shift.",
    )
    _add_input(parser)
    parser.add_argument("-o", "--output", required=True, type=Path, metavar="OUT")
    parser.add_argument(
        "--curve-table",
        action="store_true",
        help="OUT, .csv or .json, as Unreal Engine imports curve tables: CTRL_expressions_jawOpen",
    )
    _add_meaning(parser)
    _add_steps(parser)
    parser.set_defaults(func=run_convert)


def _add_meaning(parser: argparse.ArgumentParser) -> None:
    """Add the options for the values of the input file: mapping, rig, ranges and units."""
    parser.add_argument("--mapping", metavar="M", help=_MAPPING)
    parser.add_argument(
        "--rig", type=Path, metavar="DNA", help="keep only what this rig has; its GUI table"
    )
    parser.add_argument(
        "--rotations",
        choices=importing.ROTATIONS,
        default="head",
        help="angles to keep beside the controls: of the head (default), of the eyes too, none",
    )
    parser.add_argument(
        "--range",
        metavar="FILE|self",
        help="neutral and extremes of the person, from risorius clip learn; self: from this take",
    )
    parser.add_argument(
        "--full-value",
        type=number(0.0, above=True),
        metavar="N",
        help="value of IN that is a whole movement: 100 for per cent, 255 for bytes; 1 keeps "
        "values however large (default: 1, and far larger ones are refused)",
    )
    parser.add_argument(
        "--angles",
        choices=importing.ANGLE_UNITS,
        help="of the head and the eyes in IN (default: radians, and a head that turns too far is "
        "refused)",
    )


def _add_steps(parser: argparse.ArgumentParser) -> None:
    """Add --report and the options that change the clip, in the order of their application."""
    parser.add_argument(
        "--neutral",
        metavar="A[:B]",
        help="frame or frames of the neutral face; their values become 0",
    )
    for name, what in (("gain", "factor"), ("offset", "value to add")):
        parser.add_argument(
            f"--{name}",
            action="append",
            default=[],
            metavar="PATTERN=N",
            help=f'{what} for controls, e.g. "jaw*=1.2"; may be repeated',
        )
    parser.add_argument(
        "--drop-repeats",
        action="store_true",
        help="remove frames that repeat the frame before",
    )
    parser.add_argument(
        "--fill-gaps",
        action="store_true",
        help="make the frames evenly spaced; interpolate missing ones",
    )
    parser.add_argument(
        "--smooth",
        metavar="S|KIND:S",
        help="seconds, e.g. 0.1 (keeps peaks); gaussian:0.03; one-euro:1.5 (cutoff in Hz)",
    )
    parser.add_argument("--mirror", action="store_true", help="swap left and right")
    parser.add_argument("--cut", metavar="A:B", help="keep seconds A to B")
    parser.add_argument(
        "--rate", type=number(0.01, 1e6), metavar="FPS", help="frames per second of OUT"
    )
    parser.add_argument(
        "--shift",
        type=number(-1e9, 1e9),
        default=0.0,
        metavar="S",
        help="shift the clip by S seconds",
    )
    parser.add_argument(
        "--report", action="store_true", help="print mapped and unmapped curves to stdout"
    )


def _add_input(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("input", type=Path, metavar="IN")
    parser.add_argument(
        "--kind",
        choices=tuple(importing.KINDS),
        help="format of IN (default: detected from its content)",
    )
    parser.add_argument(
        "--input-rate",
        type=number(0.01, 1e6),
        metavar="FPS",
        help="frames per second of IN, if its times are frame numbers or missing",
    )
    parser.add_argument(
        "--timecode-rate",
        type=number(0.01, 1e6),
        metavar="FPS",
        help="frames per second of timecodes that do not state it",
    )
    parser.add_argument(
        "--time-unit",
        choices=importing.TIME_UNITS,
        help="unit of the times of a table or a JSON that does not state it; rows: ignore the "
        "times, each row is a frame at --input-rate",
    )
    parser.add_argument(
        "--take",
        metavar="NAME",
        help="animation of a glTF or FBX, by name or number (default: the first)",
    )


def _add_info(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    parser = commands.add_parser("info", help="show the content of an animation file")
    _add_input(parser)
    parser.set_defaults(func=run_info)


def _add_mappings(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    parser = commands.add_parser("mappings", help="list the mappings of Risorius")
    parser.add_argument("--write", metavar="NAME", help="copy a mapping to --output for editing")
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="M.toml",
        help="default: NAME.toml; an existing file is never replaced",
    )
    parser.set_defaults(func=run_mappings)


def _add_check(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    parser = commands.add_parser("check", help="check a mapping against the controls of a rig")
    parser.add_argument("mapping", metavar="M.toml")
    parser.add_argument("--rig", type=Path, required=True, metavar="DNA")
    parser.set_defaults(func=run_check)


def load(args: argparse.Namespace) -> importing.Imported:
    """Read the input file. The curves of a .rzc file are raw controls and need no mapping."""
    if args.input.suffix.lower() == ".rzc":
        return importing.Imported(Clip.load(args.input), "clip", "controls", str(args.input))
    return importing.read(
        args.input,
        kind=args.kind,
        rate=args.input_rate,
        timecode_rate=args.timecode_rate,
        time_unit=args.time_unit,
        take=args.take,
    )


def complain(args: argparse.Namespace) -> None:
    """Check the arguments before any file is read. Raises: CommandLineError; InputError if the
    output cannot be written."""
    if args.full_value is not None and not 0.0 < args.full_value < 1e9:
        raise CommandLineError(f"--full-value: above 0 was expected, found {args.full_value:g}")
    if args.output.suffix.lower() not in OUTPUTS:
        raise CommandLineError(f"{args.output}: a name ending in {', '.join(OUTPUTS)} was expected")
    if getattr(args, "curve_table", False) and args.output.suffix.lower() not in TABLES:
        raise CommandLineError(
            f"{args.output}: a curve table, a name ending in .csv or .json, was expected"
        )
    refuse_same_file(str(args.input), str(args.output))
    require_writable(args.output)


def run_convert(args: argparse.Namespace) -> int:
    complain(args)
    steps = _steps(args)
    dna = risorius.load(args.rig, layers="behavior") if args.rig else None
    clip, report = load(args).apply(
        args.mapping,
        rig_names=dna.raw_control_names if dna else None,
        rig=risorius.Rig(dna) if dna else None,
        rotations=args.rotations,
        full_value=args.full_value,
        angles=args.angles,
    )
    clip = with_ranges(clip, args.range, report)
    for step in steps:
        clip = step(clip)
    _save(clip, args.output, as_table=args.curve_table)
    if args.report:
        print(report.text())
    else:
        lists = (("not mapped", report.unmapped), ("not in the rig", report.not_in_rig))
        left = [f"{len(names)} {heading}" for heading, names in lists if names]
        more = f" ({', '.join(left)}: see --report)" if left else ""
        print(f"{args.output}: {_summary(clip)}{more}")
    return 0


def _steps(args: argparse.Namespace) -> list[Callable[[Clip], Clip]]:
    """The steps after the mapping, in the order in which they are applied.

    Raises:
        CommandLineError: an option has an invalid value.
    """
    steps: list[Callable[[Clip], Clip]] = []
    try:
        gains, offsets = process.parse_amounts(args.gain), process.parse_amounts(args.offset)
    except ValueError as error:
        raise CommandLineError(f"--gain, --offset: {error}") from error
    if args.neutral is not None:
        first, last = _pair(args.neutral, "--neutral", whole_text)
        steps.append(lambda clip: process.calibrate(clip, int(first), int(last)))
    if gains or offsets:
        steps.append(lambda clip: process.adjust(clip, gains, offsets))
    if args.drop_repeats:
        steps.append(process.drop_repeats)
    if args.fill_gaps:
        steps.append(process.fill_gaps)
    if args.smooth is not None:
        steps.append(_smoothing(args.smooth))
    if args.mirror:
        steps.append(process.mirror)
    if args.cut is not None:
        start, end = _pair(args.cut, "--cut", finite_text)
        steps.append(lambda clip: process.cut(clip, start, end))
    if args.rate is not None:
        steps.append(lambda clip: process.resample(clip, args.rate))
    if args.shift:
        steps.append(lambda clip: process.shift(clip, args.shift))
    return steps


def _smoothing(text: str) -> Callable[[Clip], Clip]:
    kind, _, amount = text.rpartition(":")
    runs: dict[str, Callable[[Clip, float], Clip]]
    runs = {"": process.smooth, "gaussian": process.gaussian, "one-euro": process.one_euro}
    try:
        width = finite_text(amount, 0.0, above=True)
        if kind not in runs:
            raise GivenError(f"found {shown(kind)}")
    except GivenError as error:
        raise CommandLineError(
            f"--smooth: seconds, gaussian:SECONDS or one-euro:HZ was expected: {error}"
        ) from None
    return lambda clip: runs[kind](clip, width)


def _pair(text: str, option: str, number: Callable[[str, int], float]) -> tuple[float, float]:
    first, colon, last = text.partition(":")
    try:
        start = number(first, 0)
        end = number(last, 0) if colon else start
    except GivenError as error:
        raise CommandLineError(f"{option}: A:B was expected: {error}") from None
    if not start <= end:
        raise CommandLineError(f"{option}: A:B with 0 <= A <= B was expected, found {shown(text)}")
    return start, end


def _save(clip: Clip, path: Path, *, as_table: bool = False) -> None:
    """Save a clip in the format of the path's suffix.

    Args: as_table  True: a curve table of Unreal.
    """
    suffix = path.suffix.lower()
    if as_table:
        text = importing.curve_table_text(clip, is_json=suffix == ".json")
        importing.write_text(text, path)
    elif suffix == ".rzc":
        clip.save(path)
    elif suffix == ".csv":
        importing.write_text(importing.csv_text(clip), path)
    else:
        importing.write_text(importing.json_text(clip), path)


def _summary(clip: Clip) -> str:
    return (
        f"{counted(len(clip.names), 'control')}, {counted(clip.frame_count, 'frame')}, "
        f"{clip.rate:g} fps, {clip.duration:.3f} s"
    )


def run_info(args: argparse.Namespace) -> int:
    found = load(args)
    clip = found.clip
    kind = importing.KINDS.get(found.kind, "clip of Risorius")
    print(f"{args.input}: {kind}, mapping {found.mapping or 'none fits'}\n{_summary(clip)}")
    if clip.times is not None:
        print("frames have times of their own")
    for key, value in clip.metadata.items():
        print(f"{key}: {value}")
    for note in found.notes:
        print(f"note: {note}")
    if clip.events:
        print(f"{counted(len(clip.events), 'event')}, the first: {clip.events[0].name}")
    width = max((len(name) for name in clip.names), default=0)
    for name, curve in zip(clip.names, clip.curves, strict=True):
        low, high = curve.min(initial=np.inf), curve.max(initial=-np.inf)
        print(f"  {name:<{width}}  {low:>9.4f} to {high:>9.4f}")
    return 0


def run_mappings(args: argparse.Namespace) -> int:
    if args.write is None:
        for name in importing.mapping_names():
            print(f"{name:<16} {importing.load_mapping(name).description}")
        return 0
    if args.write not in importing.mapping_names():
        raise CommandLineError(
            f"--write: one of {', '.join(importing.mapping_names())} was expected, "
            f"found {args.write!r}"
        )
    target = args.output or Path(f"{args.write}.toml")
    if target.exists():
        raise CommandLineError(f"{target}: a new file was expected, but it is there already")
    importing.write_text(importing.mapping_text(args.write), target)
    print(target)
    return 0


def run_check(args: argparse.Namespace) -> int:
    mapping = importing.load_mapping(args.mapping)
    dna = risorius.load(args.rig, layers="definition")
    names = dna.gui_control_names if mapping.is_gui else dna.raw_control_names
    lacks = importing.check(mapping, names)
    for lack in lacks:
        print(lack)
    rows = counted(len(mapping.rows), "row")
    print(f"{args.mapping}: {rows}, {counted(len(lacks), 'control')} that the rig lacks")
    return 1 if lacks else 0
