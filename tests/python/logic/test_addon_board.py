# SPDX-License-Identifier: MIT
"""Tests the face board without Blender: its table, its fit to raw controls and its layout."""

from __future__ import annotations

import importlib
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from risorius.controls import regions
from risorius_people import controls as sample_controls
from test_addon_logic import space  # noqa: F401  registers the package of the logic

table_of: Any = importlib.import_module("risorius_addon_logic.character.board_table")
fitting: Any = importlib.import_module("risorius_addon_logic.character.board_fit")
layout: Any = importlib.import_module("risorius_addon_logic.character.board_layout")
letters: Any = importlib.import_module("risorius_addon_logic.character.board_letters")

Rows = list[tuple[int, int, float, float, float, float]]


def _of_rows(names: list[str], rows: Rows, raw: int) -> Any:
    return table_of.of_file(names, np.array(rows, np.float64).T, raw)


@pytest.fixture(scope="module")
def sample() -> tuple[Any, list[str]]:
    """The GUI table of the sample man and the names of its raw controls."""
    rows: Rows = []
    names, raw = [], []
    for gui, ways in sample_controls.gui_table():
        names.append(gui)
        for name, numbers in ways:
            if name not in raw:
                raw.append(name)
            rows.append((len(names) - 1, raw.index(name), *(float(n) for n in numbers)))
    return _of_rows(names, rows, len(raw)), raw


@pytest.fixture(scope="module")
def board(sample: tuple[Any, list[str]]) -> Any:
    table, raw = sample
    handles = layout.handles_of(table, layout.ways_of(table, raw, {}), regions.region_of)
    return layout.lay_out(handles, regions.TITLES)


def _raw_by_hand(table: Any, gui: np.ndarray) -> np.ndarray:
    """Raw controls for GUI values, calculated row by row from the table."""
    out = np.zeros(table.raw_count)
    done = set()
    for row in table.rows:
        value = gui[row.gui]
        if (row.gui, row.raw) not in done and row.low <= value <= row.high:
            out[row.raw] += row.slope * value + row.cut
            done.add((row.gui, row.raw))
    return out.clip(0.0, 1.0)


def _random_gui(table: Any, count: int) -> np.ndarray:
    share = np.random.default_rng(3).random((count, len(table.names)))
    return table.lowest + share * (table.highest - table.lowest)


def test_a_table_gives_what_its_rows_say(sample: tuple[Any, list[str]]) -> None:
    table, _raw = sample
    gui = _random_gui(table, 20)
    wanted = np.stack([_raw_by_hand(table, row) for row in gui])
    assert np.abs(table.raw(gui) - wanted).max() < 1e-12
    assert table.lowest.min() == -1.0
    assert table.highest.max() == 1.0
    assert table.reached.all()


def test_rows_that_are_no_numbers_or_never_hold_are_left_out() -> None:
    good = (0, 0, 0.0, 1.0, 1.0, 0.0)
    bad = [(0, 0, 1.0, 0.0, 1.0, 0.0), (0, 0, 0.0, np.nan, 1.0, 0.0), (7, 0, 0.0, 1.0, 1.0, 0.0)]
    table = _of_rows(["CTRL_C_jaw.ty"], [good, *bad], 1)
    assert len(table.rows) == 1
    assert table.raw([[0.25]]).tolist() == [[0.25]]


def test_a_fit_finds_the_way_back(sample: tuple[Any, list[str]]) -> None:
    table, _raw = sample
    wanted = table.raw(_random_gui(table, 12))
    gui = fitting.fit(table, wanted, np.zeros((12, len(table.names))))
    assert (gui >= table.lowest).all()
    assert (gui <= table.highest).all()
    assert np.abs(table.raw(gui) - wanted).max() < 1e-6


