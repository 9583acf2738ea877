# SPDX-License-Identifier: MIT
"""What NumPy raises where an .npz is damaged, and what its arrays may unfold to.

NumPy promises nothing: zip, zlib, struct and, from 3.12 on, Python's own tokenizer shine through.
A place beyond the file is an OSError, as a file that is not there is: open it first.
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
    """Before NumPy unfolds an .npz: its arrays are in proportion to it.

    Args:
        file: opened; is read from its beginning afterwards.

    Raises:
        BudgetError: they are not.
        BadZipFile and others of DAMAGED: no .npz.
    """
    with zipfile.ZipFile(file) as members:
        budget = Budget.of(file.seek(0, 2))
        for member in members.infolist():
            budget.hold(member.file_size, member.filename)
    file.seek(0)
