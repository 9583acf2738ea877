# SPDX-License-Identifier: MIT
"""Lists the lines that no test ran, by file and function, as gcovr and coverage.py report them.

    python packaging/check/never_run.py native.json python.json

Prints for each file its lines that never ran and how many lines it has, then each function with
such lines; the files of Python that were never imported; a sum for each part of the project.
"""

from __future__ import annotations

import json
import re
import sys
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

PROJECT = Path(__file__).resolve().parents[2]
PARTS = {"native": "native/", "package": "native/python/", "add-on": "addon/"}  # and their folders

_QUIET = re.compile(r"\s*(return \w+;|\}+[;)]*)\s*(//.*)?$")


@dataclass
class File:
    """A source file: how many of its lines count, and by function those that never ran."""

    name: str
    lines: int = 0
    never: dict[str, list[int]] = field(default_factory=dict)

    @property
    def missing(self) -> int:
        """How many lines never ran."""
        return sum(map(len, self.never.values()))


def short_name(function: str) -> str:
    """A C++ function without its arguments, namespaces and what a lambda is called by.

    Args:
        function: the demangled name, e.g. "risorius::dna::(anonymous namespace)::read(int)".
    """
    name = re.sub(r"\[abi:\w+\]|\(anonymous namespace\)::", "", function)
    name = re.sub(r"\{lambda.*", "lambda", name)
    while "<" in name and (shorter := re.sub(r"<[^<>]*>", "", name)) != name:
        name = shorter
    name = name.split("(")[0].split(" ")[-1]
    return re.sub(r"^risorius::(?:\w+::(?=\w+(::|$)))?", "", name) or function


def _only_cleans_up(source: list[str], number: int, before: int) -> bool:
    """Whether a line runs without being counted: `return out;` and `}` after a statement that ran.

    The compiler makes the result in its place, so these hold only what an exception would run.

    Args:
        source: the lines of the file.
        number: of the line in question, from 1.
        before: of the counted line before it.
    """
    if not 0 < before < number <= len(source):
        return False
    said = source[before - 1].split("//")[0].strip()
    goes_on = said.endswith((";", "}")) and not said.startswith(("return", "throw"))
    return goes_on and _QUIET.match(source[number - 1]) is not None


def native_files(report: dict[str, Any]) -> list[File]:
    """The files of a JSON report of gcovr; a line ran if it did in any build of its function."""
    files = []
    for told in report["files"]:
        ran: Counter[int] = Counter()
        inside: dict[int, str] = {}
        for line in told["lines"]:
            if not line.get("gcovr/noncode"):
                ran[line["line_number"]] += line["count"]
                inside[line["line_number"]] = short_name(line.get("function_name", ""))
        file, before = File(told["file"], len(ran)), 0
        path = PROJECT / file.name
        source = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
        for number in sorted(ran):
            if ran[number] or _only_cleans_up(source, number, before):
                before = number
            else:
                before = 0
                file.never.setdefault(inside[number], []).append(number)
        files.append(file)
    return files


def python_files(report: dict[str, Any]) -> list[File]:
    """The files of a JSON report of coverage.py."""
    files = []
    for name, told in report["files"].items():
        file = File(name, told["summary"]["num_statements"])
        for function, lines in told["functions"].items():
            if lines["missing_lines"]:
                file.never[function or "(file)"] = lines["missing_lines"]
        files.append(file)
    return files


def ranges(lines: Iterable[int]) -> str:
    """Line numbers in words: "3-5, 9"."""
    spans: list[list[int]] = []
    for line in sorted(lines):
        if spans and line == spans[-1][1] + 1:
            spans[-1][1] = line
        else:
            spans.append([line, line])
    return ", ".join(str(a) if a == b else f"{a}-{b}" for a, b in spans)


def part_of(name: str) -> str:
    """The part of the project that a file belongs to; `native/python` is within `native`."""
    return max((p for p in PARTS if name.startswith(PARTS[p])), key=lambda p: len(PARTS[p]))


def told(files: list[File]) -> str:
    """The whole list as text."""
    out, lines, missing = [], Counter[str](), Counter[str]()
    for file in sorted(files, key=lambda f: f.name):
        lines[part_of(file.name)] += file.lines
        missing[part_of(file.name)] += file.missing
        if file.never:
            out.append(f"{file.name}: {file.missing} of {file.lines}")
            out += [f"    {name}: {ranges(never)}" for name, never in file.never.items()]
    for part in PARTS:
        out.append(f"{part}: no test runs {missing[part]} of {lines[part]} lines")
    return "\n".join(out)


def never_imported(files: list[File]) -> list[str]:
    """The Python files of the project that no report knows."""
    known = {file.name for file in files}
    found = (p for part in ("package", "add-on") for p in (PROJECT / PARTS[part]).rglob("*.py"))
    return sorted(set(p.relative_to(PROJECT).as_posix() for p in found) - known)


def main() -> int:
    native, python = (json.loads(Path(name).read_text(encoding="utf-8")) for name in sys.argv[1:3])
    files = native_files(native) + python_files(python)
    for name in never_imported(files):
        print(f"{name}: never imported")
    print(told(files))
    return 0


if __name__ == "__main__":
    sys.exit(main())
