# SPDX-License-Identifier: MIT
"""Makes terminal output safe, because names in files may contain control characters."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from typing import Any, TextIO, cast

# Control characters. Characters below 160 can change colours, the cursor and the window's title;
# the others change the direction of text or break lines.
_ORDERS = [*range(32), *range(127, 160), 0x61C, 0x200E, 0x200F, *range(0x2028, 0x202F)]
_ORDERS += range(0x2066, 0x206A)
_SPELLED = {
    code: f"\\x{code:02x}" if code < 256 else f"\\u{code:04x}"
    for code in _ORDERS
    if chr(code) not in "\n\t"
}


def spelled(text: str) -> str:
    """A text with its control characters as Python escapes.

    Args:
        text: the text; its tabs and line breaks stay.
    """
    return text.translate(_SPELLED)


@contextlib.contextmanager
def obeyed_by_nobody() -> Iterator[None]:
    """Replace control characters in all text that is printed in this context, see `spelled`.

    A carriage return at the start of a text on the standard error stays, for progress lines.
    """
    out, error = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = _stream(out, ""), _stream(error, "\r")
    try:
        yield
    finally:
        sys.stdout, sys.stderr = out, error


def _stream(stream: TextIO, begin: str) -> TextIO:
    return cast(TextIO, _Spelling(stream, begin))


class _Spelling:
    """A text stream that escapes control characters; its other methods are unchanged."""

    def __init__(self, stream: TextIO, begin: str) -> None:
        self._stream, self._begin = stream, begin

    def write(self, text: str) -> int:
        kept = self._begin if self._begin and text.startswith(self._begin) else ""
        self._stream.write(kept + spelled(text[len(kept) :]))
        return len(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)
