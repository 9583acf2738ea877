# SPDX-License-Identifier: MIT
"""risorius convert: DNA to JSON and back, with another version, fewer layers or other axes."""

from __future__ import annotations

import argparse
import contextlib
import re
import sys
import warnings
from collections.abc import Iterator
from typing import Any

import risorius

from ..base.words import counted
from ..files import fileio
from .files import (
    KINDS,
    CommandLineError,
    InputError,
    kind_of,
    label,
    parse_lods,
    read,
    refuse_same_file,
    require_writable,
    summary,
    whole_number,
)

_NEWEST = 8
_DESCRIPTION = """\
Reads INPUT and writes OUTPUT. The suffix of each decides: .dna or .json; "-" is the standard input
or output. An existing OUTPUT is replaced as a whole or, after an error, not at all."""
# Option of the command -> argument of Dna.convert.
_SYSTEM = {
    "axes": "axes",
    "rotation_sequence": "rotation_sequence",
    "rotation_signs": "rotation_signs",
    "winding": "face_winding_order",
    "translation_unit": "translation_unit",
    "rotation_unit": "rotation_unit",
}


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    parser = subparsers.add_parser(
        "convert",
        help="convert to and from JSON, to another version or other axes",
        description=_DESCRIPTION,
    )
    parser.add_argument("input", metavar="INPUT")
    parser.add_argument("output", metavar="OUTPUT")
    parser.add_argument("--from", dest="input_kind", choices=KINDS, help="format of INPUT")
    parser.add_argument("--to", dest="output_kind", choices=KINDS, help="format of OUTPUT")
    parser.add_argument(
        "--version",
        choices=[f"2.{minor}" for minor in range(1, _NEWEST + 1)],
        help="version of OUTPUT (default: the version of INPUT)",
    )
    parser.add_argument("--layers", metavar="NAMES", help="layers to keep, e.g. behavior,geometry")
    parser.add_argument("--lods", metavar="LODS", help="LODs to keep, e.g. 0 or 0-2 or 0,3,5")
    parser.add_argument(
        "--unknown-layers",
        choices=("preserve", "ignore"),
        default="preserve",
        help="layers that Risorius or the version does not know (default: preserve)",
    )
    parser.add_argument(
        "--indent", type=whole_number(0, 8), metavar="N", help="spaces per level of JSON, 0 to 8"
    )
    parser.add_argument("--force", action="store_true", help="OUTPUT may be INPUT itself")
    _add_system(
        parser.add_argument_group("coordinates of the result (default: the coordinates of INPUT)")
    )
    parser.set_defaults(func=run)


def _add_system(group: argparse._ArgumentGroup) -> None:
    directions = ("left", "right", "up", "down", "front", "back")
    group.add_argument(
        "--axes", nargs=3, choices=directions, metavar=("X", "Y", "Z"), help="e.g. right up front"
    )
    group.add_argument("--rotation-sequence", choices=("xyz", "xzy", "yxz", "yzx", "zxy", "zyx"))
    group.add_argument(
        "--rotation-signs", nargs=3, type=int, choices=(1, -1), metavar=("X", "Y", "Z")
    )
    group.add_argument("--winding", choices=("ccw", "cw"), help="winding of the faces")
    group.add_argument("--translation-unit", choices=("cm", "m"))
    group.add_argument("--rotation-unit", choices=("degrees", "radians"))


def complain(args: argparse.Namespace) -> None:
    """Check the options before the file is opened. Raises: CommandLineError; InputError if the
    output cannot be written."""
    if args.indent is not None and args.output_kind != "json":
        raise CommandLineError("--indent is only for JSON output")
    if not args.force:
        refuse_same_file(args.input, args.output, "--force replaces it")
    require_writable(args.output)


def _say(text: str) -> None:
    print(f"risorius: {text}", file=sys.stderr)


@contextlib.contextmanager
def warnings_as_lines(name: str) -> Iterator[None]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        yield
    for text in dict.fromkeys(str(warning.message) for warning in caught):
        _say(f"warning: {name}: {text}")


