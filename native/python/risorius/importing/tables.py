# SPDX-License-Identifier: MIT
"""Comma separated tables: Live Link Face takes, and curves by column of any software."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from ..controls import arkit
from .clock import timecode
from .clock.units import FRAMES, Asked, TimeName, plain, row_times, seconds_of, time_name
from .errors import AnimationFileError
from .source import Take, keep_ascending, make_clip, number

Doubles = npt.NDArray[np.float64]

DELIMITERS = (",", "\t", ";", "|")
# Curves of a take of Live Link Face, in their order.
LIVE_LINK_FACE = (
    *(unit[0].upper() + unit[1:] for unit in arkit.order("live_link_face_take")),
    *"HeadYaw HeadPitch HeadRoll LeftEyeYaw LeftEyePitch LeftEyeRoll".split(),
    *"RightEyeYaw RightEyePitch RightEyeRoll".split(),
)
# Columns that tell how many blend shapes there are; they hold no curve.
COUNTS = ("blendshapecount",)
_FILE_TELLS = Asked()


@dataclass
class Table:
    """A table's cells as text; every row as long as the header.

    Attributes:
        header: names of the columns, without blanks around them.
        rows: the other rows.
        lines: line of the file, from 1, at which each row ends.
        delimiter: what stands between cells.
    """

    name: str
    header: list[str]
    rows: list[list[str]]
    lines: list[int]
    delimiter: str

    def cell(self, row: int, column: int) -> float:
        """The number in a cell.

        Args:
            row: from 0, without the header.
            column: from 0.

        Raises:
            AnimationFileError: no finite number.
        """
        text = self.rows[row][column].strip()
        if self.delimiter == ";" and "." not in text:
            text = text.replace(",", ".")  # a decimal comma, as spreadsheets of many lands write
        return number(text, self.name, self.lines[row], self.place(column))

    @cached_property
    def columns(self) -> list[tuple[str, ...]]:
        """The cells by column, once the rows are known to be of one length."""
        return list(zip(*self.rows, strict=True))

    def column(self, column: int, rows: Sequence[int] | None = None) -> Doubles:
        """float64[rows] of a column, all or some. Raises: as cell."""
        cells = self.columns[column]
        if rows is not None:
            cells = tuple(cells[row] for row in rows)
        try:  # the whole column at once; where that fails, each cell by itself finds the error
            values = np.array(list(map(float, cells)))
        except ValueError:
            values = np.full(len(cells), np.nan)
        if "_" in "".join(cells) or not (np.abs(values) <= np.finfo(np.float32).max).all():
            wanted = range(len(cells)) if rows is None else rows
            values = np.array([self.cell(row, column) for row in wanted])
        return values

    def place(self, column: int) -> str:
        header = self.header[column]
        return f"{column + 1} ({header})" if header else str(column + 1)


def sniff(text: str) -> str:
    """The delimiter: the sign that parts the first line into most cells outside quotes."""
    first = re.sub(r'"[^"]*"', '""', text.lstrip("\r\n").splitlines()[0])
    return max(DELIMITERS, key=first.count)


def read_table(text: str, name: str) -> Table:
    """A table with a header.

    Args:
        text: of the file; commas, semicolons or tabs stand between the cells.
        name: what errors call the file.

    Raises:
        AnimationFileError: no header, a name twice, a row of another length, no row, bad quotes.
    """
    if "\0" in text:
        line = text[: text.index("\0")].count("\n") + 1
        raise AnimationFileError(name, "text was expected, found a zero byte", line=line)
    delimiter = sniff(text)
    # strict: a quote that is never closed would swallow the rest of the file
    reader = csv.reader(re.split(r"\r\n|\n|\r", text), delimiter=delimiter, strict=True)
    rows: list[list[str]] = []
    lines: list[int] = []
    try:
        for row in reader:
            if any(cell.strip() for cell in row):
                rows.append(row)
                lines.append(reader.line_num)
    except csv.Error as error:
        raise AnimationFileError(name, f"no table: {error}", line=reader.line_num) from error
    if not rows:
        raise AnimationFileError(name, "it holds nothing")
    table = Table(name, [cell.strip() for cell in rows[0]], rows[1:], lines[1:], delimiter)
    _check(table, lines[0])
    return table


def _check(table: Table, line: int) -> None:
    if all(_is_number(cell) for cell in table.header):
        raise AnimationFileError(
            table.name,
            "a header with the names of the curves was expected, found numbers",
            line=line,
        )
    # A header that ends in a delimiter has one more empty column; its rows may have it or not.
    if len(table.header) > 1 and not table.header[-1]:
        table.header.pop()
        for row in table.rows:
            if len(row) == len(table.header) + 1 and not row[-1].strip():
                row.pop()
    seen: dict[str, int] = {}
    for column, header in enumerate(table.header):
        if header and header in seen:
            raise AnimationFileError(
                table.name,
                f"{header!r} was expected once, found in the columns {seen[header] + 1} and "
                f"{column + 1}",
                line=line,
            )
        seen[header] = column
    for row, at in zip(table.rows, table.lines, strict=True):
        if len(row) != len(table.header):
            raise AnimationFileError(
                table.name,
                f"{len(table.header)} columns as in the header were expected, found {len(row)}",
                line=at,
            )
    if not table.rows:
        raise AnimationFileError(table.name, "rows after the header were expected, found none")


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def is_live_link_face(header: Sequence[str]) -> bool:
    """A timecode, the count of shapes, then shapes: what Live Link Face and its likes write."""
    names = [plain(cell) for cell in header]
    return len(names) > 2 and names[0] == "timecode" and names[1] in COUNTS


def read_live_link_face(table: Table, asked: Asked = _FILE_TELLS) -> Take:
    """A take of Live Link Face: time from the timecode and its rate, not from the row.

    Args:
        table: 2 columns and 51 to 61 curves, in any order, in either style of names.
        asked: what the caller says of its timecodes.

    Raises:
        AnimationFileError: a cell that is none, timecodes whose rate cannot be told.
    """
    notes: list[str] = []
    seconds = _timecode_seconds(table, 0, asked, notes)
    columns = [i for i, cell in enumerate(table.header) if i > 1 and cell]
    curves = np.array([table.column(c) for c in columns])
    _note_count(table, len(columns), notes)
    keep = keep_ascending(seconds, notes, table.name)
    times = seconds[keep] - seconds[0]
    _note_dropped(times, notes)
    clip = make_clip(
        [table.header[c] for c in columns],
        curves.reshape(len(columns), -1)[:, keep],
        times,
        metadata={"timecode": table.rows[0][0].strip()},
    )
    return Take(clip, "live_link_face", "live_link_face", notes)


def _timecode_seconds(table: Table, column: int, asked: Asked, notes: list[str]) -> Doubles:
    """Seconds of the timecodes in a column, or of its rows where those are to be counted."""
    if asked.counts_rows:
        return row_times(len(table.rows), asked, table.name)
    codes = [
        timecode.parse(row[column], table.name, line, table.place(column))
        for row, line in zip(table.rows, table.lines, strict=True)
    ]
    rate = asked.timecode_rate
    if rate is not None:
        base = round(rate)
    else:
        found = timecode.infer_base(codes)
        if found is None:
            raise AnimationFileError(
                table.name,
                "its timecodes do not tell how many frames a second they count "
                f"(the largest frame number is {max(c.frames for c in codes):g}): give the "
                "timecode rate (--timecode-rate; Timecode Rate in Blender)",
                column=table.place(column),
            )
        base = found
    over = next((i for i, code in enumerate(codes) if code.frames >= base), None)
    if over is not None:
        raise AnimationFileError(
            table.name,
            f"a frame number below {base} was expected, found {codes[over].frames:g}",
            line=table.lines[over],
            column=table.place(column),
        )
    if any(code.is_dropped for code in codes) and base % 30:
        raise AnimationFileError(
            table.name, f"drop-frame timecodes count 30 or 60 frames a second, not {base}"
        )
    notes.append(f"the timecode counts {base} frames a second")
    true_rate = rate is None or abs(rate - base) < 1e-3
    return timecode.seconds_of(codes, base, true_rate)


def _note_count(table: Table, found: int, notes: list[str]) -> None:
    stated = table.rows[0][1].strip()
    if stated.isdigit() and int(stated) != found:
        notes.append(f"{table.header[1]} says {stated}, the file has {found} curves")


def _note_dropped(times: Doubles, notes: list[str]) -> None:
    """Rows that were not written, as a phone under load does."""
    if times.size < 3:
        return
    steps = np.diff(times)
    usual = float(np.median(steps))
    gaps = steps > 1.5 * usual
    if gaps.any():
        lost = int(np.rint(steps[gaps] / usual - 1.0).sum())
        notes.append(
            f"{lost} frame(s) are missing in {int(gaps.sum())} gap(s), the longest "
            f"{steps.max():.3f} s; the curves go straight across"
        )


def read_plain(table: Table, asked: Asked = _FILE_TELLS) -> Take:
    """Curves by column.

    Time is the column that is headed so (in a unit of `clock.units`, timecodes, or frame numbers at
    the rate that is asked for), else the row number at that rate. An empty cell is a value that is
    not there: the curve goes straight across, or keeps its first or last value.

    Args:
        table: of `read_table`.
        asked: what the caller says of its time.

    Raises:
        AnimationFileError: no time and no rate, a cell that is no number, no curve, a unit of time
            that nobody knows.
    """
    notes: list[str] = []
    at = _time_column(table)
    times = _plain_times(table, at, asked, notes)
    columns = [i for i, cell in enumerate(table.header) if i != at and _is_curve(table, i, notes)]
    if not columns:
        raise AnimationFileError(table.name, "columns with curves were expected, found none")
    keep = keep_ascending(times, notes, table.name)
    curves = np.stack([_column(table, column, times, notes) for column in columns])
    clip = make_clip(
        [table.header[c] for c in columns], curves[:, keep], times[keep],
        rate=asked.rate if at is None or asked.counts_rows else None,
    )  # fmt: skip
    return Take(clip, "csv", "", notes)


def _time_column(table: Table) -> int | None:
    """The first column of the best kind: a time before a frame number."""
    found = [(i, name) for i, h in enumerate(table.header) if (name := time_name(h)) is not None]
    found.sort(key=lambda row: row[1].unit == FRAMES)
    return found[0][0] if found else None


def _plain_times(table: Table, at: int | None, asked: Asked, notes: list[str]) -> Doubles:
    if at is None:
        return row_times(len(table.rows), asked, table.name)
    if ":" in table.rows[0][at]:
        seconds = _timecode_seconds(table, at, asked, notes)
        return seconds - seconds[0]
    if asked.counts_rows:
        return row_times(len(table.rows), asked, table.name)
    said = time_name(table.header[at]) or TimeName("")
    return seconds_of(table.column(at), said, asked, notes, name=table.name, column=table.place(at))


def _is_curve(table: Table, column: int, notes: list[str]) -> bool:
    """Not a row number, a count, a second time, or a column of text."""
    header = plain(table.header[column])
    if header in COUNTS or time_name(table.header[column]) is not None:
        return False
    cells = [row[column].strip() for row in table.rows]
    if not any(cells):
        notes.append(f"{table.header[column] or f'column {column + 1}'}: empty, left out")
        return False
    if not header:
        return False  # the row numbers that pandas writes without a header
    if not any(re.search(r"\d", cell) or _is_number(cell) for cell in cells):
        notes.append(f"{table.header[column]}: text, left out")
        return False
    return True


def _column(table: Table, column: int, times: Doubles, notes: list[str]) -> Doubles:
    filled = np.array([bool(row[column].strip()) for row in table.rows])
    known = np.flatnonzero(filled)
    values = table.column(column, known.tolist())
    if filled.all():
        return values
    notes.append(f"{table.header[column]}: {int((~filled).sum())} empty cell(s) filled")
    return np.interp(times, times[known], values)
