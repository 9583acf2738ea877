# SPDX-License-Identifier: GPL-3.0-or-later
"""Lays out the handles of a face board and the lines around them.

Lengths are in board units: moving a handle by 1 changes its GUI control by `Axis.unit`, usually 1.
The viewer sees x to the right and y up, and the character's left on the right. Handles with
known names are arranged like a face; all others are placed in rows by region.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..base import names
from . import board_letters, slider_words
from .board_letters import Point
from .board_table import BoardTable, Doubles

Line = list[Point]
RIGHT, LEFT, UP, DOWN = (1, 0), (-1, 0), (0, 1), (0, -1)
Direction = tuple[int, int]

_TEXT, _TITLE = 0.29, 0.46  # heights of letters in labels and titles, in board units
_TRACK = 0.34  # width of the frame of a handle that moves along one axis
_GAP = 0.3  # between neighbouring frames, and between cells (frames with a common label)
_MARGIN = 0.6  # around the board
_LONGEST = 10  # most letters in a line of several words of a label
_WIDEST, _LINES = 14, 4  # longest word in letters, and most lines of a label
_NARROWEST = 31.0  # smallest width of the board


@dataclass(frozen=True)
class Axis:
    """One axis along which a handle moves.

    Attributes:
        gui: index of the GUI control.
        low, high: range of the handle in board units; 0 is rest.
        unit: change of the GUI control for one board unit: 1 if the control's largest absolute
            value is from 0.5 to 1.5, otherwise this largest value.
        way: direction on the board in which the value grows.
    """

    gui: int
    low: float
    high: float
    unit: float
    way: Direction


@dataclass(frozen=True)
class Handle:
    """A handle of the board.

    Attributes:
        bone: name of its bone.
        side: "L" or "R" of the character, or "" for the middle.
        region: region of the face.
        stem: name of the bone without prefix and side, such as eye_blink.
        x, y: movements along the bone's x and y axis; None for an unused axis.
        place: rest place on the board.
    """

    bone: str
    side: str
    region: str
    stem: str
    x: Axis | None
    y: Axis | None
    place: Point = (0.0, 0.0)

    @property
    def axes(self) -> tuple[Axis, ...]:
        return tuple(axis for axis in (self.x, self.y) if axis is not None)

    def box(self) -> tuple[float, float, float, float]:
        """Left, bottom, right and top of the handle's range, relative to its rest place."""
        left = bottom = right = top = 0.0
        for axis in self.axes:
            for end in (axis.low, axis.high):
                x, y = end * axis.way[0], end * axis.way[1]
                left, right = min(left, x), max(right, x)
                bottom, top = min(bottom, y), max(top, y)
        return left, bottom, right, top


@dataclass(frozen=True)
class Board:
    """A face board of either kind (complete or primary), centred at 0, 0.

    Attributes:
        handles: its handles.
        lines: frames and labels of the handles, and titles and outlines around them.
        border: outline of the board, for selecting the board.
        width, height: size of the outline.
    """

    handles: tuple[Handle, ...]
    lines: tuple[Line, ...]
    border: tuple[Line, ...]
    width: float
    height: float


