# SPDX-License-Identifier: MIT
"""risorius export: a face with morph targets, for programs that drive targets by name."""

from __future__ import annotations

import argparse
from pathlib import Path

import risorius

from ...files import fileio
from ...gameface import GROUPS, Wishes, export
from ..files import (
    CommandLineError,
    number,
    refuse_same_file,
    require_suffix,
    require_writable,
    whole_number,
)


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    parser = subparsers.add_parser(
        "export",
        help="export the face as glTF with morph targets: ARKit, visemes, VRM",
        description="Writes a .glb with the evaluated rig at each pose as a morph target, joints "
        "and correctives included, for programs that drive targets by name.",
    )
    parser.add_argument("file", type=Path, help="the DNA file; textures next to it are included")
    parser.add_argument("-o", "--out", type=Path, metavar="FACE.glb", help="default: FILE.glb")
    parser.add_argument(
        "--shapes",
        default="arkit,visemes",
        metavar="GROUPS",
        help=f"groups, separated by commas: {', '.join(GROUPS)}; all: each control by its own name",
    )
    parser.add_argument("--lod", type=whole_number(0, 65535), default=0, metavar="N")
    parser.add_argument(
        "--mb",
        type=number(0, above=True),
        metavar="N",
        help="largest size in MB: shrinks textures, then quantizes, then takes a coarser LOD",
    )
    parser.add_argument(
        "--textures", type=whole_number(16, 8192), default=1024, metavar="N", help="pixels per side"
    )
    parser.add_argument(
        "--most", type=whole_number(1), metavar="N", help="target limit of the client"
    )
    parser.add_argument(
        "--no-skeleton", action="store_true", help="no joints of neck, jaw and eyes"
    )
    parser.add_argument(
        "--sparse", action="store_true", help="store only moved vertices of targets"
    )
    parser.add_argument("--quantize", action="store_true", help="KHR_mesh_quantization, 16 bits")
    parser.add_argument("--meshopt", action="store_true", help="EXT_meshopt_compression")
    parser.add_argument("--normals", action="store_true", help="targets change normals too")
    parser.add_argument(
        "--within",
        type=number(0),
        metavar="MM",
        help="add targets for combinations of two that deviate more, with the JSON and the script "
        "that drive them",
    )
    parser.set_defaults(func=run)


def run(args: argparse.Namespace) -> int:
    out: Path = args.out or args.file.with_suffix(".glb")
    require_suffix(out, (".glb",), "-o")
    refuse_same_file(str(args.file), str(out))
    require_writable(out)
    shapes = tuple(dict.fromkeys(args.shapes.split(",")))
    for group in shapes:
        if group not in GROUPS:
            raise CommandLineError(f"--shapes: {', '.join(GROUPS)} were expected, found {group!r}")
    dna = risorius.load(args.file)
    rig = risorius.compile_cached(args.file)
    wishes = Wishes(
        shapes, args.lod, not args.no_skeleton, args.sparse, args.quantize, args.meshopt,
        args.normals, args.textures, args.mb, args.most, args.within,
    )  # fmt: skip
    made = export(dna, rig, args.file, out.name, wishes)
    fileio.write_all({out.with_name(name): data for name, data in made.files.items()})
    for line in made.notes:
        print(line)
    for name, data in made.files.items():
        print(f"{out.with_name(name)}: {len(data):,} bytes")
    for line in made.groups:
        print(line)
    return 0