def cut(dna: risorius.Dna, args: argparse.Namespace) -> risorius.Dna:
    """Reduce `dna` to the layers and LODs that the options in `args` name.

    Raises:
        DnaError: a file cannot consist of the remaining layers.
        CommandLineError: a layer or LOD does not exist.
    """
    if args.layers is not None or args.unknown_layers == "ignore":
        names = [name.strip() for name in (args.layers or "all").split(",")]
        bytes_ = dna.to_bytes(version=f"2.{_writable(dna.version)}")
        try:
            dna = risorius.load(bytes_, layers=names, unknown_layers=args.unknown_layers)
        except risorius.DnaError:
            raise
        except ValueError as error:
            raise CommandLineError(f"--{error}") from error
    if args.lods is not None:
        lods = parse_lods(args.lods)
        if lods[-1] >= dna.lod_count:
            raise CommandLineError(
                f"--lods: LOD {lods[-1]} is not there, the file has {counted(dna.lod_count, 'LOD')}"
            )
        dna = dna.filter_lods(lods)
    return dna


def _writable(minor: int) -> int:
    return minor if 1 <= minor <= _NEWEST else _NEWEST


def version_of(source: risorius.Dna, result: risorius.Dna, turned: bool) -> str:
    """The DNA version to write if no option gives one; a change of version is printed.

    Args:
        source: the file that was read.
        result: the face to write.
        turned: True: the face was converted to other axes, units or rotation conventions.
    """
    minor = _writable(result.version)
    signed = result.rotation_sequence != "xyz" or -1 in result.rotation_signs
    needed = 8 if result.face_winding_order != "ccw" else 7 if signed else 1
    if turned and minor < needed:
        minor = _NEWEST
    if minor != source.version:
        _say(f"{source.generation}.{source.version} becomes 2.{minor}")
    return f"2.{minor}"


def convert(source: risorius.Dna, args: argparse.Namespace) -> tuple[risorius.Dna, bytes]:
    """Convert a face. Returns the result as read back from its bytes, and these bytes.

    Args:
        source: the file that was read.
        args: options of the command.

    Raises:
        InputError: the result cannot be read back.
    """
    dna = cut(source, args)
    target: dict[str, Any] = {
        argument: getattr(args, option)
        for option, argument in _SYSTEM.items()
        if getattr(args, option) is not None
    }
    if target:
        dna = dna.convert(**target)
    version = args.version or version_of(source, dna, bool(target))
    data = dna.to_bytes(version=version, unknown_layers=args.unknown_layers)
    try:
        return risorius.load(data), data
    except risorius.DnaError as error:
        raise InputError(f"{label(args.input)}: the result cannot be read: {error}") from error


def json_text(dna: risorius.Dna, indent: int | None) -> bytes:
    """A face as JSON in UTF-8.

    With `indent` None, the text has the format of Dna.to_json.

    Args:
        dna: the face.
        indent: number of spaces per nesting level, 0 or more; or None.
    """
    text = dna.to_json()
    if indent is not None and indent != 1:
        # Dna.to_json indents by one space per level, and no string in it contains a line break.
        text = re.sub(r"^ +", lambda spaces: spaces[0] * indent, text, flags=re.MULTILINE)
    return text.encode()


def write(name: str, data: bytes) -> None:
    """Write a file completely or not at all; a device or pipe receives the bytes directly.

    Args:
        name: name of the file; "-" for the standard output.
        data: the bytes to write.

    Raises:
        InputError: the file cannot be written.
    """
    try:
        if name == "-":
            sys.stdout.buffer.write(data)
            sys.stdout.buffer.flush()
        else:
            fileio.write_bytes(name, data)
    except BrokenPipeError:
        raise
    except OSError as error:
        name = label(name, "<stdout>")
        raise InputError(f"{name}: cannot write it: {error.strerror}") from error


def run(args: argparse.Namespace) -> int:
    args.input_kind = kind_of(args.input, args.input_kind, "--from")
    args.output_kind = kind_of(args.output, args.output_kind, "--to")
    complain(args)
    source = read(args.input, args.input_kind)
    try:
        with warnings_as_lines(label(args.input)):
            dna, data = convert(source, args)
        if args.output_kind == "json":
            data = json_text(dna, args.indent)
    except risorius.DnaError as error:
        kind_of_error = CommandLineError if error.code == "invalid_argument" else InputError
        raise kind_of_error(f"{label(args.input)}: {error}") from error
    write(args.output, data)
    kind = ", JSON" if args.output_kind == "json" else ""
    print(
        f"{label(args.output, '<stdout>')}: {summary(dna)}, {counted(len(data), 'byte')}{kind}",
        file=sys.stderr if args.output == "-" else sys.stdout,
    )
    return 0
