# SPDX-License-Identifier: MIT
"""The error class of animation files."""

from __future__ import annotations

from collections.abc import Sequence

from ..base.errors import RisoriusError


class AnimationFileError(RisoriusError):
    """An animation file or a mapping that cannot be used; the message names file and place."""

    code = "animation_file"

    def __init__(
        self,
        name: str,
        message: str,
        *,
        line: int | None = None,
        column: int | str | None = None,
        unknown: Sequence[str] = (),
    ) -> None:
        """Store the place of the error, and make its message.

        Args:
            name: name of the file.
            message: one clause with the found and the expected value.
            line: number of the line from 1; None: unknown.
            column: number of the column from 1, or the header of the column; None: unknown.
            unknown: curves that no mapping knows, if they are the reason of the error.
        """
        self.name = name
        self.unknown = tuple(unknown)
        self.line = line
        self.column = column
        place = "" if line is None else f", line {line}"
        if column is not None:
            place += f", column {column}"
        self.where = f"{name}{place}"
        super().__init__(f"{self.where}: {message}")
