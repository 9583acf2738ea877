# SPDX-License-Identifier: MIT
"""Code shared by the commands that read .dna and .json files."""

from __future__ import annotations

import argparse
import os
import re
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import risorius
from risorius.base import given, signatures
from risorius.base.errors import RisoriusError
from risorius.base.reading import FACE, read_file, read_stream
from risorius.base.words import counted
from risorius.files import fileio

KINDS = ("dna", "json")


class InputError(RisoriusError):
    """Unusable input; the text is one line with the file and the place.

    If the byte offset of the fault is known, the attribute `offset` has it, except if a DnaError is
    the cause.
    """

    code = "input"


class CommandLineError(RisoriusError):
    """The command line is invalid."""

    code = "command_line"


def whole_number(low: int, high: int = given.MOST) -> Callable[[str], int]:
    """Make the `type` of an option that accepts a whole number.

    Args:
        low: smallest allowed value.
        high: largest allowed value.

    Raises:
        ArgumentTypeError: raised by the returned function for any other text.
    """

    def read(text: str) -> int:
        try:
            return given.whole_text(text, low, high)
        except given.GivenError as error:
            raise argparse.ArgumentTypeError(str(error)) from None

    return read


def number(
    low: float = -given.LARGEST, high: float = given.LARGEST, *, above: bool = False
) -> Callable[[str], float]:
    """Make the `type` of an option that accepts a finite number.

    Args:
        low: smallest allowed value.
        high: largest allowed value.
        above: True: `low` itself is not allowed.

    Raises:
        ArgumentTypeError: raised by the returned function for any other text.
    """

    def read(text: str) -> float:
        try:
            return given.finite_text(text, low, high, above=above)
        except given.GivenError as error:
            raise argparse.ArgumentTypeError(str(error)) from None

    return read


def parse_lods(text: str) -> list[int]:
    """Parse LOD numbers from a text such as "0", "0-2" or "0,3,5".

    Raises:
        CommandLineError: the text has another form.
    """
    lods: set[int] = set()
    for part in text.split(","):
        match = re.fullmatch(r"\s*(\d{1,5})(?:-(\d{1,5}))?\s*", part, re.ASCII)
        first, last = (int(match[1]), int(match[2] or match[1])) if match else (1, 0)
        if not first <= last <= 0xFFFF:
            raise CommandLineError(f"--lods: 0 or 0-2 or 0,3,5 was expected, found {text!r}")
        lods.update(range(first, last + 1))
    return sorted(lods)


def label(name: str, standard: str = "<stdin>") -> str:
    """The name of a file for messages.

    Args:
        name: name as the user typed it.
        standard: name to show for "-".
    """
    return standard if name == "-" else name


def kind_of(name: str, asked: str | None, option: str) -> str:
    """The kind of a file, "dna" or "json": the value of an option, otherwise the suffix.

    Args:
        name: name of the file.
        asked: value of the option; None if it was not used.
        option: option that the error message proposes.

    Raises:
        CommandLineError: neither the option nor the suffix gives a kind.
    """
    suffix = Path(name).suffix.lower().removeprefix(".")
    if kind := asked or (suffix if suffix in KINDS else None):
        return kind
    raise CommandLineError(f"{name}: a name ending in .dna or .json was expected, or {option}")


def refuse_same_file(source: str, target: str, advice: str = "choose another name") -> None:
    """Refuse an output that is the same file as the input, by any path; "-" is not a file.

    Args:
        source: name of the input.
        target: name of the output.
        advice: end of the message; it may only name options of the command.

    Raises:
        CommandLineError: both names are the same file.
    """
    if "-" in (source, target):
        return
    try:
        same = os.path.samefile(source, target)
    except OSError:  # one of them does not exist
        return
    if same:
        raise CommandLineError(f"{target}: the output is the input itself: {advice}")


def require_suffix(path: Path, kinds: Sequence[str], option: str) -> None:
    """Refuse an output name whose suffix is not allowed.

    Args:
        path: path of the output.
        kinds: allowed suffixes with their dots.
        option: name of the option for the output.

    Raises:
        CommandLineError: the path has another suffix.
    """
    if path.suffix.lower() not in kinds:
        *most, last = kinds
        listed = f"{', '.join(most)} or {last}" if most else last
        raise CommandLineError(
            f"{option}: a name ending in {listed} was expected, found {path.name!r}"
        )


def require_writable(*names: str | Path | None, parents: bool = False) -> None:
    """Check before long work that all outputs can be written.

    Args:
        names: paths of outputs; "-" and None are skipped.
        parents: True: missing folders are allowed, because they will be made.

    Raises:
        InputError: a folder is missing or not writable.
    """
    for name in names:
        if name is None or str(name) == "-":
            continue
        try:
            fileio.check_writable(name, parents=parents)
        except OSError as error:
            raise InputError(f"{name}: cannot write it: {error.strerror}") from error


def read_bytes(name: str, most: int = FACE) -> bytes:
    """The bytes of a file, or of the standard input for "-".

    Args:
        name: name as the user typed it.
        most: largest allowed size in bytes.

    Raises:
        InputError: the file cannot be read.
        ReadingError: the file is larger, or is a device.
    """
    try:
        if name == "-":
            return read_stream(sys.stdin.buffer, most, label(name))
        return read_file(name, most)
    except OSError as error:
        raise InputError(f"{label(name)}: cannot read it: {error.strerror}") from error


def from_json(name: str) -> risorius.Dna:
    """Read a Dna from a JSON file.

    Raises:
        InputError: not UTF-8, not JSON or not a Dna; the text has the place.
    """
    data = read_bytes(name)
    kind = signatures.kind_of(data)
    if kind is not None:
        raise InputError(f"{label(name)}: JSON was expected, this is {kind}")
    try:
        return risorius.Dna.from_json(data.decode())
    except UnicodeDecodeError as error:
        found = error.object[error.start]
        bad = InputError(f"{label(name)}: not JSON: {found:#04x} is not UTF-8 (byte {error.start})")
        bad.offset = error.start
        raise bad from error
    except risorius.DnaError as error:
        raise InputError(f"{label(name)}: {error}") from error


def read(name: str, kind: str) -> risorius.Dna:
    """Read a complete face from a DNA or JSON file.

    Args:
        name: name of the file; "-" for the standard input.
        kind: "dna" or "json".

    Raises:
        InputError: the file cannot be read.
    """
    if kind == "json":
        return from_json(name)
    try:
        return risorius.load(read_bytes(name) if name == "-" else name)
    except risorius.DnaError as error:
        # The error already contains the name of a file, but not of the standard input.
        raise InputError(f"{label(name)}: {error}" if name == "-" else str(error)) from error


def summary(dna: risorius.Dna) -> str:
    """Version and sizes as text, e.g. "2.4, 8 LODs, 870 joints"."""
    return (
        f"{dna.generation}.{dna.version}, {counted(dna.lod_count, 'LOD')}, "
        f"{counted(len(dna.joint_names), 'joint')}"
    )
