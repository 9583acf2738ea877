# SPDX-License-Identifier: MIT
"""Reads delimited tables: Live Link Face takes, and tables with a column per curve."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from ..controls import arkit
from . import visemes
from .clock import timecode
from .clock.units import (
    COUNT_ROWS,
    FRAMES,
    Asked,
    TimeName,
    plain,
    row_times,
    seconds_of,
    time_name,
)
from .errors import AnimationFileError
from .source import MOST_LOST, Take, keep_ascending, make_clip, number

Doubles = npt.NDArray[np.float64]

DELIMITERS = (",", "\t", ";", "|")
COMMENTS = ("#", "//", "%")
_NAMED_DELIMITER = re.compile(r"sep=(.|\\t)", re.IGNORECASE)
# Cells that mean a missing value.
_MISSING = frozenset(("", "-", "--", "\N{EN DASH}", "na", "n/a", "#n/a", "null", "none"))
# Names of the curves of a Live Link Face take, in the order of its columns.
LIVE_LINK_FACE = (
    *(unit[0].upper() + unit[1:] for unit in arkit.order("live_link_face_take")),
    *"HeadYaw HeadPitch HeadRoll LeftEyeYaw LeftEyePitch LeftEyeRoll".split(),
    *"RightEyeYaw RightEyePitch RightEyeRoll".split(),
)
# Names of columns that contain the number of blend shapes; these columns are not curves.
COUNTS = ("blendshapecount",)
_FILE_TELLS = Asked()
# A table with a row per time and name is converted to a column per name only if this gives at most
# this number of cells per row of the file; otherwise most cells would be empty.
_SPARSEST = 4
_HOLES_BY_NAME = 3  # up to this number of curves with missing values, notes name each one


@dataclass
class Table:
    """The cells of a table as text; all rows are as long as the header.

    Attributes:
        header: names of the columns, stripped.
        rows: the rows below the header.
        lines: line of the file, from 1, at which each of these rows ends.
        delimiter: character between cells.
        notes: sentences for the user about dropped parts.
    """

    name: str
    header: list[str]
    rows: list[list[str]]
    lines: list[int]
    delimiter: str
    notes: list[str] = field(default_factory=list)

    def cell(self, row: int, column: int) -> float:
        """Parses the number in a cell.

        Args:
            row: from 0, without the header.
            column: from 0.

        Raises:
            AnimationFileError: no finite number.
        """
        text = self.rows[row][column].strip()
        if "." not in text and (self.delimiter != "," or not self.has_points):
            # The comma is a decimal comma, which spreadsheets of many countries write.
            text = text.replace(",", ".")
        return number(text, self.name, self.lines[row], self.place(column))

    @cached_property
    def has_points(self) -> bool:
        """Whether any cell is a number with a decimal point.

        If so, a comma in a cell of a comma-separated table is not a decimal comma.
        """
        return any(re.fullmatch(r"\s*[-+]?\d*\.\d+\s*", c) for row in self.rows for c in row)

    @cached_property
    def columns(self) -> list[tuple[str, ...]]:
        """The cells by column; to be called after `_check`, because rows must be equally long."""
        return list(zip(*self.rows, strict=True))

    def column(self, column: int, rows: Sequence[int] | None = None) -> Doubles:
        """float64[rows] of a column, for all rows or some. Raises: AnimationFileError: as
        `cell`."""
        values = self.whole_column(column) if rows is None else None
        if values is None:
            wanted = range(len(self.rows)) if rows is None else rows
            values = np.array([self.cell(row, column) for row in wanted])
        return values

    def whole_column(self, column: int) -> Doubles | None:
        """float64[rows] of all cells of a column; None if a cell is not a plain number."""
        cells = self.columns[column]
        try:
            values = np.array(list(map(float, cells)))
        except ValueError:
            return None
        is_plain = (np.abs(values) <= np.finfo(np.float32).max).all() and "_" not in "".join(cells)
        return values if is_plain else None

    def place(self, column: int) -> str:
        header = self.header[column]
        return f"{column + 1} ({header})" if header else str(column + 1)


def sniff(line: str) -> str:
    """The delimiter: the character that splits a header line into most cells, outside quotes."""
    return max(DELIMITERS, key=re.sub(r'"[^"]*"', '""', line).count)


def read_table(text: str, name: str) -> Table:
    """Parses a table with a header.

    Comments are skipped. A line "sep=;" sets the delimiter, as in files of Excel. A last row that
    is too short is dropped with a note.

    Args:
        text: content of the file, with commas, tabs, semicolons or | between cells.
        name: the file's name in errors.

    Raises:
        AnimationFileError: no header, a repeated name, a row of another length, no rows, bad
            quotes.
    """
    if "\0" in text:
        line = text[: text.index("\0")].count("\n") + 1
        raise AnimationFileError(name, "text was expected, found a zero byte", line=line)
    content, delimiter, comment = _without_comments(re.split(r"\r\n|\n|\r", text))
    delimiter = delimiter or sniff(next((line for line in content if line.strip()), ""))
    # The reader is strict, because an unclosed quote would swallow the rest of the file.
    reader = csv.reader(content, delimiter=delimiter, strict=True)
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
    # NumPy writes the header as a comment, so a comment with as many cells as the first row of
    # numbers is the header.
    named = next(csv.reader([comment], delimiter=delimiter), [])
    if len(named) == len(rows[0]) and all(map(_is_number, rows[0])):
        rows.insert(0, named)
        lines.insert(0, lines[0])
    table = Table(name, [cell.strip() for cell in rows[0]], rows[1:], lines[1:], delimiter)
    _check(table, lines[0])
    return table


def _without_comments(lines: list[str]) -> tuple[list[str], str, str]:
    """Replaces comments by empty lines.

    Returns: the lines, the delimiter if a line states it, and the last comment above the header.
    """
    delimiter = comment = ""
    is_top = True
    for i, line in enumerate(lines):
        start = line.lstrip()
        named = _NAMED_DELIMITER.fullmatch(line.strip('"\ufeff ')) if is_top else None
        if named is not None:
            delimiter, lines[i] = named[1].replace("\\t", "\t"), ""
        elif start.startswith(COMMENTS):
            comment = start.lstrip("#/% ") if is_top else comment
            lines[i] = ""
        elif start:
            is_top = False
    return lines, delimiter, comment


def _check(table: Table, line: int) -> None:
    if all(_is_number(cell) for cell in table.header):
        raise AnimationFileError(
            table.name,
            "a header with the names of the curves was expected, found numbers",
            line=line,
        )
    # A header that ends in a delimiter has an empty column at its end, which the rows may lack.
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
    if len(table.rows) > 1 and len(table.rows[-1]) < len(table.header):
        # The program that wrote the file was interrupted. The row's last number may be incomplete.
        table.notes.append(f"the last row (line {table.lines[-1]}) is cut short and left out")
        del table.rows[-1], table.lines[-1]
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
        float(text.replace(",", "."))
    except ValueError:
        return False
    return True


def _is_missing(cell: str) -> bool:
    return cell.strip().lower() in _MISSING


def _with_times(table: Table, at: int, asked: Asked) -> Table:
    """Drops rows without a time, unless the times come from the row numbers.

    Args:
        table: any table.
        at: index of the column of times.
        asked: the caller's options on time.

    Raises:
        AnimationFileError: more than MOST_LOST of the rows have no time.
    """
    keep = [i for i, row in enumerate(table.rows) if not _is_missing(row[at])]
    lost = len(table.rows) - len(keep)
    if asked.counts_rows or not lost:
        return table
    if lost > MOST_LOST * len(table.rows):
        raise AnimationFileError(
            table.name,
            f"times were expected, found none in {lost} of {len(table.rows)} rows: {COUNT_ROWS}",
            column=table.place(at),
        )
    return replace(
        table,
        rows=[table.rows[i] for i in keep],
        lines=[table.lines[i] for i in keep],
        notes=[*table.notes, f"{lost} row(s) without a time left out"],
    )


def is_live_link_face(header: Sequence[str]) -> bool:
    """Whether a header begins with a timecode and the number of shapes, as in Live Link Face."""
    names = [plain(cell) for cell in header]
    return len(names) > 2 and names[0] == "timecode" and names[1] in COUNTS


def read_live_link_face(table: Table, asked: Asked = _FILE_TELLS) -> Take:
    """Reads a take of Live Link Face.

    Times come from the timecode, or from the row number if the caller's options say so.

    Args:
        table: timecode and number of shapes, then 51 to 61 curves in any order.
        asked: the caller's options on timecodes.

    Raises:
        AnimationFileError: an invalid cell, timecodes without a recognisable rate.
    """
    table = _with_times(table, 0, asked)
    notes = list(table.notes)
    seconds = _timecode_seconds(table, 0, asked, notes)
    columns = [i for i in range(2, len(table.header)) if _is_curve(table, i, notes)]
    curves = _curves(table, columns, seconds, notes)
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
    """Seconds of the timecodes in a column.

    If the option `counts_rows` is set, the times come from the row numbers at the given rate.

    Args:
        table: any table.
        column: index of the column.
        asked: the caller's options on time.
        notes: receives a sentence on the frames per second that the timecodes count.

    Raises:
        AnimationFileError: an invalid timecode, or no recognisable number of frames per second.
    """
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
                "timecode rate (clip convert --timecode-rate; Timecode Rate in Blender)",
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
    """Adds a note on gaps in the times: a phone under load does not record every frame.

    Args:
        times: float64[frames], seconds, ascending.
        notes: receives the note.
    """
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
    """Reads a table with a column per curve.

    Times come from the column with a header of times (in a unit of `clock.units`, as timecodes, or
    as frame numbers at the caller's rate), else from the row number at that rate. An empty cell is
    a missing value: it is interpolated linearly, or gets the curve's first or last value.

    Args:
        table: from `read_table`.
        asked: the caller's options on time.

    Raises:
        AnimationFileError: neither times nor a rate, a cell that is not a number, no curve, an
            unknown unit of time.
    """
    at = _time_column(table)
    if at is not None:
        table = _with_times(table, at, asked)
        table, at = _by_curve(table, at)
    notes = list(table.notes)
    times = _plain_times(table, at, asked, notes)
    columns = [i for i, cell in enumerate(table.header) if i != at and _is_curve(table, i, notes)]
    shapes = _shapes(table, at) if not columns else None
    if shapes is not None:
        return visemes.rhubarb_column(times, table.columns[shapes], table.name)
    if not columns:
        raise AnimationFileError(table.name, "columns with curves were expected, found none")
    keep = keep_ascending(times, notes, table.name)
    curves = _curves(table, columns, times, notes)
    clip = make_clip(
        [table.header[c] for c in columns], curves[:, keep], times[keep],
        rate=asked.rate if at is None or asked.counts_rows else None,
    )  # fmt: skip
    return Take(clip, "csv", "", notes)


def _time_column(table: Table) -> int | None:
    """Index of the column of times; a column of frame numbers only if there is no other."""
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
    """Whether a column is a curve, and not a row number, a count, a second time, or text.

    Args:
        table: any table.
        column: index of the column.
        notes: receives a sentence if an empty column or a column of text is left out.
    """
    header = plain(table.header[column])
    if header in COUNTS or time_name(table.header[column]) is not None:
        return False
    cells = table.columns[column]
    if all(map(_is_missing, cells)):
        notes.append(f"{table.header[column] or f'column {column + 1}'}: empty, left out")
        return False
    if not header:
        return False  # a column of row numbers without a header, as pandas writes
    if not any(re.search(r"\d", cell) or _is_number(cell) for cell in cells):
        notes.append(f"{table.header[column]}: text, left out")
        return False
    return True


def _by_curve(table: Table, at: int) -> tuple[Table, int]:
    """Converts a table with a row per time and name to one with a column per name.

    Args:
        table: with a column of times, one of names and one of values, as for MediaPipe's results.
        at: the column of the time.

    Returns:
        The table, converted if it has these three columns, and the number of its column of times.

    Raises:
        AnimationFileError: the converted table would be mostly empty.
    """
    others = [i for i in range(len(table.header)) if i != at and table.header[i]]
    is_named = {i: not any(map(_is_number, table.columns[i])) for i in others}
    times = dict.fromkeys(table.columns[at])
    repeated = len(table.rows) - len(times)
    if sorted(is_named.values()) != [False, True] or repeated <= MOST_LOST * len(table.rows):
        return table, at
    named, valued = sorted(others, key=lambda i: not is_named[i])
    names = dict.fromkeys(cell.strip() for cell in table.columns[named])
    if len(names) * len(times) > _SPARSEST * len(table.rows):
        raise AnimationFileError(
            table.name,
            f"a value for each time and each name in the column {table.place(named)} was expected, "
            f"found {len(table.rows)} for {len(times)} times and {len(names)} names",
        )
    row_of = {time: i for i, time in enumerate(times)}
    place_of = {name: i for i, name in enumerate(names, start=1)}
    rows = [[time, *([""] * len(names))] for time in times]
    lines = [0] * len(rows)
    for row, line in zip(table.rows, table.lines, strict=True):
        rows[row_of[row[at]]][place_of[row[named].strip()]] = row[valued]
        lines[row_of[row[at]]] = line
    notes = [*table.notes, f"the column {table.header[named]} names the curves"]
    return Table(table.name, [table.header[at], *names], rows, lines, table.delimiter, notes), 0


def _shapes(table: Table, at: int | None) -> int | None:
    """Index of the column that contains only mouth shapes of Rhubarb; None if not exactly one.

    Args:
        table: any table.
        at: index of the column of times, or None.
    """
    found = [
        i
        for i in range(len(table.header))
        if i != at and all(map(visemes.is_shape, table.columns[i]))
    ]
    return found[0] if len(found) == 1 else None


def _curves(table: Table, columns: Sequence[int], times: Doubles, notes: list[str]) -> Doubles:
    """float64[columns, rows]; missing values are interpolated from other rows.

    Args:
        table: any table.
        columns: indices of the columns with curves.
        times: float64[rows], seconds.
        notes: receives sentences about interpolated values.
    """
    holes: list[tuple[str, int]] = []
    curves = np.array([_column(table, column, times, holes) for column in columns])
    if len(holes) > _HOLES_BY_NAME:
        cells = sum(count for _, count in holes)
        notes.append(f"{cells} empty cell(s) filled in {len(holes)} curves, as {holes[0][0]}")
    else:
        notes += [f"{name}: {count} empty cell(s) filled" for name, count in holes]
    return curves.reshape(len(columns), len(table.rows))


def _column(table: Table, column: int, times: Doubles, holes: list[tuple[str, int]]) -> Doubles:
    whole = table.whole_column(column)
    if whole is not None:
        return whole
    filled = np.array([not _is_missing(row[column]) for row in table.rows])
    known = np.flatnonzero(filled)
    values = table.column(column, known.tolist())
    if filled.all():
        return values  # numbers with decimal commas, which whole_column does not parse
    holes.append((table.header[column], int((~filled).sum())))
    # Times that go back would distort the interpolation; their frames are dropped later.
    at = np.maximum.accumulate(times)
    return np.interp(at, at[known], values)
