# SPDX-License-Identifier: MIT
"""risorius sample build: a free person to begin with."""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from ...base.errors import ArgumentError
from ...sample.build import NEW_JOINTS
from ...sample.people import PEOPLE, read_person


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    sample = subparsers.add_parser("sample", help="free sample people")
    kinds = sample.add_subparsers(dest="kind", required=True)
    build = kinds.add_parser("build", help="build a sample person from CC0 data")
    build.add_argument("out", type=Path, help="the DNA file to write")
    build.add_argument(
        "--person",
        default="man",
        metavar="WHO",
        help=f"{', '.join(PEOPLE)} (default: man), or a .toml of your own, with the keys of "
        "risorius/sample/cast.toml",
    )
    build.add_argument(
        "--joints",
        type=int,
        default=NEW_JOINTS,
        metavar="N",
        help="new joints that the expressions are done by (default: %(default)s); 0: blend shapes "
        "alone, without coarser levels of detail",
    )
    build.add_argument("--data", type=Path, help="the wheel of data, instead of downloading it")
    build.add_argument("--offline", action="store_true", help="use the cached data only")
    build.add_argument(
        "--texture-size",
        type=int,
        choices=(512, 1024, 2048),
        default=2048,
        help="no texture has more texels than a square of this side (default: 2048)",
    )
    build.set_defaults(func=run)


def run(args: argparse.Namespace) -> int:
    from ...sample import build_sample

    who = args.person
    if who not in PEOPLE and not who.endswith(".toml"):
        raise ArgumentError(f"--person: {', '.join(PEOPLE)} or a .toml was expected, found {who!r}")
    person = PEOPLE[who] if who in PEOPLE else read_person(Path(who))

    begin = time.monotonic()

    def say(text: str) -> None:
        print(f"[{time.monotonic() - begin:5.1f} s] {text}", flush=True)

    dna = build_sample(
        args.out,
        person=person,
        joints=args.joints,
        data=args.data,
        offline=args.offline,
        texture_size=args.texture_size,
        say=say,
    )
    vertices = sum(len(mesh.positions) for mesh in dna.meshes)
    say(
        f"{args.out}: {len(dna.meshes)} meshes, {vertices} vertices, "
        f"{len(dna.joint_names)} joints, {len(dna.raw_control_names)} raw controls, "
        f"{dna.lod_count} levels"
    )
    return 0
