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
        """Args: name: name of the file; message: one clause; line: from 1; column: from 1, or its
        header; unknown: curves that no mapping knows, if this is the reason of the error."""
        self.name = name
        self.unknown = tuple(unknown)
        self.line = line
        self.column = column
        place = "" if line is None else f", line {line}"
        if column is not None:
            place += f", column {column}"
        self.where = f"{name}{place}"
        super().__init__(f"{self.where}: {message}")
