# SPDX-License-Identifier: MIT
"""Reads the reports of pytest and CTest, and prints the table at the end of packaging/test.sh.

    python packaging/check/results.py rows NAME REPORT.xml EXIT [--files FILE ...]
        prints the rows of one test program for its lane's file: the numbers of passed, failed and
        not run tests, and the reasons for the latter. A crash, a report without tests, and a test
        file without a collected test are failures
    python packaging/check/results.py table FOLDER LANE ...
        prints the table of the rows in FOLDER/LANE; exit code 1 if a test failed or a lane ended
        early

test.sh runs several lanes in parallel, each of which writes a file of rows. A row is one line: its
kind, then its fields, separated by tabs: `row NAME PASSED FAILED NOT_RUN`, `say TEXT`, `time STAGE
SECONDS CPU_SECONDS`, and `end` once at the end of a lane.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

PASSED, FAILED, NOT_RUN = "passed", "failed", "not run"
# Child elements of a JUnit test case that did not pass. pytest writes an expected failure as
# skipped; CTest also writes `disabled`.
_OUTCOMES = {"failure": FAILED, "error": FAILED, "skipped": NOT_RUN, "disabled": NOT_RUN}


@dataclass(frozen=True)
class Case:
    """One test: its dotted module and class, its name, its outcome, and the reason if not run."""

    module: str
    name: str
    outcome: str
    reason: str = ""


def _reason(case: ElementTree.Element) -> str:
    said = case.findtext("system-out") or ""
    found = re.search(r": Skipped\n(.*)", said)  # GoogleTest's line before the reason
    if found:
        return found[1].strip()
    children = (child.get("message") or "" for child in case if child.tag in _OUTCOMES)
    return next((text for text in children if text), "no reason given")


def read(report: Path) -> list[Case]:
    """The test cases of a JUnit report.

    Args:
        report: the XML file of pytest (--junitxml) or CTest (--output-junit).

    Returns:
        A case for each test; none if the file is missing or truncated, for example after a crash.
    """
    try:
        tree = ElementTree.parse(report)
    except (OSError, ElementTree.ParseError):
        return []
    cases = []
    for case in tree.iter("testcase"):
        found = {_OUTCOMES[child.tag] for child in case if child.tag in _OUTCOMES}
        outcome = FAILED if FAILED in found else NOT_RUN if found else PASSED
        module, name = case.get("classname") or "", case.get("name") or ""
        cases.append(Case(module, name, outcome, _reason(case) if outcome == NOT_RUN else ""))
    return cases


def _uncollected(cases: list[Case], files: list[Path]) -> list[Path]:
    # A file's name without its folder is enough, because pytest forbids equal names in one run.
    seen = {part for case in cases for part in case.module.split(".")}
    return [file for file in files if file.stem not in seen]


def rows(name: str, report: Path, code: int, files: list[Path] | None = None) -> list[str]:
    """The rows of one test program.

    Args:
        name: the row's name in the table.
        report: the program's JUnit report.
        code: the program's exit code; any other than 0 is a failure even if all tests passed.
        files: test files; the report must contain at least one test of each.

    Returns:
        Lines for the lane's file, without line ends.
    """
    cases = read(report)
    counts = Counter(case.outcome for case in cases)
    missing = _uncollected(cases, files or [])
    failed = counts[FAILED] + len(missing)
    if failed == 0 and (code != 0 or counts[PASSED] == 0):
        failed = 1
    lines = [f"row\t{name}\t{counts[PASSED]}\t{failed}\t{counts[NOT_RUN]}"]
    lines += [f"say\tFAILED, {name}: no test of {file} was run" for file in missing]
    reasons = Counter(case.reason.removeprefix("Skipped: ") for case in cases if case.reason)
    for reason, times in sorted(reasons.items()):
        text = " ".join(reason.split())
        lines.append(f"say\tNOT RUN, {name}: {text}" + (f" ({times} tests)" if times > 1 else ""))
    return lines


def _lane(path: Path) -> list[list[str]]:
    if not path.is_file():
        return []
    return [line.split("\t") for line in path.read_text(encoding="utf-8").splitlines()]


def table(folder: Path, lanes: list[str]) -> tuple[list[str], int]:
    """The table at the end of test.sh.

    Args:
        folder: folder of the lanes' files.
        lanes: names of the lanes; a lane without the row `end` counts as failed.

    Returns:
        The lines of the table, and the number of failed tests, tools and lanes.
    """
    lines, said, times = [], [], []
    passed = failed = 0
    for lane in lanes:
        fields = _lane(folder / lane)
        for kind, *rest in fields:
            if kind == "row":
                good, bad, not_run = map(int, rest[1:])
                passed, failed = passed + good, failed + bad
                lines.append(f"  {rest[0]:<44} {good:6} passed {bad:4} failed {not_run:4} not run")
            elif kind == "say":
                said.append(f"  {rest[0]}")
            elif kind == "time":
                seconds, cpu = map(int, rest[1:])
                times.append(f"  {lane + ': ' + rest[0]:<60} {seconds:6} s {cpu:6} s of CPU")
        if ["end"] not in fields:
            failed += 1
            said.append(f"  FAILED: the lane {lane} ended early")
    head = ["", "Seconds of each stage:", *times, "", "What ran where:"]
    return [*head, *lines, *said, "", f"{passed} passed, {failed} failed"], failed


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)
    of = commands.add_parser("rows")
    of.add_argument("name")
    of.add_argument("report", type=Path)
    of.add_argument("code", type=int)
    of.add_argument("--files", type=Path, nargs="*", default=[])
    end = commands.add_parser("table")
    end.add_argument("folder", type=Path)
    end.add_argument("lanes", nargs="+")
    given = parser.parse_args(arguments)
    if given.command == "rows":
        print("\n".join(rows(given.name, given.report, given.code, given.files)))
        return 0
    lines, failed = table(given.folder, given.lanes)
    print("\n".join(lines))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
