# SPDX-License-Identifier: MIT
"""What NumPy raises where an .npz is damaged.

It promises nothing: zip, zlib, struct and, from 3.12 on, Python's own tokenizer shine through.
A place beyond the file is an OSError, as a file that is not there is: open it first.
"""

from __future__ import annotations

import struct
import tokenize
import zipfile
import zlib

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