def test_a_fit_of_controls_that_share_an_output_is_the_least_squares_one() -> None:
    # The sliders a and b set raw control 0 to a + b and raw control 1 to a. The raw values 0.9 and
    # 0.2 need a = 0.2 and b = 0.7.
    rows: Rows = [
        (0, 0, 0.0, 1.0, 1.0, 0.0),
        (0, 1, 0.0, 1.0, 1.0, 0.0),
        (1, 0, 0.0, 1.0, 1.0, 0.0),
    ]
    table = _of_rows(["a.ty", "b.ty"], rows, 2)
    gui = fitting.fit(table, [[0.9, 0.2]], [[0.0, 0.0]])
    assert np.abs(gui - [[0.2, 0.7]]).max() < 1e-3


def test_what_a_fit_loses_is_said_by_name() -> None:
    """If one slider should be 0.5 up and 0.3 down at once, the loss names the smaller control."""
    rows: Rows = [(0, 0, 0.0, 1.0, 1.0, 0.0), (0, 1, -1.0, 0.0, -1.0, 0.0)]
    table = _of_rows(["a.ty"], rows, 2)
    gui = fitting.fit(table, [[0.5, 0.3]], [[0.0]])
    assert gui.tolist() == [[0.5]]
    loss = fitting.loss(["up", "down"], [[0.5, 0.3]], table.raw(gui), table.reached, 0.01)
    assert loss.largest == pytest.approx(0.3)
    assert loss.worst == (("down", pytest.approx(0.3)),)


def test_a_file_without_gui_controls_gets_opposites_on_one_slider() -> None:
    names = [
        "CTRL_expressions.jawOpen", "CTRL_expressions.jawLeft", "CTRL_expressions.jawRight",
        "CTRL_expressions.eyeLookUpL", "CTRL_expressions.eyeLookDownL",
        "CTRL_expressions.eyeLookLeftL", "CTRL_expressions.eyeLookRightL",
        "CTRL_expressions.tongueOut", "CTRL_expressions.tongueIn", "CTRL_expressions.browDownL",
        "Upside", "part_qx",
    ]  # fmt: skip
    table = table_of.of_raw_controls(names, [0.0] * 11 + [-1.0])
    assert table.names == (
        "CTRL_jawOpen.ty", "CTRL_jaw.tx", "CTRL_eyeLookL.ty", "CTRL_eyeLookL.tx",
        "CTRL_tongueOutIn.ty", "CTRL_browDownL.ty", "CTRL_Upside.ty",
    )  # fmt: skip
    assert table.reached.tolist() == [True] * 11 + [False]
    gui = _random_gui(table, 9)
    wanted = np.stack([_raw_by_hand(table, row) for row in gui])
    assert np.abs(table.raw(gui) - wanted).max() < 1e-12
    own = np.stack([table.own_raw(row.astype(np.float32)) for row in gui])
    assert np.abs(own - wanted).max() < 1e-6
    handles = layout.handles_of(table, layout.ways_of(table, names, {}), regions.region_of)
    look = next(handle for handle in handles if handle.bone == "CTRL_eyeLookL")
    assert (look.x.gui, look.y.gui, look.side, look.region) == (3, 2, "L", "eye")


def _frames(board: Any) -> list[tuple[float, float, float, float]]:
    found = []
    for handle in board.handles:
        left, bottom, right, top = handle.box()
        x, y = handle.place
        found.append((x + left, y + bottom, x + right, y + top))
    return found


def test_each_control_has_its_handle_and_its_range(
    board: Any, sample: tuple[Any, list[str]]
) -> None:
    table, _raw = sample
    axes = [axis for handle in board.handles for axis in handle.axes]
    assert sorted(axis.gui for axis in axes) == list(range(len(table.names)))
    for axis in axes:
        ends = axis.low * axis.unit, axis.high * axis.unit
        assert ends == (table.lowest[axis.gui], table.highest[axis.gui])
    assert len({handle.bone for handle in board.handles}) == len(board.handles)


