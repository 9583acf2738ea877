# SPDX-License-Identifier: MIT
"""risorius speech: converts a voice to animation."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from .. import expressions
from ..anim.clip import Clip
from ..base import signatures
from ..base.reading import TEXT
from ..files import fileio
from ..importing import writing
from ..speech import Heard, animate, listen, sheets
from ..speech.listening import confidence, follow
from .files import (
    CommandLineError,
    InputError,
    number,
    read_bytes,
    require_suffix,
    require_writable,
    whole_number,
)

_KINDS = (".rzc", ".csv", ".json")


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    parser = subparsers.add_parser(
        "speech",
        help="animate a face from a voice",
        description="Animates a face from a voice: phonemes with their times, lips and jaw, "
        "blinks, brows and nods. English only. The spoken text improves the result a lot. "
        "Needs risorius[speech].",
    )
    parser.add_argument(
        "voice", type=Path, help="a WAV file, or any file that an ffmpeg on PATH can read"
    )
    parser.add_argument(
        "-o", "--out", type=Path, required=True, metavar="OUT", help="clip.rzc, .csv or .json"
    )
    known = parser.add_mutually_exclusive_group()
    known.add_argument("--text", help="the spoken text")
    known.add_argument("--transcript", metavar="FILE", help="file with the spoken text")
    known.add_argument(
        "--read",
        metavar="FILE",
        help="phonemes with their times, written by --phonemes or a forced aligner and corrected "
        "by hand; skips the recognition",
    )
    parser.add_argument(
        "--rate", type=number(1.0, 1000.0), default=60.0, metavar="FPS", help="(default 60)"
    )
    parser.add_argument(
        "--intensity",
        type=number(0.0, 4.0),
        default=1.0,
        metavar="X",
        help="strength of the mouth shapes, 0 to 4",
    )
    parser.add_argument(
        "--seed", type=whole_number(0), default=0, metavar="N", help="seed of the blinks"
    )
    parser.add_argument(
        "--expressions",
        type=Path,
        metavar="LIBRARY",
        help="the face's own visemes, written by author: a folder or a TOML file",
    )
    parser.add_argument("--no-blinks", action="store_true")
    parser.add_argument("--no-accents", action="store_true", help="no motion of brows and head")
    parser.add_argument(
        "--phonemes",
        type=Path,
        metavar="OUT",
        help="also write words and phonemes with their times: OUT.TextGrid for Praat, OUT.tsv",
    )
    parser.add_argument("--json", action="store_true", help="report as JSON")
    parser.set_defaults(func=run)


def complain(args: argparse.Namespace) -> None:
    """Check the names of the files before the voice is analysed. Raises: CommandLineError;
    InputError if an output cannot be written."""
    require_suffix(args.out, _KINDS, "-o")
    require_writable(args.out, args.phonemes)
    if args.text is not None and Path(args.text).is_file():
        raise CommandLineError(
            f"--text: the spoken text was expected, found the file "
            f"{args.text}: --transcript reads it"
        )
    if args.phonemes is not None and args.phonemes.resolve() == args.out.resolve():
        raise CommandLineError("--phonemes: another file than that of -o was expected")


def run(args: argparse.Namespace) -> int:
    complain(args)
    heard, clip = _spoken(args)
    files = {args.out: _content(clip, args.out)}
    if args.phonemes is not None:
        files[args.phonemes] = sheets.write(heard.phonemes, args.phonemes.name).encode()
    fileio.write_all(files)
    for note in heard.notes:
        print(f"risorius: {args.voice}: {note}", file=sys.stderr)
    print(json.dumps(_report(heard, clip), indent=1) if args.json else _summary(heard, clip, args))
    return 0


def _spoken(args: argparse.Namespace) -> tuple[Heard, Clip]:
    """Analyse the voice and make its clip. Raises: InputError, ValueError."""
    library = None if args.expressions is None else expressions.load(args.expressions)
    said = args.text
    if args.transcript is not None:
        data = read_bytes(args.transcript, TEXT)
        kind = signatures.kind_of(data)
        if kind is not None:
            raise InputError(f"{args.transcript}: text was expected, this is {kind}")
        try:
            said = data.decode("utf-8-sig")
        except UnicodeDecodeError as error:
            raise InputError(f"{args.transcript}: not UTF-8 (byte {error.start})") from error
    shown = sys.stderr.isatty()

    def progress(part: float) -> None:
        print(f"\rlistening {part:4.0%}", end="\n" if part >= 1.0 else "", file=sys.stderr)

    if args.read is not None:
        heard = follow(args.voice, sheets.read(read_bytes(args.read, TEXT), str(args.read)))
    else:
        heard = listen(args.voice, said, progress=progress if shown else None)
    clip = animate(
        heard, rate=args.rate, seed=args.seed, intensity=args.intensity,
        blinks=not args.no_blinks, accents=not args.no_accents, library=library,
    )  # fmt: skip
    metadata = {**clip.metadata, "source": args.voice.name}
    if said is not None:
        metadata["transcript"] = said
    return heard, clip.replaced(metadata=metadata)


def _report(heard: Heard, clip: Clip) -> dict[str, object]:
    return {
        "speech": clip.metadata["speech"],
        "seconds": round(clip.duration, 3),
        "frames": clip.frame_count,
        "rate": clip.rate,
        "controls": len(clip.names),
        "words": sum(event.name == "word" for event in clip.events),
        "phonemes": sum(p.name != "SIL" for p in heard.phonemes),
        "confidence": round(confidence(heard.phonemes), 3),
        "notes": heard.notes,
    }


def _summary(heard: Heard, clip: Clip, args: argparse.Namespace) -> str:
    report = _report(heard, clip)
    return (
        f"{args.out}: {report['frames']} frames at {clip.rate:g} fps, {report['controls']} "
        f"controls; {report['words']} words, {report['phonemes']} phonemes {report['speech']}, "
        f"confidence {report['confidence']:.0%}"
    )


def _content(clip: Clip, path: Path) -> bytes:
    """The bytes of a clip's file, in the format of the path's suffix. Raises: ValueError."""
    suffix = path.suffix.lower()
    if suffix == ".csv":
        return writing.csv_text(clip).encode()
    return writing.json_text(clip).encode() if suffix == ".json" else clip.to_bytes()