# _FACE has a row for each block of the board: title, columns of handles for each side of the
# face, columns in the middle. A column lists handles from the top down. The columns of a side are
# ordered from the outer edge of the face inwards.
_Columns = tuple[tuple[str, ...], ...]
_FACE: tuple[tuple[str, _Columns, _Columns], ...] = (
    (
        "Brows",
        (("brow_raiseout",), ("brow_down",), ("brow_lateral",), ("brow_raisein",)),
        (),
    ),
    (
        "Eyes",
        (
            ("eye_lidpress", "eye_facescrunch"),
            ("eyelashes_tweakerout",),
            ("eyelashes_tweakerin",),
            ("eye_squintinner", "eye_cheekraise"),
            ("eye_pupil",),
            ("eye_eyelidd",),
            ("eye_eyelidu",),
            ("eye_blink",),
            ("eye",),
        ),
        (("eye_parallellook",),),
    ),
    (
        "Nose and Cheeks",
        (
            ("ear_up",),
            ("mouth_lipsblow",),
            ("mouth_suckblow",),
            ("nose_nasolabialdeepen", "nose_wrinkleupper"),
            ("nose",),
        ),
        (),
    ),
    (
        "Mouth",
        (
            ("mouth_lipsticky",),
            ("mouth_stretchlipsclose", "mouth_stretch"),
            ("mouth_dimple", "mouth_cornerdepress"),
            ("mouth_sharpcornerpull", "mouth_cornerpull"),
            ("mouth_corner",),
            ("mouth_upperlipraise", "mouth_lowerlipdepress"),
        ),
        (("mouth",),),
    ),
    (
        "Jaw and Neck",
        (
            ("neck_mastoidcontract",),
            ("neck_stretch",),
            ("jaw_clench",),
            ("jaw_chincompress",),
            ("jaw_chinraiseu", "jaw_chinraised"),
        ),
        (
            ("neck_throatupdown",),
            ("neck_digastricupdown",),
            ("jaw_openextreme",),
            ("jaw",),
            ("jaw_fwdback",),
            ("neck_throatexhaleinhale",),
            ("neck_swallow",),
        ),
    ),
)
# Stem of a handle in lower case -> label; for stems that are too long, or unclear without their
# region.
_LABELS = {
    "eyelashes_tweakerin": "Lashes In", "eyelashes_tweakerout": "Lashes Out", "eye": "Look",
    "eye_eyelidu": "Upper Lid", "eye_eyelidd": "Lower Lid", "ear_up": "Ear Up",
    "mouth_stretchlipsclose": "Stretch Close", "mouth_sharpcornerpull": "Sharp Pull",
    "mouth_upperlipraise": "Upper Raise", "mouth_lowerlipdepress": "Lower Depress",
    "nose_nasolabialdeepen": "Nasolabial", "neck_throatupdown": "Throat",
    "neck_digastricupdown": "Digastric", "neck_throatexhaleinhale": "Exhale Inhale",
    "mouth_lipstowardsteeth": "Towards Teeth", "mouth_thicknessinwardu": "Inward Upper",
    "mouth_thicknessinwardd": "Inward Lower", "mouth_cornersharpnessu": "Sharp Upper",
    "mouth_cornersharpnessd": "Sharp Lower", "jaw_chinraiseu": "Chin Upper",
    "jaw_chinraised": "Chin Lower", "mouth_lipspressu": "Lips Press",
    "teeth_fwdbacku": "Upper Fwd", "teeth_fwdbackd": "Lower Fwd",
}  # fmt: skip
_PREFIX = re.compile(r"^CTRL_(?:([LRC])_)?")
_LAST_SIDE = re.compile(r"[LR](?=$|Ph\d$)")
_BESIDE = re.compile(r"(Left|Right)(?=[A-Z_]|$)")
_DOWNWARDS = re.compile(r"(Down|Depress|Open|Blink)(?=[A-Z_]|$)")
_CLEAR = 0.05  # smallest sideways share of the measured motion that decides a direction
_LIP = re.compile(r"[UD]$")


@dataclass
class _Cell:
    """Handles of a board above a common label.

    Attributes:
        width, height: size in board units.
        label: the lines of the label.
        inside: (handle, x, y): each handle with its offset from the cell's upper left corner.
    """

    width: float
    height: float
    label: list[str]
    inside: list[tuple[Handle, float, float]] = field(default_factory=list)


@dataclass
class _Block:
    """A titled block of cells; each cell has its offset from the block's upper left corner."""

    title: str
    width: float = 0.0
    height: float = 0.0
    cells: list[tuple[_Cell, float, float]] = field(default_factory=list)


