# SPDX-License-Identifier: MIT
"""risorius mix: mixes a new face from faces of the same topology."""

from __future__ import annotations

import argparse
from pathlib import Path

import risorius

from ...base.given import GivenError, finite_text
from ...files import fileio
from ...mixing import REGIONS, Masks, Mix, check_compatible, mix_faces
from ...mixing.textures import WHY, check_room, mix_textures, texture_folder
from ..files import CommandLineError, read, refuse_same_file, require_suffix, summary

_DESCRIPTION = """\
Mixes faces that have the same topology and controls, such as the sample people: neutral pose,
joints, blend shapes, skin weights, maps and textures are their means by shares. A region may take
other shares, or another face's: it then lies where the mix has it, in the mix' size. Clips of the
parents play on the new face."""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    mix = subparsers.add_parser("mix", help="a new face from some others", description=_DESCRIPTION)
    mix.add_argument("faces", nargs="+", metavar="FILE[=SHARE]", help="without a share: 1")
    for region in REGIONS:
        mix.add_argument(
            f"--{region}",
            nargs="+",
            default=[],
            metavar="FILE=SHARE",
            help=f"of the {region}, 0 to 1; the rest is as on the whole",
        )
    mix.add_argument("--name", help="of the new face (default: the name of its file)")
    mix.add_argument("-o", "--output", type=Path, required=True, help="the DNA file to write")
    mix.set_defaults(func=run)


def _share(text: str, option: str) -> tuple[str, float]:
    """(file, weight in the mix) of FILE=SHARE, split at the last "=".

    If `option` is "", the text may be a FILE without a share; its weight is 1.
    """
    name, equals, number = text.rpartition("=")
    try:
        share = finite_text(number if equals else "")
    except GivenError:
        if option:
            raise CommandLineError(f"--{option}: FILE=SHARE was expected, found {text!r}") from None
        return text, 1.0
    return name, share


def run(args: argparse.Namespace) -> int:
    out = args.output
    require_suffix(out, (".dna",), "-o")
    whole = [_share(text, "") for text in args.faces]
    regions = {r: [_share(text, r) for text in getattr(args, r)] for r in REGIONS}
    named = [*whole, *(share for own in regions.values() for share in own)]
    files = list(dict.fromkeys(name for name, _ in named))
    shares = [sum(share for name, share in whole if name == file) for file in files]
    mix = Mix(
        shares,
        {r: {files.index(n): share for n, share in own} for r, own in regions.items() if own},
    )
    mix.table()
    for file in files:
        refuse_same_file(file, str(out))
    fileio.check_writable(out)
    parents = [read(file, "dna") for file in files]
    check_compatible(parents, files)
    masks = Masks(parents[0])
    dna = mix_faces(parents, mix, name=args.name or out.stem, masks=masks)
    pictures, own = mix_textures(parents, [Path(f) for f in files], mix, masks)
    check_room(out, pictures)
    folder = texture_folder(out)
    fileio.write_all({out: dna.to_bytes()} | {folder / n: data for n, data in pictures.items()})
    _say(out, dna, files, mix, own)
    return 0


def _say(out: Path, dna: risorius.Dna, files: list[str], mix: Mix, own: dict[str, str]) -> None:
    whole = zip(files, mix.whole(), strict=True)
    parts = [f"{Path(file).stem} {share:.0%}" for file, share in whole if share]
    print(f"{out}: {summary(dna)}: {', '.join(parts)}")
    for region, shares in mix.regions.items():
        named = ", ".join(f"{Path(files[p]).stem} {share:.0%}" for p, share in shares.items())
        print(f"  {region}: {named}")
    leading = Path(files[int(mix.whole().argmax())]).stem
    for why, text in WHY.items():
        if names := ", ".join(name for name, found in own.items() if found == why):
            print(f"  pictures of {leading}, as {text}: {names}")
