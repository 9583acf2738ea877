# SPDX-License-Identifier: MIT
"""risorius check: prints all errors and warnings about files."""

from __future__ import annotations

import argparse
import json
from typing import Any

import risorius

from ..base.words import counted
from ..mixing import difference
from ..rigs.joint_controls import joint_controls
from .files import InputError, from_json, summary

_DESCRIPTION = """\
Prints a line for each error (the file is refused) and each warning (the file is odd), with its
byte and its field, and one line for the file as a whole. A file named *.json is read as JSON. The
exit code is 1 if a file has an error."""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    parser = subparsers.add_parser(
        "check", help="find errors and oddities in files", description=_DESCRIPTION
    )
    parser.add_argument("files", nargs="+", metavar="FILE")
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.add_argument("--strict", action="store_true", help="treat warnings as errors")
    parser.add_argument(
        "--mix",
        action="store_true",
        help="also check whether each file can be mixed with the first",
    )
    parser.set_defaults(func=run)


def _error(name: str, error: Exception, code: str = "io_read") -> risorius.Finding:
    """A finding for the error that stopped reading; its text does not repeat the file's name.

    Args:
        name: name of the file.
        error: the error.
        code: code of the finding if the error has none.
    """
    text = str(error).removeprefix(f"{name}: ")
    where, offset = getattr(error, "where", ""), getattr(error, "offset", None)
    text = text.removesuffix(f" (byte {offset})").removesuffix(f" [{where}]")
    return risorius.Finding(True, getattr(error, "code", code), where, offset, text)


def check_json(name: str) -> tuple[risorius.Dna | None, list[risorius.Finding]]:
    """Read a JSON file. Returns its Dna, or None after an error, and the findings."""
    try:
        dna = from_json(name)
    except InputError as error:
        cause = error.__cause__
        return None, [_error(name, cause if isinstance(cause, risorius.DnaError) else error)]
    found = []
    for text in dna.validate():
        where, _, message = text.partition(": ")
        found.append(risorius.Finding(False, "invalid_value", where, None, message))
    return dna, found + _joint_controls(dna)


def check_dna(name: str) -> tuple[risorius.Dna | None, list[risorius.Finding]]:
    """Check a DNA file. Returns its Dna, or None after an error, and the findings."""
    try:
        found = risorius.check(name)
        if any(finding.is_error for finding in found):
            return None, found
        dna = risorius.load(name, layers=("rbf_behavior", "twist_swing_behavior"))
        return dna, found + _joint_controls(dna)
    except risorius.DnaError as error:
        return None, [_error(name, error)]


def _joint_controls(dna: risorius.Dna) -> list[risorius.Finding]:
    """Warnings about raw controls that rotate joints but that no GUI control or solver sets."""
    where = "definition.raw_control_names"
    return [
        risorius.Finding(False, "invalid_value", where, None, text)
        for text in joint_controls(dna)[1]
    ]


def examine(name: str, strict: bool) -> dict[str, Any]:
    """The results of `risorius check` for one file, as plain values.

    Args:
        name: name of the file; *.json is read as JSON, other names as DNA.
        strict: True: a file with warnings is not ok.
    """
    dna, found = (check_json if name.lower().endswith(".json") else check_dna)(name)
    errors = sum(finding.is_error for finding in found)
    return {
        "file": name,
        "ok": not (found if strict else errors),
        "errors": errors,
        "warnings": len(found) - errors,
        "contents": None if dna is None else summary(dna),
        "findings": [finding._asdict() for finding in found],
    }


def lines(facts: dict[str, Any]) -> list[str]:
    """The results for one file as lines in the style of a compiler."""
    out = []
    for finding in facts["findings"]:
        place = [facts["file"]]
        if finding["offset"] is not None:
            place.append(f"byte {finding['offset']}")
        if finding["where"]:
            place.append(finding["where"])
        place.append("error" if finding["is_error"] else "warning")
        out.append(": ".join([*place, finding["message"]]))
    words = [facts["contents"]] if facts["contents"] else []
    if facts["errors"]:
        words.append(counted(facts["errors"], "error"))
    if facts["warnings"]:
        words.append(counted(facts["warnings"], "warning"))
    out.append(f"{'ok' if facts['ok'] else 'bad'}: {facts['file']} ({', '.join(words)})")
    return out


def _mixes(everything: list[dict[str, Any]], *, quiet: bool) -> None:
    """Add to the results of each valid file whether its face can be mixed with the face of the
    first valid file, and print this unless `quiet`. A file whose face cannot be mixed is not ok."""
    sound = [facts for facts in everything if facts["ok"]]
    first = risorius.load(sound[0]["file"]) if sound else None
    for facts in sound[1:]:
        assert first is not None
        why = difference(first, risorius.load(facts["file"]))
        facts["mixes"] = why is None
        facts["ok"] = why is None
        if why:
            facts["mixes_not"] = why
        if not quiet:
            other = sound[0]["file"]
            print(
                f"{facts['file']}: " + (f"cannot be mixed: {why}" if why else f"mixes with {other}")
            )


def run(args: argparse.Namespace) -> int:
    everything = []
    for name in args.files:
        facts = examine(name, args.strict)
        everything.append(facts)
        if not args.json:
            print("\n".join(lines(facts)), flush=True)
    if args.mix:
        _mixes(everything, quiet=args.json)
    bad = sum(not facts["ok"] for facts in everything)
    if args.json:
        print(json.dumps({"ok": bad == 0, "files": everything}, indent=2))
    elif len(everything) > 1:
        print(f"{counted(len(everything), 'file')}: {len(everything) - bad} ok, {bad} bad")
    return 1 if bad else 0