def is_beside(table: BoardTable, raw_names: Sequence[str], gui: int) -> bool:
    """Whether the handle of a GUI control moves left and right on the board.

    Args:
        table: the GUI controls.
        raw_names: names of all raw controls.
        gui: index of the GUI control.
    """
    if table.names[gui].endswith(".tx"):
        return True
    led = [slider_words.short_name(raw_names[raw]) for raw in table.outputs_of(gui)]
    return bool(led) and all(_BESIDE.search(name) for name in led)


def is_middle(table: BoardTable, gui: int) -> bool:
    """Whether a GUI control belongs to no side.

    Args:
        table: all GUI controls.
        gui: index of the GUI control.
    """
    return not _side_of(_bone_of(table.names[gui])[0])


def ways_of(
    table: BoardTable, raw_names: Sequence[str], sideways: Mapping[int, float]
) -> list[Direction]:
    """The direction in which the handle of each GUI control moves when its value grows.

    The handle moves in the direction in which the face moves.

    Args:
        table: the GUI controls.
        raw_names: names of all raw controls; words in them give most directions.
        sideways: index of a GUI control -> motion of the face to its own left, as a share of the
            whole motion, -1 to 1.

    Returns:
        RIGHT, LEFT, UP or DOWN for each GUI control, as seen by the viewer.
    """
    raised: dict[int, str] = {}
    for row in table.rows:
        if row.slope > 0.0 and row.high > 0.0:
            raised.setdefault(row.gui, slider_words.short_name(raw_names[row.raw]))
    found = []
    for gui, name in enumerate(table.names):
        led = raised.get(gui, "")
        if not is_beside(table, raw_names, gui):
            found.append(DOWN if _DOWNWARDS.search(led) else UP)
            continue
        word = _BESIDE.search(led)
        side = {"L": 1.0, "R": -1.0}.get(_side_of(_bone_of(name)[0]), 1.0)  # outwards
        share = (1.0 if word[0] == "Left" else -1.0) if word else side
        if abs(sideways.get(gui, 0.0)) > _CLEAR:
            share = sideways[gui]
        found.append(RIGHT if share > 0.0 else LEFT)
    return found


def handles_of(
    table: BoardTable,
    ways: Sequence[Direction],
    region_of: Callable[[str], str],
    taken: Iterable[str] = (),
) -> list[Handle]:
    """Make the handles of a table; GUI controls that differ only in .tx and .ty share a handle.

    Args:
        table: the GUI controls.
        ways: direction on the board in which each GUI control's handle moves when its value grows.
        region_of: stem of a handle -> region.
        taken: bone names that are in use.

    Returns:
        Handles that are not placed yet. A GUI control that drives no raw control or has an empty
        range gets no handle.
    """
    found: dict[str, Handle] = {}
    for gui, name in enumerate(table.names):
        low, high = float(table.lowest[gui]), float(table.highest[gui])
        unit = max(-low, high)
        if not table.outputs_of(gui) or not unit > 0.0:
            continue
        unit = 1.0 if 0.5 <= unit <= 1.5 else unit
        axis = Axis(gui, low / unit, high / unit, unit, ways[gui])
        bone, is_x = _bone_of(name)
        side, stem = _side_of(bone), _stem_of(bone)
        handle = found.get(bone) or Handle(bone, side, region_of(stem), stem, None, None)
        found[bone] = replace(handle, x=axis) if is_x else replace(handle, y=axis)
    labels = names.unique_labels(found, taken)
    return [
        _upright(replace(handle, bone=label))
        for handle, label in zip(found.values(), labels, strict=True)
    ]


def _upright(handle: Handle) -> Handle:
    """The same handle; if both of its axes are horizontal, its y axis is made vertical."""
    if handle.x is None or handle.y is None or handle.y.way in (UP, DOWN):
        return handle
    return replace(handle, y=replace(handle.y, way=UP))


def _bone_of(name: str) -> tuple[str, bool]:
    """The bone of a GUI control, and whether it uses the bone's x axis."""
    stem, _, axis = name.rpartition(".")
    if stem and axis in ("tx", "ty"):
        return stem, axis == "tx"
    return name, False


