# SPDX-License-Identifier: MIT
"""Safe terminal output: names in files may contain control characters."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from typing import Any, TextIO, cast

# Colours, cursor moves and titles begin with the first ones; the rest reverse the text direction.
_ORDERS = [*range(32), *range(127, 160), 0x61C, 0x200E, 0x200F, *range(0x2028, 0x202F)]
_ORDERS += range(0x2066, 0x206A)
_SPELLED = {
    code: f"\\x{code:02x}" if code < 256 else f"\\u{code:04x}"
    for code in _ORDERS
    if chr(code) not in "\n\t"
}


def spelled(text: str) -> str:
    """A text with its control characters written as Python escapes.

    Args:
        text: its tabs and line breaks stay.
    """
    return text.translate(_SPELLED)


@contextlib.contextmanager
def obeyed_by_nobody() -> Iterator[None]:
    """Pass all text printed in this context through `spelled`.

    Progress on the standard error may begin with a carriage return.
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
    """A text stream; everything except `write` belongs to the original stream."""

    def __init__(self, stream: TextIO, begin: str) -> None:
        self._stream, self._begin = stream, begin

    def write(self, text: str) -> int:
        kept = self._begin if self._begin and text.startswith(self._begin) else ""
        self._stream.write(kept + spelled(text[len(kept) :]))
        return len(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)
