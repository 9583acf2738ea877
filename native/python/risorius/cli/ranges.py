# SPDX-License-Identifier: MIT
"""risorius clip learn: learns a person's control ranges, and scales other clips by them."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from risorius import Clip, importing

from ..base.errors import ArgumentError
from ..base.words import counted
from ..importing import Imported, Report
from ..ranges import MOST_GAIN, Ranges, learn, load_ranges, ranges_text
from .files import CommandLineError, number, refuse_same_file, require_suffix, require_writable

_HEADINGS = ("control", "neutral", "extreme", "gain", "left as captured")


def add_learn(
    commands: argparse._SubParsersAction[argparse.ArgumentParser],
    add_input: Callable[[argparse.ArgumentParser], None],
    load: Callable[[argparse.Namespace], Imported],
) -> None:
    """Add the command `learn` to risorius clip.

    Args:
        commands: subcommands of risorius clip.
        add_input: function that adds the arguments of an animation file to a parser.
        load: function that reads the animation file.
    """
    parser = commands.add_parser(
        "learn",
        help="learn the neutral face and the extremes of a person from a capture",
        description="Finds the range of each control in a take of the person's neutral face and "
        "of all extremes, one after another. The result is a text file: check it, edit it, and "
        "pass it to clip convert and live with --range.",
    )
    add_input(parser)
    parser.add_argument("-o", "--output", required=True, type=Path, metavar="NAME.range.toml")
    parser.add_argument("--mapping", metavar="M", help="the same as in clip convert")
    parser.add_argument(
        "--performance",
        action="store_true",
        help="the take shows acting: only peaks that repeatedly stop at the same height, and "
        "blinks, count as extremes",
    )
    parser.add_argument(
        "--most-gain",
        type=number(1.0, 4.0),
        default=MOST_GAIN,
        metavar="X",
        help=f"controls that need a larger gain stay as captured, 1 to 4 (default {MOST_GAIN:g}; "
        "lids 2)",
    )
    parser.set_defaults(func=lambda args: _run(args, load))


def _run(args: argparse.Namespace, load: Callable[[argparse.Namespace], Imported]) -> int:
    require_suffix(args.output, (".toml",), "-o")
    refuse_same_file(str(args.input), str(args.output))
    if args.output.exists():
        raise CommandLineError(f"{args.output}: a new file was expected, but it is there already")
    require_writable(args.output)
    clip, _ = load(args).apply(args.mapping, rotations="none")
    found = _learn(clip, args.input, performance=args.performance, most_gain=args.most_gain)
    importing.write_text(ranges_text(found), args.output)
    _print(found)
    print(f"{args.output}: {_counted(found)}")
    return 0


def with_ranges(clip: Clip, source: str | None, report: Report) -> Clip:
    """Scale the controls of a clip so that the person's ranges become 0 to 1.

    Args:
        clip: clip of raw controls, after the mapping.
        source: None to change nothing, "self" for the ranges of the clip itself, or a file of
            ranges.
        report: report that receives a note on the scaling.

    Raises:
        AnimationFileError: the file of ranges, or the clip with "self", is unusable.
    """
    if source is None:
        return clip
    if source == "self":
        found = _learn(clip, report.source, performance=True)
    else:
        found = load_ranges(source)
    own = {name: found.controls[name] for name in clip.names if name in found.controls}
    report.notes.append(f"range {source}: {_counted(Ranges(own))}")
    with _named(report.source):
        return found.apply(clip)


def _learn(clip: Clip, path: str | Path, **options: float) -> Ranges:
    """Learn ranges from a clip, with errors that name the clip's file."""
    with _named(path):
        return learn(clip, **options)  # type: ignore[arg-type]


@contextmanager
def _named(path: str | Path) -> Iterator[None]:
    """Add the name of the file to errors about its clip."""
    try:
        yield
    except ArgumentError as error:
        raise importing.AnimationFileError(str(path), str(error)) from error


def _counted(ranges: Ranges) -> str:
    used = len(ranges.used())
    return f"{counted(used, 'control')} stretched, {len(ranges.controls) - used} left as captured"


def _print(ranges: Ranges) -> None:
    rows = [_HEADINGS, *ranges.rows()]
    width = max(len(row[0]) for row in rows)
    for control, neutral, extreme, gain, reason in rows:
        print(f"{control:<{width}}  {neutral:>7}  {extreme:>7}  {gain:>4}  {reason}".rstrip())