def _side_of(bone: str) -> str:
    found = _PREFIX.match(bone)
    if found and found[1]:
        return found[1].replace("C", "")
    last = _LAST_SIDE.search(bone)
    return last[0] if last else ""


def _stem_of(bone: str) -> str:
    """A bone's name without prefix and side."""
    found = _PREFIX.match(bone)
    if found and found[1]:
        return bone[found.end() :]
    return _LAST_SIDE.sub("", slider_words.short_name(_PREFIX.sub("", bone))) or bone


def lay_out(handles: Iterable[Handle], titles: Mapping[str, str], is_own: bool = False) -> Board:
    """Place handles on a board and draw the lines around them.

    Args:
        handles: handles that are not placed yet.
        titles: region -> title, in the order of the blocks.
        is_own: True: the face's GUI controls were made from names of raw controls, so all handles
            are placed in rows by region.
    """
    left = list(handles)
    blocks = []
    for title, sides, middle in () if is_own else _FACE:
        block = _face_block(title, sides, middle, left)
        if block is not None:
            blocks.append([block])
    used = {h.bone for row in blocks for b in row for c, _x, _y in b.cells for h, *_ in c.inside}
    left = [handle for handle in left if handle.bone not in used]
    width = max([_NARROWEST, *(block.width for row in blocks for block in row)])
    known = {title for title, _sides, _middle in _FACE}
    named = {r: "Lips" if r == "mouth" and t in known and blocks else t for r, t in titles.items()}
    rest = [_region_block(t, [h for h in left if h.region == r], width) for r, t in named.items()]
    blocks += _shelves([block for block in rest if block is not None], width)
    return _drawn(blocks, width)


def _label(stem: str, region: str) -> list[str]:
    """The label of a handle in upper case, split into short lines.

    Args:
        stem: name of the handle's bone without prefix and side.
        region: region of the face to which the handle belongs.
    """
    words = _LABELS.get(stem.lower()) or slider_words.title_in_region(stem, region, sided=False)
    text = words.upper()
    rows: list[str] = []
    for word in text.split():
        if rows and len(rows[-1]) + 1 + len(word) <= _LONGEST:
            rows[-1] += f" {word}"
        else:
            rows.append(word[:_WIDEST])
    return rows[:_LINES] or ["-"]


def _cell(rows: Sequence[Sequence[Handle]], label: list[str]) -> _Cell:
    """Place handles in centred rows with a label below.

    Args:
        rows: rows of handles, from the top down; each row from left to right.
        label: the lines of the label.
    """
    boxes = [[frame_of(h) for h in row] for row in rows]
    widths = [sum(f[2] - f[0] for f in row) + _GAP * (len(row) - 1) for row in boxes]
    heights = [max(f[3] - f[1] for f in row) for row in boxes]
    text = max(board_letters.width(line, _TEXT) for line in label)
    cell = _Cell(max([text, *widths]), 0.0, label)
    down = 0.0
    for row, row_boxes, width, height in zip(rows, boxes, widths, heights, strict=True):
        across = (cell.width - width) / 2
        for handle, (start, b, end, t) in zip(row, row_boxes, strict=True):
            cell.inside.append((handle, across - start, down - t - (height - (t - b)) / 2))
            across += end - start + _GAP
        down -= height + _GAP
    cell.height = -down - _GAP + 0.16 + len(label) * 1.4 * _TEXT
    return cell


def frame_of(handle: Handle) -> tuple[float, float, float, float]:
    """Left, bottom, right and top of a handle's frame, relative to its rest place."""
    left, bottom, right, top = handle.box()
    half = _TRACK / 2
    return left - half, bottom - half, right + half, top + half


