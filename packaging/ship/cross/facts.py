# SPDX-License-Identifier: MIT
"""Prints a Markdown table of the results of wheels.sh: a row for each platform and Python.

    facts.py FACTS.tsv... > table.md

A line of FACTS.tsv has platform, Python, column and text, separated by tabs. If several
lines name the same platform, Python and column, the last one counts. A cell without a line says NOT
DONE or NOT RUN.
"""

import sys
from pathlib import Path

COLUMNS = ["built", "tags and contents", "built twice", "imported", "tests"]
PLANNED = {  # the wheels that wheels.sh makes; each has a row even without results
    "linux-x64": ("3.11", "3.13", "3.14"),
    "windows-x64": ("3.11", "3.13"),
    "windows-arm64": ("3.11", "3.13"),
    "macos-arm64": ("3.11", "3.13"),
    "macos-x64": ("3.11",),
}
WHY = {  # start of a platform's name -> text of the columns "imported" and "tests" without results
    "macos": "NOT RUN: no macOS here",
    "windows-arm64": "NOT RUN: no Windows on ARM here",
}


def read(texts: list[str]) -> dict[tuple[str, str], dict[str, str]]:
    """(platform, Python) -> column -> text, from the contents of FACTS.tsv files."""
    known: dict[tuple[str, str], dict[str, str]] = {}
    for line in "\n".join(texts).splitlines():
        if line:
            platform, python, column, what = line.split("\t")
            known.setdefault((platform, python), {})[column] = what
    return known


def cell(platform: str, column: str, facts: dict[str, str]) -> str:
    if column in facts:
        return facts[column].replace("|", "\\|")
    if column in ("imported", "tests"):
        return next((why for start, why in WHY.items() if platform.startswith(start)), "NOT RUN")
    return "NOT DONE"


def table(known: dict[tuple[str, str], dict[str, str]]) -> str:
    rows = [["platform", "Python", *COLUMNS], ["---"] * (2 + len(COLUMNS))]
    planned = {(platform, python) for platform, all_of in PLANNED.items() for python in all_of}
    for platform, python in sorted(planned | set(known)):
        facts = known.get((platform, python), {})
        rows.append([platform, python, *(cell(platform, c, facts) for c in COLUMNS)])
    return "\n".join("| " + " | ".join(row) + " |" for row in rows)


def main() -> int:
    print(table(read([Path(name).read_text(encoding="utf-8") for name in sys.argv[1:]])))
    return 0


if __name__ == "__main__":
    sys.exit(main())
