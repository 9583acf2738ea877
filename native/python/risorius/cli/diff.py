# SPDX-License-Identifier: MIT
"""risorius info --diff: prints the differences between two files in words."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from ..base.words import counted
from ..diff import Difference, compare
from .files import CommandLineError, InputError, kind_of, read, summary

_LINES = 8  # most lines per field without --all


def same_but_for(a: str, b: str) -> Difference | None:
    """A Difference with the place of the first byte that differs in two DNA files with equal
    content; None if all bytes are equal.

    Files with equal content can differ only in bytes that Risorius does not read.

    Args:
        a, b: names of the files.
    """
    data = [Path(name).read_bytes() for name in (a, b)]
    if data[0] == data[1]:
        return None
    short = min(map(len, data))
    left, right = (np.frombuffer(one, np.uint8, short) for one in data)
    other = left != right
    first = int(np.argmax(other)) if other.any() else short
    text = f"the same content, but other bytes from byte {first} on, in a part that no layer reads"
    return Difference("file", "bytes", text)


def page(found: list[Difference], everything: bool) -> str:
    """The differences as text, grouped by layer and field.

    Args:
        found: result of `diff.compare`.
        everything: True: lists are not shortened.
    """
    layers: dict[str, dict[str, list[str]]] = {}
    for layer, field, text in found:
        layers.setdefault(layer, {}).setdefault(field, []).append(text)
    out = []
    for layer, fields in layers.items():
        out.append(layer)
        for lines in fields.values():
            cut = len(lines) if everything or len(lines) <= _LINES + 1 else _LINES
            out += [f"  {text}" for text in lines[:cut]]
            if cut < len(lines):
                out.append(f"  ... and {len(lines) - cut:,} more (--all shows them)")
    return "\n".join(out)


def run(a: str, b: str, *, everything: bool, as_json: bool) -> int:
    """Print the differences. Returns the exit code: 0 if there are none, otherwise 1.

    Args:
        a, b: names of the files, .dna or .json.
        everything: True: lists are not shortened.
        as_json: True: print JSON.

    Raises:
        CommandLineError: a file cannot be read.
    """
    try:
        kinds = [kind_of(name, None, "another name") for name in (a, b)]
        rig_a, rig_b = read(a, kinds[0]), read(b, kinds[1])
    except InputError as error:  # exit code 2, because 1 means that the files differ
        raise CommandLineError(str(error)) from error
    found = compare(rig_a, rig_b, everything or as_json)
    if not found and kinds == ["dna", "dna"] and (bytes_differ := same_but_for(a, b)):
        found = [bytes_differ]
    if as_json:
        facts = {"same": not found, "a": a, "b": b, "differences": [d._asdict() for d in found]}
        print(json.dumps(facts, indent=2))
    elif found:
        print(f"A: {a} ({summary(rig_a)})\nB: {b} ({summary(rig_b)})")
        print(page(found, everything))
        print(counted(len(found), "difference"))
    else:
        print("no differences")
    return 1 if found else 0