def _face_block(
    title: str, sides: _Columns, middle: _Columns, left: Sequence[Handle]
) -> _Block | None:
    """A block of the handles with known names, or None if the face has none of them.

    Args:
        title: title of the block.
        sides: columns of stems on each side of the face, from the outer edge inwards, as in _FACE.
        middle: columns of stems in the middle.
        left: the handles that are not placed yet.
    """
    by_name = {(h.side, h.stem.lower()): h for h in left}

    def columns(side: str, wanted: _Columns) -> list[list[_Cell]]:
        found = []
        for column in wanted:
            there = [by_name[side, n] for n in column if (side, n) in by_name]
            if there:
                found.append([_cell([[h]], _label(h.stem, h.region)) for h in there])
        return found

    outer, inner = columns("R", sides), columns("L", sides)[::-1]
    row = [*outer, *columns("", middle), *inner]
    if not row:
        return None
    block = _Block(title)
    stacked = [column for column in row if len(column) > 1]
    second = max((column[0].height for column in stacked), default=0.0) + _GAP / 2
    for column in row:
        wide = max(cell.width for cell in column)
        for number, cell in enumerate(column):
            down = -second * number
            block.cells.append((cell, block.width + (wide - cell.width) / 2, down))
            block.height = max(block.height, cell.height - down)
        block.width += wide + _GAP
    block.width -= _GAP
    return block


def _region_block(title: str, handles: Sequence[Handle], width: float) -> _Block | None:
    """A block of the remaining handles of a region in rows, or None if there are none.

    Args:
        title: title of the block.
        handles: the handles of the region.
        width: width of the board between its margins, in board units.
    """
    if not handles:
        return None
    block = _Block(title)
    rows = _rows_of(_cells_of(handles), width - 2 * _MARGIN)
    widths = [sum(cell.width + _GAP for cell in row) - _GAP for row in rows]
    block.width = max(widths)
    for row, wide in zip(rows, widths, strict=True):
        across = (block.width - wide) / 2
        for cell in row:
            block.cells.append((cell, across, -block.height))
            across += cell.width + _GAP
        block.height += max(cell.height for cell in row) + _GAP
    block.height -= _GAP
    return block


def _rows_of(cells: Sequence[_Cell], width: float) -> list[list[_Cell]]:
    """Distribute cells over the smallest number of rows, so that the rows have similar widths.

    Args:
        cells: the cells of a block, in their order.
        width: largest width of a row, in board units.
    """
    total = sum(cell.width + _GAP for cell in cells)
    share = total / max(1.0, np.ceil(total / width))
    rows: list[list[_Cell]] = [[]]
    taken = 0.0
    for cell in cells:
        if rows[-1] and (taken + cell.width / 2 > share or taken + cell.width > width):
            rows.append([])
            taken = 0.0
        rows[-1].append(cell)
        taken += cell.width + _GAP
    return rows


def _cells_of(handles: Sequence[Handle]) -> list[_Cell]:
    """Make a cell for each stem of handles. The cells are sorted by height, the lowest first.

    Short handles on a side of the face whose stems differ only in a final U or D, for the upper and
    the lower lip, share a cell.
    """
    groups: dict[str, list[Handle]] = {}
    stems = {h.stem for h in handles}
    for handle in handles:
        key = _LIP.sub("", handle.stem)
        short = handle.box()[3] - handle.box()[1] < 1.5
        both = short and {f"{key}U", f"{key}D"} <= stems and handle.side
        groups.setdefault(key if both else handle.stem, []).append(handle)
    cells = []
    for stem, members in groups.items():
        upper = [h for h in members if h.stem in (f"{stem}U", stem)]
        lower = [h for h in members if h not in upper]
        order = {"R": 0, "": 1, "L": 2}
        rows = [sorted(row, key=lambda h: order[h.side]) for row in (upper, lower) if row]
        cells.append(_cell(rows, _label(stem, members[0].region)))
    return sorted(cells, key=lambda cell: round(cell.height, 1))


