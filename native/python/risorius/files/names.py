# SPDX-License-Identifier: MIT
"""Names of files made from names that somebody else wrote: the one way in which they become paths.

The name of an expression, a character, an image or a clip is any text. As the name of a file it
must lead into no other folder, open no device and be possible on Windows, macOS and Linux alike.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable

LONGEST = 200  # bytes of UTF-8; file systems take 255, and others put something of their own behind
UNNAMED = "unnamed"
_FORBIDDEN = frozenset('<>:"/\\|?*')
_DEVICES = frozenset(
    ["con", "prn", "aux", "nul", "conin$", "conout$", "clock$"]
    + [f"{port}{number}" for port in ("com", "lpt") for number in "0123456789\u00b9\u00b2\u00b3"]
)


def file_name(name: str, ending: str = "", taken: Iterable[str] = ()) -> str:
    """The name of a file for something that has a name, safe on every system.

    A name that is safe already stays as it is. In others separators, drives, wildcards and what
    cannot be printed become "_"; dots and spaces at the begin and the end go; the name of a device
    gets "_" before it; a long one is cut inside no character.

    Args:
        name: any text, also an empty one.
        ending: what the file's name ends in, with its dot; from the program, never from data.
        taken: names of files that it must not be, whatever their case and however their accents are
            spelled; then it gets a number.

    Returns:
        A name without a folder, of at most LONGEST bytes.
    """
    text = "".join("_" if c in _FORBIDDEN or not c.isprintable() else c for c in name)
    text = text.lstrip(" .")
    known = {folded(other) for other in taken}
    number, found = 1, _cut(text, ending)
    while folded(found) in known:
        number += 1
        found = _cut(text, f"-{number}{ending}")
    return found


def is_file_name(name: str) -> bool:
    """Whether a name from a file may be used as the name of a file beside it.

    Args:
        name: any text.
    """
    return file_name(name) == name


def folded(path: str) -> str:
    """What two paths share that are one file on some system.

    Args:
        path: or the name of a file; names that differ in case alone, or in how an accent is
            spelled, are one on some systems.
    """
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", path).casefold())


def _cut(text: str, ending: str) -> str:
    """A text and an ending, the text shortened until both have room."""
    room = LONGEST - len(ending.encode()) - 1  # for the "_" before a device
    text = text.encode()[:room].decode(errors="ignore").rstrip(" .") or UNNAMED
    device = text.partition(".")[0].rstrip().casefold() in _DEVICES
    return f"{'_' * device}{text}{ending}"
