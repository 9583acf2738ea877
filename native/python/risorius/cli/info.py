# SPDX-License-Identifier: MIT
"""risorius info: prints the content of a DNA file, or the differences between two."""

from __future__ import annotations

import argparse
import json
from collections import Counter
from pathlib import Path
from typing import Any

import risorius

from ..mixing import difference
from . import diff
from .files import CommandLineError


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    info = subparsers.add_parser(
        "info",
        help="show the content of a DNA file, or the differences between two",
        description="Shows the content of a file. With --diff, shows the differences of two files "
        "(.dna or .json) in words; exit codes as in diff: 0 the same, 1 different, 2 trouble.",
    )
    info.add_argument("file", type=Path, nargs="?")
    info.add_argument("--diff", nargs=2, metavar=("A", "B"), help="differences between two files")
    info.add_argument("--all", action="store_true", help="with --diff: do not shorten lists")
    info.add_argument(
        "--mix-with",
        nargs="+",
        metavar="FACE",
        help="check which of these faces can be mixed with the file (risorius mix), and why others "
        "cannot; the exit code is 1 if one cannot",
    )
    info.add_argument("--json", action="store_true", help="print JSON")
    info.set_defaults(func=run)


def describe(dna: risorius.Dna) -> dict[str, Any]:
    """All facts about a face that `risorius info` prints, as plain values."""
    lods = []
    for lod in range(dna.lod_count):
        rows = [int(g.lods[lod]) for g in dna.joint_groups if len(g.lods) > lod]
        lods.append(
            {
                "joints": _listed(dna.lod_joint_mapping, lod),
                "meshes": _listed(dna.lod_mesh_mapping, lod),
                "blend_shape_channels": _listed(dna.lod_blend_shape_mapping, lod),
                "animated_maps": _listed(dna.lod_animated_map_mapping, lod),
                "joint_matrix_rows": sum(rows),
            }
        )
    meshes = []
    for name, mesh in zip(dna.mesh_names, dna.meshes, strict=False):
        meshes.append(
            {
                "name": name,
                "vertices": len(mesh.positions),
                "faces": max(0, len(mesh.face_offsets) - 1),
                "influences": mesh.maximum_influence_per_vertex,
                "blend_shape_targets": len(mesh.blend_shape_targets),
                "deltas": sum(len(t.vertex_indices) for t in mesh.blend_shape_targets),
            }
        )
    return {
        "name": dna.name,
        "file_version": f"{dna.generation}.{dna.version}",
        "archetype": dna.archetype,
        "gender": dna.gender,
        "age": dna.age,
        "translation_unit": dna.translation_unit,
        "rotation_unit": dna.rotation_unit,
        "coordinate_system": list(dna.coordinate_system),
        "rotation_sequence": dna.rotation_sequence,
        "rotation_signs": list(dna.rotation_signs),
        "face_winding_order": dna.face_winding_order,
        "lod_count": dna.lod_count,
        "max_lod": dna.max_lod,
        "complexity": dna.complexity,
        "db_name": dna.db_name,
        "layers": dna.layers,
        "unknown_layers": {name: len(data) for name, _, data in dna.unknown_layers},
        "counts": {
            "gui_controls": len(dna.gui_control_names),
            "raw_controls": len(dna.raw_control_names),
            "correctives": dna.psd_count,
            "joints": len(dna.joint_names),
            "joint_groups": len(dna.joint_groups),
            "joint_matrix_values": sum(g.values.size for g in dna.joint_groups),
            "blend_shape_channels": len(dna.blend_shape_channel_names),
            "animated_maps": len(dna.animated_map_names),
            "meshes": len(dna.mesh_names),
        },
        "lods": lods,
        "meshes": meshes,
        "metadata": dna.metadata,
        "warnings": dna.warnings,
    }


def _listed(mapping: risorius.LodMapping, lod: int) -> int:
    return len(mapping[lod]) if lod < len(mapping) else 0


def table(rows: list[dict[str, Any]]) -> str:
    """Rows with equal keys as a text table; numbers are aligned right."""
    if not rows:
        return "  none"
    heads = [key.replace("_", " ") for key in rows[0]]
    cells = [[str(value) for value in row.values()] for row in rows]
    widths = [max(len(line[i]) for line in [heads, *cells]) for i in range(len(heads))]
    left = [isinstance(value, str) for value in rows[0].values()]
    lines = []
    for line in [heads, *cells]:
        padded = [
            c.ljust(w) if to_left else c.rjust(w)
            for c, w, to_left in zip(line, widths, left, strict=True)
        ]
        lines.append("  " + "  ".join(padded).rstrip())
    return "\n".join(lines)


def page(facts: dict[str, Any]) -> str:
    """The result of describe() as text."""
    signs = "".join("+" if s > 0 else "-" for s in facts["rotation_signs"])
    out = [
        f"{facts['name'] or '(no name)'}: DNA {facts['file_version']}, {facts['archetype']}, "
        f"{facts['gender']}, age {facts['age']}",
        f"units {facts['translation_unit']}, {facts['rotation_unit']}; axes x y z = "
        f"{' '.join(facts['coordinate_system'])}; rotation {facts['rotation_sequence']} {signs}; "
        f"faces {facts['face_winding_order']}",
        f"layers: {' '.join(facts['layers']) or 'none'}",
    ]
    if facts["unknown_layers"]:
        kept = ", ".join(f"{n} ({s} bytes)" for n, s in facts["unknown_layers"].items())
        out.append(f"kept as bytes: {kept}")
    out.append("\ncounts")
    out += [f"  {value:>8}  {key.replace('_', ' ')}" for key, value in facts["counts"].items()]
    out.append("\nlevels of detail")
    out.append(table([{"LOD": i} | row for i, row in enumerate(facts["lods"])]))
    out += ["\nmeshes", table(facts["meshes"])]
    if facts["metadata"]:
        out.append("\nmetadata")
        out += [f"  {key}: {value}" for key, value in facts["metadata"].items()]
    if facts["warnings"]:
        out.append("\nwarnings")
        groups = Counter(facts["warnings"])
        out += [f"  {text}" for text in groups]
    return "\n".join(out)


def _mixes(first: str, others: list[str], *, as_json: bool) -> int:
    """Print whether each file can be mixed with the first one, or the reason why not. Returns the
    exit code: 1 if a file cannot be mixed."""
    face = risorius.load(first)
    found = {name: difference(face, risorius.load(name)) for name in others}
    if as_json:
        print(json.dumps(found, indent=2))
    else:
        for name, why in found.items():
            print(f"{name}: " + (f"cannot be mixed: {why}" if why else f"mixes with {first}"))
    return int(any(found.values()))


def run(args: argparse.Namespace) -> int:
    one = (args.file is None) != (args.diff is None)
    if not one or (args.all and not args.diff) or (args.mix_with and args.diff):
        raise CommandLineError("info: either FILE or --diff A B [--all] was expected")
    if args.diff:
        return diff.run(*args.diff, everything=args.all, as_json=args.json)
    if args.mix_with:
        return _mixes(str(args.file), args.mix_with, as_json=args.json)
    facts = describe(risorius.load(args.file))
    print(json.dumps(facts, indent=2) if args.json else page(facts))
    return 0
