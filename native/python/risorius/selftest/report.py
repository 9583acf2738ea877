# SPDX-License-Identifier: MIT
"""Writes the self-test's report as text. The report describes the machine, but names no folders."""

from __future__ import annotations

from collections.abc import Iterable

from .checks import Row


def failed(rows: Iterable[Row]) -> list[Row]:
    """The rows that did not pass."""
    return [row for row in rows if not row.passed]


def text(rows: Iterable[Row]) -> str:
    """The report: a title, a line for each check, and a last line with the number of failed ones.

    Args:
        rows: results of the checks, at least one.
    """
    rows = list(rows)
    bad = len(failed(rows))
    width = max(len(row.name) for row in rows)
    lines = [f"{'ok  ' if row.passed else 'FAIL'} {row.name:<{width}}  {row.text}" for row in rows]
    last = f"{bad} of {len(rows)} checks failed" if bad else f"all {len(rows)} checks passed"
    return "\n".join(["Risorius self-test", *lines, last])