def test_frames_keep_apart_and_inside_the_board(board: Any) -> None:
    frames = _frames(board)
    for (l1, b1, r1, t1), (l2, b2, r2, t2) in combinations(frames, 2):
        assert l1 >= r2 or l2 >= r1 or b1 >= t2 or b2 >= t1
    half = board.width / 2, board.height / 2
    points: list[Any] = [point for line in board.lines for point in line]
    points += [
        corner for left, bottom, right, top in frames for corner in ((left, bottom), (right, top))
    ]
    assert all(abs(x) <= half[0] + 1e-9 and abs(y) <= half[1] + 1e-9 for x, y in points)


def test_a_board_lies_as_one_sees_a_face(board: Any) -> None:
    by_stem: dict[str, dict[str, tuple[float, float]]] = {}
    for handle in board.handles:
        by_stem.setdefault(handle.stem, {})[handle.side] = handle.place
    for stem, sides in by_stem.items():
        if {"L", "R"} <= set(sides):
            assert sides["L"][0] > sides["R"][0], stem  # the character's left is the viewer's right
            assert sides["L"][1] == pytest.approx(sides["R"][1]), stem
    rows = [by_stem[stem]["L"][1] for stem in ("brow_raiseIn", "eye", "nose", "mouth_corner")]
    rows.append(by_stem["jaw"][""][1])
    assert rows == sorted(rows, reverse=True)
    assert abs(by_stem["mouth"][""][0]) < 1.0


def test_handles_go_as_the_face_goes(sample: tuple[Any, list[str]]) -> None:
    table, raw = sample
    ways = dict(zip(table.names, layout.ways_of(table, raw, {}), strict=True))
    assert ways["CTRL_C_jaw.ty"] == layout.DOWN
    assert ways["CTRL_L_eye_blink.ty"] == layout.DOWN
    assert ways["CTRL_L_mouth_cornerPull.ty"] == layout.UP
    assert ways["CTRL_L_eye.tx"] == ways["CTRL_R_eye.tx"] == layout.RIGHT
    assert ways["CTRL_L_mouth_corner.tx"] == layout.RIGHT
    assert ways["CTRL_R_mouth_corner.tx"] == layout.LEFT  # wide is outwards
    assert ways["CTRL_C_mouth_lipShiftU.ty"] == layout.RIGHT
    jaw = table.names.index("CTRL_C_jaw.tx")
    measured = layout.ways_of(table, raw, {jaw: -0.4})  # a face whose left is the viewer's left
    assert measured[jaw] == layout.LEFT


def test_a_range_of_another_size_is_one_unit_of_the_board() -> None:
    table = _of_rows(["CTRL_C_turn.ty"], [(0, 0, -90.0, 45.0, 0.01, 0.0)], 1)
    (handle,) = layout.handles_of(table, layout.ways_of(table, ["x"], {}), regions.region_of)
    assert (handle.y.low, handle.y.high, handle.y.unit) == (-1.0, 0.5, 90.0)


def test_unknown_names_lie_in_rows_too_and_none_is_lost() -> None:
    names = [f"weird_{i}.ty" for i in range(90)] + ["", "CTRL_L_.ty", "x" * 90 + ".ty", "ß.tx"]
    rows: Rows = [(i, 0, 0.0, 1.0, 1.0, 0.0) for i in range(len(names))]
    table = _of_rows(names, rows, 1)
    handles = layout.handles_of(
        table, layout.ways_of(table, ["x"], {}), regions.region_of, ["face"]
    )
    board = layout.lay_out(handles, regions.TITLES)
    assert len(board.handles) == len(names)
    assert all(1 <= len(handle.bone.encode()) <= 63 for handle in board.handles)
    test_frames_keep_apart_and_inside_the_board(board)


def test_letters_stand_side_by_side_in_their_height() -> None:
    assert letters.width("", 1.0) == 0.0
    points = [p for line in letters.lines("Lips-3", 2.0, 5.0, 0.6) for p in line]
    xs, ys = zip(*points, strict=True)
    assert min(xs) == pytest.approx(2.0)
    assert max(xs) <= 2.0 + letters.width("LIPS-3", 0.6) + 1e-9
    assert (min(ys), max(ys)) == (pytest.approx(5.0), pytest.approx(5.6))
