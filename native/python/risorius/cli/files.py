# SPDX-License-Identifier: MIT
"""Tools shared by the commands that read .dna and .json files."""

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
    """Unusable input: one line with the file and the place.

    offset: byte offset, if known and if no DnaError is the cause.
    """

    code = "input"


class CommandLineError(RisoriusError):
    """The command line is invalid."""

    code = "command_line"


def whole_number(low: int, high: int = given.MOST) -> Callable[[str], int]:
    """The `type` of an option that takes a whole number.

    Args:
        low: smallest value.
        high: largest value.

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
    """The `type` of an option that takes a finite number.

    Args:
        low: smallest value.
        high: largest value.
        above: exclude `low` itself.

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
    """LOD numbers from a text such as "0", "0-2" or "0,3,5".

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
    """A file's name for messages.

    Args:
        name: as the user typed it.
        standard: the name to show for "-".
    """
    return standard if name == "-" else name


def kind_of(name: str, asked: str | None, option: str) -> str:
    """ "dna" or "json": the value of an option, else the suffix.

    Args:
        name: name of the file.
        asked: value of the option; None: not given.
        option: option that the error message suggests.

    Raises:
        CommandLineError: neither is given.
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
        advice: remedy for the message; name an option only if the command has it.

    Raises:
        CommandLineError: both are one file.
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
    """Refuse an output name with another suffix.

    Args:
        path: path of the output.
        kinds: allowed suffixes with their dots.
        option: the option of the output.

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
    """Check before long work that the outputs can be written.

    Args:
        names: paths of outputs; "-" and None are skipped.
        parents: missing folders will be created later.

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
    """Bytes of a file, or of the standard input for "-".

    Args:
        name: as the user typed it.
        most: largest size in bytes.

    Raises:
        InputError: the file cannot be read.
        ReadingError: the file is larger, or a device.
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
        InputError: no UTF-8, no JSON or no Dna; with the place.
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
    """Read a whole Dna.

    Args:
        name: name of the file; "-": the standard input.
        kind: "dna" or "json".

    Raises:
        InputError: the file cannot be read.
    """
    if kind == "json":
        return from_json(name)
    try:
        return risorius.load(read_bytes(name) if name == "-" else name)
    except risorius.DnaError as error:
        # load(path) already names the file
        raise InputError(f"{label(name)}: {error}" if name == "-" else str(error)) from error


def summary(dna: risorius.Dna) -> str:
    """Version and sizes, e.g. "2.4, 8 LODs, 870 joints"."""
    return (
        f"{dna.generation}.{dna.version}, {counted(dna.lod_count, 'LOD')}, "
        f"{counted(len(dna.joint_names), 'joint')}"
    )