def _shelves(blocks: Sequence[_Block], width: float) -> list[list[_Block]]:
    """Arrange blocks in rows; each row gets as many of the next blocks as fit into it.

    Args:
        blocks: the blocks, in their order.
        width: largest width of a row, in board units.
    """
    rows: list[list[_Block]] = []
    for block in blocks:
        taken = sum(b.width + 2 * _MARGIN for b in rows[-1]) if rows else width
        if rows and taken + block.width <= width:
            rows[-1].append(block)
        else:
            rows.append([block])
    return rows


def _drawn(rows: Sequence[Sequence[_Block]], width: float) -> Board:
    """Make the board from its rows of blocks: compute the places of handles, and draw all lines.

    Args:
        rows: rows of blocks, from the top down.
        width: width of the board between its margins, in board units.
    """
    handles: list[Handle] = []
    lines: list[Line] = []
    down = -_MARGIN
    for row in rows:
        used = sum(block.width for block in row) + 2 * _MARGIN * (len(row) - 1)
        across = (width - used) / 2
        lines.append([(0.0, down), (width, down)])
        room = across - board_letters.width(row[0].title, _TITLE)
        below = _GAP if len(row) == 1 and room > _GAP else _TITLE + 0.5
        for block in row:
            left = across if len(row) > 1 else 0.0
            lines += board_letters.lines(block.title, left, down - 0.2 - _TITLE, _TITLE)
            for cell, x, y in block.cells:
                _draw(cell, across + x, down - below + y, handles, lines)
            across += block.width + 2 * _MARGIN
        down -= max(block.height for block in row) + below + _GAP
    height = -down
    total, middle = width + 2 * _MARGIN, (width / 2, down / 2)
    corners = [(-_MARGIN, 0.0), (width + _MARGIN, 0.0), (width + _MARGIN, down), (-_MARGIN, down)]
    shifted = [_moved(line, middle) for line in lines]
    placed = [replace(h, place=_moved([h.place], middle)[0]) for h in handles]
    border = [_moved([*corners, corners[0]], middle)]
    return Board(tuple(placed), tuple(shifted), tuple(border), total, height)


def _draw(cell: _Cell, x: float, y: float, handles: list[Handle], lines: list[Line]) -> None:
    """Add the handles and lines of a cell to the board.

    Args:
        cell: the cell.
        x, y: upper left corner of the cell on the board.
        handles: receives the handles of the cell, with their places.
        lines: receives the frames and the label of the cell.
    """
    for handle, across, down in cell.inside:
        place = (x + across, y + down)
        handles.append(replace(handle, place=place))
        lines += [_moved(line, (-place[0], -place[1])) for line in track_of(handle)]
    bottom = y - cell.height
    for number, text in enumerate(reversed(cell.label)):
        start = x + (cell.width - board_letters.width(text, _TEXT)) / 2
        lines += board_letters.lines(text, start, bottom + number * 1.4 * _TEXT, _TEXT)


def track_of(handle: Handle) -> list[Line]:
    """Lines of a handle's frame and its mark at rest, relative to the handle's rest place."""
    left, bottom, right, top = frame_of(handle)
    frame = [(left, bottom), (right, bottom), (right, top), (left, top), (left, bottom)]
    if handle.x is not None and handle.y is not None:
        return [frame, [(left, 0.0), (right, 0.0)], [(0.0, bottom), (0.0, top)]]
    mark = (
        [(left, 0.0), (right, 0.0)] if top - bottom > right - left else [(0.0, bottom), (0.0, top)]
    )
    return [frame, mark]


def _moved(line: Sequence[Point], by: Point) -> Line:
    return [(x - by[0], y - by[1]) for x, y in line]


def limits(handles: Sequence[Handle]) -> tuple[Doubles, Doubles]:
    """Lowest and highest location of each handle's bone along its x and y, float64[H, 2] each."""
    ends = [[(a.low, a.high) if a else (0.0, 0.0) for a in (h.x, h.y)] for h in handles]
    both = np.array(ends, np.float64).reshape(-1, 2, 2)
    return both[:, :, 0], both[:, :, 1]
