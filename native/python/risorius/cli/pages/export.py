# SPDX-License-Identifier: MIT
"""risorius export: writes a face as glTF or VRM with named morph targets."""

from __future__ import annotations

import argparse
from pathlib import Path

import risorius

from ...files import fileio
from ...gameface import GROUPS, Wishes, export
from ...gameface.avatar import humanoid, licence
from ...gameface.body.reading import SUFFIXES
from ...gameface.takes import frames_of
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
        help="export the face as glTF or VRM with morph targets: ARKit, visemes, expressions",
        description="Writes a .glb or .vrm with the evaluated rig at each pose as a morph target, "
        "joints and correctives included, for programs that drive targets by name.",
    )
    parser.add_argument("file", type=Path, help="the DNA file; textures next to it are included")
    parser.add_argument(
        "-o", "--out", type=Path, metavar="FACE.glb", help="default: FILE.glb or FILE.vrm"
    )
    parser.add_argument(
        "--shapes",
        metavar="GROUPS",
        help=f"groups of targets, separated by commas: {', '.join(GROUPS)}; all: one target for "
        "each control; default: arkit,visemes, or vrm,arkit with --vrm",
    )
    parser.add_argument("--lod", type=whole_number(0, 65535), default=0, metavar="N")
    parser.add_argument(
        "--mb",
        type=number(0, above=True),
        metavar="N",
        help="size limit in MB: shrinks textures, then quantizes, then takes a coarser LOD",
    )
    parser.add_argument(
        "--textures",
        type=whole_number(16, 8192),
        default=1024,
        metavar="N",
        help="largest side of a texture in pixels (default: 1024)",
    )
    parser.add_argument(
        "--most",
        type=whole_number(1),
        metavar="N",
        help="largest number of targets the client takes",
    )
    parser.add_argument(
        "--no-skeleton", action="store_true", help="write no joints of neck, head, jaw and eyes"
    )
    parser.add_argument(
        "--sparse", action="store_true", help="store only the vertices a target moves"
    )
    parser.add_argument(
        "--quantize", action="store_true", help="16-bit vertices: KHR_mesh_quantization"
    )
    parser.add_argument("--meshopt", action="store_true", help="compress: EXT_meshopt_compression")
    parser.add_argument("--normals", action="store_true", help="targets also change normals")
    parser.add_argument(
        "--within",
        type=number(0),
        metavar="MM",
        help="add targets where sums of targets deviate from the rig by more than MM millimetres, "
        "with the JSON and the script that drive them",
    )
    parser.add_argument(
        "--takes",
        nargs="+",
        type=Path,
        default=[],
        metavar="TAKE",
        help="captures with ARKit units: combinations are also fitted to their frames",
    )
    parser.add_argument(
        "--humanoid", choices=humanoid.KINDS, help="add the bones of a body that the face "
        "lacks: those VRM needs, or all, with Mixamo's names, for TalkingHead",
    )  # fmt: skip
    parser.add_argument("--vrm", choices=licence.VERSIONS, help="write a VRM file of this version")
    parser.add_argument(
        "--licence", type=Path, metavar="FILE.toml", help="the VRM's name, authors and permissions"
    )
    parser.add_argument(
        "--body", type=Path, metavar="BODY.glb",
        help="hang the face on a character of your own: .glb, .gltf or .vrm with a skeleton",
    )  # fmt: skip
    parser.add_argument(
        "--body-scale",
        type=number(0, above=True),
        metavar="N",
        help="metres of a unit of the body; default: 0.01 if it is taller than 20, else 1",
    )
    parser.add_argument(
        "--without",
        action="append",
        default=[],
        metavar="MESH",
        help="leave out a mesh of the body, or of the face such as shirt; repeatable",
    )
    parser.add_argument(
        "--no-springs", action="store_true", help="long hair of a VRM does not swing"
    )
    parser.set_defaults(func=run)


def run(args: argparse.Namespace) -> int:
    suffix = ".vrm" if args.vrm else ".glb"
    out: Path = args.out or args.file.with_suffix(suffix)
    require_suffix(out, (suffix,), "-o")
    refuse_same_file(str(args.file), str(out))
    require_writable(out)
    if args.licence and not args.vrm:
        raise CommandLineError("--licence is of a VRM file: add --vrm 1.0 or --vrm 0.x")
    if args.takes and args.within is None:
        raise CommandLineError("--takes needs combinations: add --within, such as --within 0.5")
    _check_body(args, out)
    said = licence.read(args.licence, args.vrm) if args.licence else {}
    default = "vrm,arkit" if args.vrm else "arkit,visemes"
    shapes = tuple(dict.fromkeys((args.shapes or default).split(",")))
    for group in shapes:
        if group not in GROUPS:
            raise CommandLineError(
                f"--shapes: one or more of {', '.join(GROUPS)} were expected, found {group!r}"
            )
    frames = [frame for take in args.takes for frame in frames_of(take)]
    dna = risorius.load(args.file)
    rig = risorius.compile_cached(args.file)
    wishes = Wishes(
        shapes, args.lod, not args.no_skeleton, args.sparse, args.quantize, args.meshopt,
        args.normals, args.textures, args.mb, args.most, args.within, frames,
        args.humanoid or "", args.vrm or "", said, args.body, args.body_scale,
        tuple(args.without), not args.no_springs,
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


def _check_body(args: argparse.Namespace, out: Path) -> None:
    """Check the options of the skeleton. Raises: CommandLineError: options exclude each other."""
    if args.no_skeleton and (args.vrm or args.humanoid or args.body):
        raise CommandLineError(
            "--no-skeleton is not possible with --vrm, --humanoid or --body, because these need "
            "a skeleton"
        )
    if args.body is None:
        if args.without or args.body_scale is not None:
            raise CommandLineError("--without and --body-scale need a body: add --body BODY.glb")
        return
    if args.humanoid:
        raise CommandLineError(
            "--humanoid is not possible with --body, because both give the bones of a body: "
            "leave it or --body out"
        )
    require_suffix(args.body, SUFFIXES, "--body")
    refuse_same_file(str(args.body), str(out))
