# SPDX-License-Identifier: MIT
"""The table platform x Python x what is known, from the facts that wheels.sh left.

    facts.py FACTS.tsv... > table.md

A line of facts: platform, Python, column, what; the newest of each counts. What is in no line was
not done, and the table says so.
"""

import sys
from pathlib import Path

COLUMNS = ["built", "tags and contents", "built twice", "imported", "tests"]
PLANNED = {  # as wheels.sh makes them: what nobody tried has a row too
    "linux-x64": ("3.11", "3.13", "3.14"),
    "windows-x64": ("3.11", "3.13"),
    "windows-arm64": ("3.11", "3.13"),
    "macos-arm64": ("3.11", "3.13"),
    "macos-x64": ("3.11",),
}
WHY = {  # of a system that does not run here, by the column
    "macos": "NOT RUN: no macOS here",
    "windows-arm64": "NOT RUN: no Windows on ARM here",
}


def read(texts: list[str]) -> dict[tuple[str, str], dict[str, str]]:
    """(platform, Python) -> column -> what."""
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
