# SPDX-License-Identifier: MIT
"""The errors that NumPy raises for a damaged .npz, and a limit for the size of its arrays.

NumPy documents no errors: those of zip, zlib, struct and, from 3.12 on, Python's tokenizer pass
through. An offset beyond the file raises OSError, like a missing file: open the file first.
"""

from __future__ import annotations

import struct
import tokenize
import zipfile
import zlib
from typing import BinaryIO

from .budget import Budget

DAMAGED: tuple[type[Exception], ...] = (
    ValueError,
    LookupError,
    TypeError,
    AttributeError,
    RuntimeError,
    EOFError,
    OSError,
    MemoryError,
    SyntaxError,
    struct.error,
    tokenize.TokenError,
    zipfile.BadZipFile,
    zlib.error,
)


def hold_arrays(file: BinaryIO) -> None:
    """Check the sizes of an .npz's arrays before NumPy unpacks them.

    Args:
        file: open for reading; NumPy reads it from the beginning afterwards.

    Raises:
        BudgetError: the arrays are too large in proportion to the file.
        BadZipFile and others of DAMAGED: not a valid .npz.
    """
    with zipfile.ZipFile(file) as members:
        budget = Budget.of(file.seek(0, 2))
        for member in members.infolist():
            budget.hold(member.file_size, member.filename)
    file.seek(0)
