# SPDX-License-Identifier: MIT
"""risorius eval: prints the pose for control values, or writes every frame of a clip."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import risorius
from risorius import explain
from risorius.base.given import GivenError, finite_text

from . import eval_clip
from .files import CommandLineError, whole_number

ATTRIBUTES = ("tx", "ty", "tz", "rx", "ry", "rz", "sx", "sy", "sz")
_NOISE = 1e-9  # smaller values are not printed; in cm, m, degrees, radians or scale
Floats = npt.NDArray[np.float32]


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    parser = subparsers.add_parser(
        "eval",
        help="evaluate a pose of control values, or every frame of a clip",
        usage="%(prog)s DNA [NAME=VALUE ...] [--lod N] [--gui] [--explain [--top N]] [--json]\n"
        "       %(prog)s CLIP DNA -o OUT.npz|OUT.csv [--lod N] [--rate R] [--frames A:B]\n"
        "                     [--what LIST] [--quaternions] [--compress] [--json]",
        description="One pose, without -o: prints every joint, blend shape channel and animated "
        "map that is not at rest. "
        "Joint values are deltas from neutral in the file's units and axes; scale 0 is no scale. "
        "A value may lie outside 0..1: raw controls are not clamped, correctives clamp their "
        "factors, GUI controls outside every interval of their table have no effect. "
        "With -o, evaluates every frame of a clip (.rzc, CSV, JSON, any supported capture) on a "
        "character and writes the animation; controls without a curve are at rest.",
    )
    parser.add_argument("file", type=Path, metavar="DNA or CLIP")
    parser.add_argument(
        "controls",
        nargs="*",
        metavar="NAME=VALUE or DNA",
        help="control values of one pose; other controls are at rest; a part of a name or an ARKit "
        "name is enough if it matches one control only (or its left and right)",
    )
    parser.add_argument(
        "--explain",
        action="store_true",
        help="explain the pose in words: active correctives, solvers and networks, the joints that "
        "move most, and the share of each control",
    )
    parser.add_argument(
        "--top",
        type=whole_number(0, 1_000_000),
        default=10,
        metavar="N",
        help="lines per list of --explain (10)",
    )
    parser.add_argument("--gui", action="store_true", help="the names are GUI controls")
    parser.add_argument(
        "--lod",
        type=whole_number(0, 65_535),
        default=0,
        metavar="N",
        help="0 is the finest (default)",
    )
    parser.add_argument("--json", action="store_true", help="print JSON")
    eval_clip.add_options(parser)
    parser.set_defaults(func=run)


def parse_controls(texts: list[str], names: list[str], rest: Floats) -> Floats:
    """Parse NAME=VALUE texts; full names of abbreviated controls are printed to stderr.

    A name such as an ARKit unit, or a part of a name with both sides, may mean several controls.
    Each of them gets the value times its weight.

    Args:
        texts: the texts as typed; for a repeated name the last value is used.
        names: names of all controls.
        rest: float32[names], values of the controls that `texts` does not name.

    Returns:
        float32[names], all values.

    Raises:
        CommandLineError: a text has another form, a name has no meaning or several meanings, or a
            value is not a finite number.
    """
    index = {name: i for i, name in enumerate(names)}
    values = rest.copy()
    for text in texts:
        name, equals, number = text.rpartition("=")
        if not equals:
            raise CommandLineError(f"NAME=VALUE was expected, found {text!r}")
        try:
            meaning = explain.find_controls(name, names)
        except explain.UnknownControlError as error:
            raise CommandLineError(str(error)) from None
        try:
            value = finite_text(number)
        except GivenError as error:
            raise CommandLineError(f"{name}: {error}") from None
        for control, factor in meaning.controls.items():
            values[index[control]] = value * factor
        if not meaning.is_exact:
            taken = ", ".join(f"{c}={value * f:g}" for c, f in meaning.controls.items())
            print(f"risorius: {text} was taken for {taken}", file=sys.stderr)
    return values


def raw_of_gui(dna: risorius.Dna, rig: risorius.Rig, gui: Floats) -> Floats:
    """Convert values of GUI controls to values of raw controls, float32[raw controls].

    Raw controls that no GUI control drives keep their initial value.

    Args:
        dna: the face.
        rig: the rig compiled from `dna`.
        gui: float32[GUI controls].
    """
    raw = rig.gui_to_raw(gui)
    beside = np.ones(len(raw), bool)
    beside[dna.gui_to_raw.output_indices] = False
    raw[beside] = rig.initial_raw_controls[beside]
    return raw


def active(values: Floats, names: list[str], first: int = 0) -> list[dict[str, Any]]:
    """Name, index and value of each nonzero value.

    Args:
        values: float32[n].
        names: names of the values; a value without a name is called "control" and its index.
        first: index of the control whose value is values[0].
    """
    return [
        {
            "name": names[i] if i < len(names) else f"control {first + i}",
            "index": first + int(i),
            "value": shortest(values[i]),
        }
        for i in np.flatnonzero(values)
    ]


def shortest(value: np.float32) -> float:
    """The shortest decimal that rounds to the same float32."""
    return float(np.format_float_scientific(value, unique=True))


def describe(dna: risorius.Dna, rig: risorius.Rig, raw: Floats, lod: int) -> dict[str, Any]:
    """All facts about a pose that `risorius eval` prints, as plain values.

    Args:
        dna: the face.
        rig: the rig compiled from `dna`.
        raw: float32[raw controls].
        lod: the LOD, from 0.
    """
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


def _moved(value: float) -> bool:
    return not abs(value) < _NOISE  # True for NaN too


def page(facts: dict[str, Any]) -> str:
    """The result of describe() as text."""
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
    out.append(
        f"\njoints, as difference from the neutral pose ({facts['translation_unit']}, "
        f"{facts['rotation_unit']}; sx sy sz are added to 1)"
    )
    # Motions as small as the rounding of float32 sums are not printed; --json has all digits.
    joints = [row for row in facts["joints"] if any(_moved(row[a]) for a in ATTRIBUTES)]
    if not joints:
        return "\n".join([*out, "  none"])
    out.append("  ".join([" " * (width + 2), *(f"{a:>10}" for a in ATTRIBUTES)]).rstrip())
    for row in joints:
        numbers = (f"{row[a] if _moved(row[a]) else 0:>10.5g}" for a in ATTRIBUTES)
        out.append("  ".join([f"  {row['name']:<{width}}", *numbers]))
    return "\n".join(out)


def check_options(args: argparse.Namespace) -> None:
    """Refuse options for printing one pose if -o is given, and options for clips if -o is missing.

    Raises: CommandLineError.
    """
    if args.out is not None:
        for name, default in (("explain", False), ("gui", False), ("top", 10)):
            if getattr(args, name) != default:
                raise CommandLineError(
                    f"--{name} shows one pose and is not possible with a clip (-o)"
                )
        return
    for name in eval_clip.OPTIONS:
        if getattr(args, name) not in (None, False):
            raise CommandLineError(f"--{name} is for the frames of a clip, for which -o is missing")
    if any(text.lower().endswith(".dna") and "=" not in text for text in args.controls):
        raise CommandLineError(
            "to evaluate a clip on a character, -o OUT.npz or -o OUT.csv was expected"
        )


def run(args: argparse.Namespace) -> int:
    check_options(args)
    return eval_clip.run(args) if args.out is not None else run_pose(args)


def run_pose(args: argparse.Namespace) -> int:
    """Print the pose for the control values of the command line.

    Raises: CommandLineError: the face lacks the LOD or a control, or a value is no number.
    """
    dna = risorius.load(args.file, layers="all")
    rig = risorius.Rig(dna)
    if not 0 <= args.lod < max(1, rig.lod_count):
        raise CommandLineError(f"--lod: 0 to {max(1, rig.lod_count) - 1} was expected")
    gui = None
    if args.gui:
        names = rig.gui_control_names
        gui = parse_controls(args.controls, names, np.zeros(len(names), np.float32))
        raw = raw_of_gui(dna, rig, gui)
    else:
        raw = parse_controls(args.controls, rig.raw_control_names, rig.initial_raw_controls)
    if rig.ignored_layers:
        print(
            f"risorius: not evaluated by this version: {', '.join(rig.ignored_layers)}",
            file=sys.stderr,
        )
    if args.explain:
        facts = explain.explain(dna, rig, raw, lod=args.lod, gui=gui)
        text = explain.page(facts, args.top)
    else:
        facts = describe(dna, rig, raw, args.lod)
        text = page(facts)
    print(json.dumps(facts, indent=2) if args.json else text)
    return 0
