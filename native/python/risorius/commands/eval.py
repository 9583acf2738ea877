# SPDX-License-Identifier: MIT
"""risorius eval: the pose that some control values give."""

from __future__ import annotations

import argparse
import difflib
import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import risorius

ATTRIBUTES = ("tx", "ty", "tz", "rx", "ry", "rz", "sx", "sy", "sz")
Floats = npt.NDArray[np.float32]


class CommandLineError(Exception):
    """What was typed does not fit the file."""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    parser = subparsers.add_parser(
        "eval",
        help="the pose that some control values give",
        description="Prints every joint, blend shape channel and animated map that is not at rest. "
        "Joint values are deltas from neutral in the file's units and axes; scale 0 is no scale.",
    )
    parser.add_argument("file", type=Path)
    parser.add_argument("controls", nargs="*", metavar="NAME=VALUE", help="the rest is 0")
    parser.add_argument("--gui", action="store_true", help="the names are of GUI controls")
    parser.add_argument("--lod", type=int, default=0, metavar="N", help="0 is the finest (default)")
    parser.add_argument("--json", action="store_true", help="for a program")
    parser.set_defaults(func=run)


def parse_controls(texts: list[str], names: list[str]) -> Floats:
    """Control values from NAME=VALUE texts.

    Args:
        texts: as typed; a later one of the same name wins.
        names: of all controls.

    Returns:
        float32[names].

    Raises:
        CommandLineError: a text of another form, an unknown name, not a finite number.
    """
    index = {name: i for i, name in enumerate(names)}
    values = np.zeros(len(names), np.float32)
    for text in texts:
        name, equals, number = text.rpartition("=")
        if not equals:
            raise CommandLineError(f"NAME=VALUE was expected, found {text!r}")
        if name not in index:
            near = [n for n in names if n.rpartition(".")[2] == name]
            near = near or difflib.get_close_matches(name, names, 3, 0.5)
            hint = f"; near it: {', '.join(near)}" if near else ""
            raise CommandLineError(f"there is no control {name!r}{hint}")
        try:
            value = float(number)
        except ValueError:
            value = math.nan
        if not math.isfinite(value) or abs(value) > np.finfo(np.float32).max:
            raise CommandLineError(f"{name}: a number was expected, found {number!r}")
        values[index[name]] = value
    return values


def active(values: Floats, names: list[str], first: int = 0) -> list[dict[str, Any]]:
    """Name, index and value of what is not 0; names that run out are control numbers."""
    return [
        {
            "name": names[i] if i < len(names) else f"control {first + i}",
            "index": first + int(i),
            "value": shortest(values[i]),
        }
        for i in np.flatnonzero(values)
    ]


def shortest(value: np.float32) -> float:
    """The float with the fewest digits that is the same float32."""
    return float(np.format_float_scientific(value, unique=True))


def describe(dna: risorius.Dna, rig: risorius.Rig, raw: Floats, lod: int) -> dict[str, Any]:
    """Everything that the command prints, as plain values."""
    pose = rig.evaluate(raw, lod=lod)
    joints = [
        {"name": dna.joint_names[j], "index": int(j)}
        | {a: shortest(v) for a, v in zip(ATTRIBUTES, pose.joints[j], strict=True)}
        for j in np.flatnonzero(np.any(pose.joints != 0, axis=1))
    ]
    return {
        "lod": lod,
        "translation_unit": dna.translation_unit,
        "rotation_unit": dna.rotation_unit,
        "raw_controls": active(raw, rig.raw_control_names),
        "derived_controls": active(pose.controls[len(raw) :], [], len(raw)),
        "joints": joints,
        "blend_shapes": active(pose.blend_shapes, dna.blend_shape_channel_names),
        "animated_maps": active(pose.animated_maps, dna.animated_map_names),
        "ignored_layers": rig.ignored_layers,
    }


def page(facts: dict[str, Any]) -> str:
    """The facts for a person."""
    width = max(
        [len(row["name"]) for rows in facts.values() if isinstance(rows, list)
         for row in rows if isinstance(row, dict)],
        default=0,
    )  # fmt: skip
    out = [f"LOD {facts['lod']}"]
    for key in ("raw_controls", "derived_controls", "blend_shapes", "animated_maps"):
        out.append(f"\n{key.replace('_', ' ')}")
        out += [f"  {row['name']:<{width}}  {row['value']:>12.6g}" for row in facts[key]]
        if not facts[key]:
            out.append("  none")
    out.append(f"\njoints ({facts['translation_unit']}, {facts['rotation_unit']})")
    if not facts["joints"]:
        return "\n".join([*out, "  none"])
    out.append("  ".join([" " * (width + 2), *(f"{a:>10}" for a in ATTRIBUTES)]).rstrip())
    for row in facts["joints"]:
        numbers = (f"{row[a]:>10.5g}" for a in ATTRIBUTES)
        out.append("  ".join([f"  {row['name']:<{width}}", *numbers]))
    return "\n".join(out)


def run(args: argparse.Namespace) -> int:
    dna = risorius.load(args.file, layers="all")
    rig = risorius.Rig(dna)
    try:
        if not 0 <= args.lod < max(1, rig.lod_count):
            raise CommandLineError(f"--lod: 0 to {max(1, rig.lod_count) - 1} was expected")
        names = rig.gui_control_names if args.gui else rig.raw_control_names
        values = parse_controls(args.controls, names)
    except CommandLineError as error:
        print(f"risorius: {error}", file=sys.stderr)
        return 2
    facts = describe(dna, rig, rig.gui_to_raw(values) if args.gui else values, args.lod)
    if rig.ignored_layers:
        print(
            f"risorius: not evaluated by this version: {', '.join(rig.ignored_layers)}",
            file=sys.stderr,
        )
    print(json.dumps(facts, indent=2) if args.json else page(facts))
    return 0
