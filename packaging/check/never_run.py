# SPDX-License-Identifier: MIT
"""Lists the lines that no test ran, by file and function, from reports of gcovr and coverage.py.

    python packaging/check/never_run.py native.json python.json

Prints the Python files that were never imported. Prints for each file the number of lines that
never ran and of all lines, then these lines by function. Prints a sum for each part of the project.
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
# Part of the project -> its folder.
PARTS = {"native": "native/", "package": "native/python/", "add-on": "addon/"}

_QUIET = re.compile(r"\s*(return \w+;|\}+[;)]*)\s*(//.*)?$")


@dataclass
class File:
    """A source file.

    Attributes:
        name: path in the project.
        lines: number of lines with code.
        never: function -> line numbers that never ran.
    """

    name: str
    lines: int = 0
    never: dict[str, list[int]] = field(default_factory=dict)

    @property
    def missing(self) -> int:
        """The number of lines that never ran."""
        return sum(map(len, self.never.values()))


def short_name(function: str) -> str:
    """The name of a C++ function without arguments, template arguments and namespaces.

    Args:
        function: demangled name, such as "risorius::dna::(anonymous namespace)::read(int)".
    """
    name = re.sub(r"\[abi:\w+\]|\(anonymous namespace\)::", "", function)
    name = re.sub(r"\{lambda.*", "lambda", name)
    while "<" in name and (shorter := re.sub(r"<[^<>]*>", "", name)) != name:
        name = shorter
    name = name.split("(")[0].split(" ")[-1]
    return re.sub(r"^risorius::(?:\w+::(?=\w+(::|$)))?", "", name) or function


def _only_cleans_up(source: list[str], number: int, before: int) -> bool:
    """Whether a line is `return name;` or `}` after a statement that ran.

    The compiler constructs the result in the caller's memory. Such a line then contains only code
    for exceptions, so its count is 0 although it runs.

    Args:
        source: the lines of the file.
        number: number of the line, from 1.
        before: number of the preceding counted line if that ran, otherwise 0.
    """
    if not 0 < before < number <= len(source):
        return False
    said = source[before - 1].split("//")[0].strip()
    goes_on = said.endswith((";", "}")) and not said.startswith(("return", "throw"))
    return goes_on and _QUIET.match(source[number - 1]) is not None


def native_files(report: dict[str, Any]) -> list[File]:
    """The files of a JSON report of gcovr. Counts of all instances of a function (as of a
    template) are added."""
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
    """Line numbers as text, for example "3-5, 9"."""
    spans: list[list[int]] = []
    for line in sorted(lines):
        if spans and line == spans[-1][1] + 1:
            spans[-1][1] = line
        else:
            spans.append([line, line])
    return ", ".join(str(a) if a == b else f"{a}-{b}" for a, b in spans)


def part_of(name: str) -> str:
    """The part of the project to which a file belongs. The longest matching folder counts."""
    return max((p for p in PARTS if name.startswith(PARTS[p])), key=lambda p: len(PARTS[p]))


def told(files: list[File]) -> str:
    """The list of lines that never ran, as text, and a sum for each part of the project."""
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
    """The Python files of the project that no report contains."""
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
