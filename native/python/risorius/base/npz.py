# SPDX-License-Identifier: MIT
"""Lists the exceptions that NumPy raises for a damaged .npz, and limits the size of its arrays.

NumPy does not document these exceptions: it passes on the errors of zip, zlib, struct and, from
Python 3.12 on, the tokenizer. An offset beyond the end of the file raises OSError, as a missing
file does. Therefore open the file first, so that an OSError of NumPy means a damaged file.
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
        file: file open for reading; its position is at the start afterwards.

    Raises:
        BudgetError: the arrays are too large in proportion to the file.
        BadZipFile or another exception in DAMAGED: the file is not a valid .npz.
    """
    with zipfile.ZipFile(file) as members:
        budget = Budget.of(file.seek(0, 2))
        for member in members.infolist():
            budget.hold(member.file_size, member.filename)
    file.seek(0)
