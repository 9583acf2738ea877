# SPDX-License-Identifier: MIT
"""The command risorius sample build, which makes a free sample person."""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from importlib import resources
from pathlib import Path

from risorius.author.correctives import CorrectiveOptions
from risorius.author.input.spec import read_options
from risorius.author.work import RigOptions
from risorius.base.errors import ArgumentError
from risorius.cli.faces.author import opposites
from risorius.cli.files import whole_number

from .build import NEW_JOINTS, NO_SEARCH, RIG
from .people import PEOPLE, read_person


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    sample = subparsers.add_parser("sample", help="free sample people")
    kinds = sample.add_subparsers(dest="kind", required=True)
    build = kinds.add_parser("build", help="build a sample person from CC0 data")
    build.add_argument("out", type=Path, help="the DNA file to write")
    build.add_argument(
        "--person",
        default="man",
        metavar="WHO",
        help=f"{', '.join(PEOPLE)} (default: man), or your own .toml with the keys of "
        "risorius_people/cast.toml",
    )
    build.add_argument(
        "--joints",
        type=whole_number(0, 4096),
        metavar="N",
        help=f"number of new joints that move the expressions (default: {NEW_JOINTS}, or the "
        "spec's); 0: blend shapes only, without coarser LODs",
    )
    build.add_argument(
        "--spec",
        metavar="SPEC",
        help="options of the rig: full (800 joints, up to 2,400 automatic correctives; takes "
        "24 minutes of CPU), or a .toml with the tables of risorius author except the source",
    )
    build.add_argument("--data", type=Path, help="the data wheel, instead of a download")
    build.add_argument("--offline", action="store_true", help="use only cached data")
    build.add_argument(
        "--texture-size",
        type=int,
        choices=(512, 1024, 2048, 4096),
        default=2048,
        help="each texture has at most the texels of a square with this side (default: 2048)",
    )
    build.set_defaults(func=run)


def run(args: argparse.Namespace) -> int:
    from .build import build_sample

    who = args.person
    if who not in PEOPLE and not who.endswith(".toml"):
        raise ArgumentError(f"--person: {', '.join(PEOPLE)} or a .toml was expected, found {who!r}")
    person = PEOPLE[who] if who in PEOPLE else read_person(Path(who))

    rig, correctives = _rig(args.spec, args.joints)

    begin = time.monotonic()

    def say(text: str) -> None:
        print(f"[{time.monotonic() - begin:5.1f} s] {text}", flush=True)

    dna = build_sample(
        args.out,
        person=person,
        rig=rig,
        correctives=correctives,
        data=args.data,
        offline=args.offline,
        texture_size=args.texture_size,
        say=say,
    )
    vertices = sum(len(mesh.positions) for mesh in dna.meshes)
    say(
        f"{args.out}: {len(dna.meshes)} meshes, {vertices} vertices, "
        f"{len(dna.joint_names)} joints, {len(dna.raw_control_names)} raw controls, "
        f"{dna.psd_count} correctives, {dna.lod_count} levels"
    )
    return 0


def _rig(spec: str | None, joints: int | None) -> tuple[RigOptions | None, CorrectiveOptions]:
    """Options of the joint fit (None: no joints), and of the search for correctives."""
    rig, correctives = RIG, NO_SEARCH
    if spec == "full":
        with resources.as_file(resources.files("risorius_people") / "full.toml") as path:
            rig, correctives = read_options(path)
    elif spec is not None and spec.endswith(".toml"):
        rig, correctives = read_options(Path(spec))
    elif spec is not None:
        raise ArgumentError(f"--spec: full or a .toml was expected, found {spec!r}")
    if joints is not None:
        rig = replace(rig, fit=replace(rig.fit, joints=joints))
    return rig if rig.fit.joints else None, replace(correctives, apart=opposites())
