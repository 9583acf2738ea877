# SPDX-License-Identifier: MIT
"""Prints test results by version of Blender as a Markdown table, from pytest's reports.

    python packaging/check/blender/matrix_table.py NAME=REPORT.xml [NAME=REPORT.xml ...]

The table has a column for each Blender and a row for each test file. A cell has the number of
passed tests, and the numbers of failed and not run tests if they are not 0. The exit code is 1 if a
test failed or a report is missing.
"""

from __future__ import annotations

import sys
from collections import Counter, defaultdict
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

import results  # noqa: E402
from results import FAILED, NOT_RUN, PASSED  # noqa: E402


def read(report: Path) -> dict[str, Counter[str]]:
    """Test file -> counts of passed, failed and not run tests; empty if the report is missing."""
    counts: dict[str, Counter[str]] = defaultdict(Counter)
    for case in results.read(report):
        parts = (case.module or case.name).split(".")
        group = next((p for p in parts if p.startswith("test_")), parts[-1])
        counts[group][case.outcome] += 1
    return counts


def cell(counts: Counter[str]) -> str:
    """The text of a cell: `18`, `17, 1 failed` or `16, 2 not run`; `-` if there is no test."""
    if not counts:
        return "-"
    extra = [f"{counts[kind]} {kind}" for kind in (FAILED, NOT_RUN) if counts[kind]]
    return ", ".join([str(counts[PASSED]), *extra])


def table(columns: dict[str, dict[str, Counter[str]]]) -> str:
    """The Markdown table: a row for each test file, and a row of sums."""
    groups = sorted({group for counts in columns.values() for group in counts})
    lines = [
        f"| tests | {' | '.join(columns)} |",
        f"|---|{'---|' * len(columns)}",
    ]
    for group in groups:
        title = group.removeprefix("test_").replace("_", " ")
        cells = (cell(counts.get(group, Counter())) for counts in columns.values())
        lines.append(f"| {title} | {' | '.join(cells)} |")
    sums = (cell(sum(counts.values(), Counter())) for counts in columns.values())
    lines.append(f"| **all** | {' | '.join(f'**{s}**' for s in sums)} |")
    return "\n".join(lines)


def main(arguments: list[str]) -> int:
    columns = {}
    for argument in arguments:
        name, _, report = argument.rpartition("=")
        columns[name] = read(Path(report))
    print(table(columns))
    bad = [n for n, c in columns.items() if not c or any(x[FAILED] for x in c.values())]
    if bad:
        print(f"\nFailed: {', '.join(bad)}")
    return 1 if bad or not columns else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
