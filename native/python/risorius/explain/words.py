# SPDX-License-Identifier: MIT
"""Writes the facts of explain() as sentences."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from ..controls.control_names import last_part

Facts = dict[str, Any]
T = TypeVar("T")
_PARTS = 5  # most controls that the line of a joint names


def page(facts: Facts, top: int = 10) -> str:
    """The facts as text.

    Args:
        facts: the result of explain().
        top: largest number of lines per list, but at least 20 for the raw controls; further
            entries are only counted.
    """
    sections = [
        _raw(facts, top),
        _correctives(facts, top),
        _solvers(facts, top),
        _networks(facts, top),
        _setups(facts, top),
        _joints(facts, top),
        _shapes(facts, top),
        _maps(facts, top),
    ]
    return "\n\n".join("\n".join(lines) for lines in sections if lines)


def _number(value: float) -> str:
    return f"{value:.4g}"


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}{'' if count == 1 else 's'}"


def _listed(rows: Sequence[T], top: int, line: Callable[[T], str]) -> list[str]:
    out = [f"  {line(row)}" for row in rows[:top]]
    return [*out, f"  ... and {len(rows) - top} more"] if len(rows) > top else out


def _name(row: Facts) -> str:
    return last_part(row["name"]) or row["name"]


def _valued(row: Facts) -> str:
    return f"{_name(row)} {_number(row['value'])}"


def _interval(row: Facts) -> str:
    slope, cut = _number(row["slope"]), _number(row["cut"])
    sign = "" if row["cut"] < 0 else "+"
    return (
        f"{_valued(row)} in {_number(row['from'])}..{_number(row['to'])}"
        f" gives {slope} * value {sign}{cut}"
    )


# ---- controls


def _raw(facts: Facts, top: int) -> list[str]:
    rows = facts["raw_controls"]
    head = f"LOD {facts['lod']}: "
    if not rows:
        return [head + "every raw control is at rest"]

    def line(row: Facts) -> str:
        odd = "  (outside 0..1, and not clamped)" if row["is_outside_0_1"] else ""
        made = "; ".join(_interval(g) for g in row["from_gui"])
        return f"{_valued(row)}{odd}" + (f"  <- {made}" if made else "")

    verb = "is" if len(rows) == 1 else "are"
    return [
        head + f"{_counted(len(rows), 'raw control')} {verb} on",
        *_listed(rows, max(top, 20), line),
    ]


def _factors(row: Facts) -> str:
    text = " * ".join(_factor(f) for f in row["factors"])
    return text if row["weight"] == 1 else f"{text}, weight {_number(row['weight'])}"


def _factor(factor: Facts) -> str:
    clamped = factor["used"] != factor["value"]
    return _valued(factor) + (f" (counts as {_number(factor['used'])})" if clamped else "")


def _correctives(facts: Facts, top: int) -> list[str]:
    correctives = facts["correctives"]
    if correctives["count"] == 0:
        return []
    count, all_of_them = len(correctives["fire"]), _counted(correctives["count"], "corrective")
    out = [f"{count if count else 'none'} of {all_of_them} {_verb(count, 'fire')}"]
    out += _listed(
        correctives["fire"],
        top,
        lambda row: f"{row['name']} = {_number(row['value'])}: {_factors(row)}",
    )
    if correctives["lack_one"]:
        count = len(correctives["lack_one"])
        out += ["", f"{_counted(count, 'corrective')} {_verb(count, 'lack')} one control only"]
        out += _listed(correctives["lack_one"], top, _near_miss)
    if correctives["rest_at_this_lod"]:
        count = len(correctives["rest_at_this_lod"])
        out += [
            "",
            f"{_counted(count, 'corrective')} {_verb(count, 'rest')} although all controls are on",
        ]
        out += _listed(
            correctives["rest_at_this_lod"],
            top,
            lambda r: f"{r['name']} ({_factors(r)}): {r['reason']}",
        )
    return out


def _verb(count: int, word: str) -> str:
    return word + ("s" if count == 1 else "")


def _near_miss(row: Facts) -> str:
    missing = row["missing"]["index"]
    there = " and ".join(_valued(f) for f in row["factors"] if f["index"] != missing)
    return (
        f"{row['name']} lacks {_name(row['missing'])} ({there} there);"
        f" with it at 1: {_number(row['would_be'])}"
    )


# ---- solvers, networks, setups


def _solvers(facts: Facts, top: int) -> list[str]:
    out: list[str] = []
    for solver in facts["solvers"]:
        unit = " degrees" if solver["distance_unit"] else ""
        on = [_pose(p, unit) for p in solver["poses"] if p["weight"] != 0]
        said = f"{len(on)} of {_counted(len(solver['poses']), 'pose')} on" if on else "no pose on"
        out += ["", f"{solver['name']} (distance: {solver['distance_method']}): {said}"]
        out += _listed(on, top, lambda text: text)
        off = [p for p in solver["poses"] if p["weight"] == 0 and p["distance"] is not None]
        if off:
            near = min(off, key=lambda p: p["distance"])
            far = f"{_number(near['distance'])}{unit}"
            out.append(f"  nearest of the others: {near['name']}, at {far}")
    return out[1:]


def _pose(pose: Facts, unit: str) -> str:
    weight, distance = _number(pose["weight"]), _number(pose["distance"])
    return f"{pose['name']} weighs {weight}, at {distance}{unit}{_outputs(pose)}"


def _outputs(pose: Facts) -> str:
    written = ", ".join(
        _name(o) + ("" if o["weight"] == 1 else f" * {_number(o['weight'])}")
        for o in pose["outputs"]
    )
    return f", writes {written}" if written else ""


def _networks(facts: Facts, top: int) -> list[str]:
    rows = facts["networks"]
    if not rows:
        return []

    def line(row: Facts) -> str:
        regions = f" ({', '.join(row['regions'])})" if row["regions"] else ""
        read = ", ".join(_valued(i) for i in row["inputs"][:_PARTS]) or "only zeros"
        written = ", ".join(_valued(o) for o in row["outputs"][:_PARTS]) or "only zeros"
        return (
            f"network {row['index']}{regions} reads {read}"
            f" and writes {len(row['outputs'])} of {row['output_count']}: {written}"
        )

    return [
        f"{_counted(len(rows), 'network')} {_verb(len(rows), 'run')}", *_listed(rows, top, line)
    ]  # fmt: skip


def _setups(facts: Facts, top: int) -> list[str]:
    rows = facts["twists_and_swings"]
    if not rows:
        return []

    def line(row: Facts) -> str:
        joints = ", ".join(f"{j['name']} * {_number(j['weight'])}" for j in row["joints"][:_PARTS])
        about = "about" if row["kind"] == "twist" else "away from"
        return (
            f"{row['kind']} of {_name(row['inputs'][0])} ...: {_number(row['degrees'])} degrees"
            f" {about} {row['axis']}, spread over {joints}"
        )

    return ["twists and swings", *_listed(rows, top, line)]


# ---- joints, shapes, maps


def _joints(facts: Facts, top: int) -> list[str]:
    rows = facts["joints"]
    if not rows:
        return ["no joint moves"]
    head = f"{len(rows)} of {_counted(facts['joint_count'], 'joint')} {_verb(len(rows), 'move')}"
    if len(rows) > 1:
        head += ", these most"
    unit = facts["translation_unit"]
    return [head, *_listed(rows, top, lambda row: _joint(row, unit))]


def _joint(row: Facts, unit: str) -> str:
    done = []
    if row["distance"] > 0:
        done.append(f"moves {_number(row['distance'])} {unit}")
    if row["degrees"] > 0:
        done.append(f"turns {_number(row['degrees'])} degrees")
    if row["scale"] > 0:
        done.append(f"scales by {_number(row['scale'])}")
    named = [p for p in row["by"] if abs(p["share"]) >= 0.01][:_PARTS]
    why = ", ".join(
        f"{_name(p)} {p['share']:.0%}" + (" (against it)" if p["share"] < 0 else "") for p in named
    )
    others = len(row["by"]) - len(named)
    if others:
        left = sum(p["share"] for p in row["by"]) - sum(p["share"] for p in named)
        why += f", {_counted(others, 'other')} {left:.0%}"
    return f"{row['name']} {', '.join(done)}: {why}"


def _shapes(facts: Facts, top: int) -> list[str]:
    rows = facts["blend_shapes"]
    if not rows:
        return []
    return [
        f"{_counted(len(rows), 'blend shape channel')} on",
        *_listed(rows, top, lambda r: f"{_valued(r)}, by {_valued(r['by'])}"),
    ]


def _maps(facts: Facts, top: int) -> list[str]:
    rows = facts["animated_maps"]
    if not rows:
        return []

    def line(row: Facts) -> str:
        rest = f" ({_number(row['at_rest'])} at rest)" if row["at_rest"] else ""
        return f"{_valued(row)}{rest}, by {'; '.join(_interval(b) for b in row['by'])}"

    return [f"{_counted(len(rows), 'animated map')} on", *_listed(rows, top, line)]
