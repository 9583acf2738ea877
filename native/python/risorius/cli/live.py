# SPDX-License-Identifier: MIT
"""risorius live: receives faces from a capture app, shows the status, records."""

from __future__ import annotations

import argparse
import signal
import sys
from pathlib import Path
from time import monotonic, sleep
from types import FrameType

from ..importing import csv_text, write_text
from ..live import (
    EVERYWHERE,
    PORTS,
    SOURCES,
    THIS_MACHINE,
    Receiver,
    Shaper,
    Status,
    Take,
    own_address,
)
from ..ranges import load_ranges
from .files import (
    InputError,
    number,
    require_suffix,
    require_writable,
    whole_number,
)

_KINDS = (".rzc", ".csv")


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    parser = subparsers.add_parser(
        "live",
        help="show and record a face from a phone",
        description="Listens for Live Link Face (ARKit mode) or for VMC and other OSC, shows the "
        "status on one line, and records a subject as curves of raw controls at the sender's own "
        "times. Ctrl-C stops and saves.",
    )
    parser.add_argument("--source", choices=SOURCES, default="livelink", help="default livelink")
    ports = ", ".join(f"{port} for {source}" for source, port in PORTS.items())
    parser.add_argument(
        "--port", type=whole_number(0, 65_535), metavar="N", help=f"default {ports}; 0 for any"
    )
    parser.add_argument(
        "--everywhere",
        action="store_true",
        help="also listen to the network (needed for a phone); default: this machine only",
    )
    parser.add_argument(
        "--subject",
        default="",
        metavar="NAME",
        help="name of the subject in the app; it always gets a place (default: the first)",
    )
    parser.add_argument("--record", type=Path, metavar="OUT", help="clip.rzc or clip.csv")
    parser.add_argument(
        "--seconds", type=number(0.0, above=True), metavar="N", help="stop after N seconds"
    )
    parser.add_argument(
        "--mapping",
        default="arkit",
        metavar="NAME|FILE",
        help="mapping of names to controls, as TOML",
    )
    parser.add_argument(
        "--range", type=Path, metavar="FILE", help="the person's ranges, from risorius clip learn"
    )
    parser.add_argument(
        "--gain", type=number(-1e6, 1e6), default=1.0, metavar="X", help="factor for all units"
    )
    parser.set_defaults(func=run)


def complain(args: argparse.Namespace) -> None:
    """Check the options before the program listens. Raises: CommandLineError; InputError if the
    output cannot be written."""
    if args.record is None:
        return
    require_suffix(args.record, _KINDS, "--record")
    require_writable(args.record)


def run(args: argparse.Namespace) -> int:
    complain(args)
    receiver = Receiver(args.source, args.port, EVERYWHERE if args.everywhere else THIS_MACHINE)
    shaper = Shaper(args.mapping, gain=args.gain)
    if args.range is not None:
        shaper.ranges = load_ranges(args.range)
    receiver.start()
    take = receiver.record(args.subject)
    try:
        _listen(receiver, args)
    finally:
        receiver.stop()
    receiver.finish(take)
    if args.record is not None:
        _save(take, shaper, args.record)
    return 0


def _save(take: Take, shaper: Shaper, path: Path) -> None:
    """Write the take; report dropped frames, and curves of the app that no control uses."""
    if not len(take):
        raise InputError(f"{path} was not written: no face came from the app")
    if take.full:
        print(f"risorius: the take is full: {take.full} frames were left out", file=sys.stderr)
    if missed := take.unmapped(shaper):
        print(f"risorius: not mapped: {', '.join(missed)}", file=sys.stderr)
    clip = take.clip(shaper)
    try:
        if path.suffix.lower() == ".csv":
            write_text(csv_text(clip), path)
        else:
            clip.save(path)
    except OSError as error:
        raise InputError(f"{path}: cannot write it: {error.strerror}") from error
    print(f"{path}: {clip.frame_count} frames of {take.subject}, {clip.duration:.3f} s")


def _listen(receiver: Receiver, args: argparse.Namespace) -> None:
    """Receive faces and show the status, until the time is over or the user stops."""
    ended: list[int] = []

    def end(number: int, _frame: FrameType | None) -> None:
        ended.append(number)

    before = {which: signal.signal(which, end) for which in (signal.SIGINT, signal.SIGTERM)}
    print(f"listening to {_place(receiver)}; Ctrl-C ends", file=sys.stderr, flush=True)
    still = sys.stderr.isatty()
    began, shown = monotonic(), 0.0
    try:
        while not ended and not (args.seconds and monotonic() - began >= args.seconds):
            sleep(0.05)
            if monotonic() - shown >= (0.25 if still else 2.0):
                shown = monotonic()
                line = words(receiver.status(args.subject))
                print(
                    f"\r{line:<78}" if still else line, end="" if still else "\n", file=sys.stderr
                )
                sys.stderr.flush()
    finally:
        for which, handler in before.items():
            signal.signal(which, handler)
    print(f"\r{words(receiver.status(args.subject)):<78}" if still else "", file=sys.stderr)


def _place(receiver: Receiver) -> str:
    """A text with the address that the user types into the app, and with the machines that can
    connect to it."""
    if receiver.host == THIS_MACHINE:
        return f"this machine alone at port {receiver.port}; --everywhere for a phone"
    address = own_address() or "this machine's address"
    return f"the network; in the app: {address}, port {receiver.port}"


def words(status: Status) -> str:
    """The status of the capture as one line."""
    if not status.subject:
        heard = "nothing heard yet" if not status.packets else "no face yet"
        refused = f", {status.refused} refused ({status.reasons[0][0]})" if status.refused else ""
        return f"{heard}, {status.packets} packets{refused}"
    parts = [f"{status.subject}: {status.per_second:.0f}/s", f"{status.recording} frames"]
    for count, what in (
        (status.lost, "lost"),
        (status.late, "late"),
        (status.refused, "refused"),
        (status.floods, "floods"),
    ):
        if count:
            parts.append(f"{count} {what}")
    if status.age is not None and status.age > 1.0:
        parts.append(f"silent for {status.age:.0f} s")
    others = [s for s in status.subjects if s != status.subject]
    return ", ".join(parts) + (f"; also {', '.join(others)}" if others else "")
