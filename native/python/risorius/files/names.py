# SPDX-License-Identifier: MIT
"""Makes file names from names inside files; other code must not use such names in paths.

The name of an expression, a character, an image or a clip may be any text. As a file name it must
not lead to another folder, must not open a device, and must be valid on Windows, macOS and Linux.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable

LONGEST = 200  # bytes of UTF-8; file systems allow 255, and callers append suffixes
UNNAMED = "unnamed"
_FORBIDDEN = frozenset('<>:"/\\|?*')
_DEVICES = frozenset(
    ["con", "prn", "aux", "nul", "conin$", "conout$", "clock$"]
    + [f"{port}{number}" for port in ("com", "lpt") for number in "0123456789\u00b9\u00b2\u00b3"]
)


def file_name(name: str, ending: str = "", taken: Iterable[str] = ()) -> str:
    """Make a file name for a named object, valid on every system.

    A safe name stays unchanged. Otherwise separators, drives, wildcards and unprintable characters
    become "_"; dots and spaces at both ends are removed; an empty name becomes "unnamed"; "_" is
    put before the name of a device; a long name is shortened between characters.

    Args:
        name: any text, even empty.
        ending: suffix with its dot; it must come from the program, never from data.
        taken: file names that are in use, in any case and spelling of accents; a number is appended
            if needed.

    Returns:
        A file name without a folder, at most LONGEST (200) bytes long in UTF-8.
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
    """Whether a name from a file is safe as a file name in the same folder.

    Args:
        name: any text.
    """
    return file_name(name) == name


def folded(path: str) -> str:
    """A key that is equal for two paths if they are the same file on some system.

    Args:
        path: path or file name. On some systems names that differ only in case, or in the spelling
            of an accent, are the same file.
    """
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", path).casefold())


def _cut(text: str, ending: str) -> str:
    """Join a text and an ending. The text is shortened so that the result has at most LONGEST (200)
    bytes."""
    room = LONGEST - len(ending.encode()) - 1  # one byte for the "_" before a device name
    text = text.encode()[:room].decode(errors="ignore").rstrip(" .") or UNNAMED
    device = text.partition(".")[0].rstrip().casefold() in _DEVICES
    return f"{'_' * device}{text}{ending}"
