# SPDX-License-Identifier: MIT
"""Compiled faces kept between runs of a program."""

from __future__ import annotations

import contextlib
import hashlib
import os
import sys
from pathlib import Path

from .._native import DnaError, Rig, compile_version, rig_block_version
from ..base import version
from ..base.reading import FACE, ReadingError, read_file
from ..files.caches import cache_folder
from .load import load


def compile_cached(
    path: str | os.PathLike[str],
    cache_dir: str | os.PathLike[str] | None = None,
    *,
    precision: str = "float32",
    rotation: str = "euler",
    simd: str | None = None,
) -> Rig:
    """Rig(load(path)), from a cache if it was compiled before.

    The file of the cache is named by a hash of the DNA's bytes, the options, this version and the
    byte order: an edited DNA is another one. Its hash is checked each time; one that is damaged,
    were it by a single bit, is replaced. A folder that cannot be written costs the time to compile
    and is no error. Nothing is ever deleted, but may be.

    Args:
        path: of a DNA file.
        cache_dir: else a folder among the user's caches; made if it is not there. What others may
            write there is checked as DNA files are, see Rig.load: a hash finds damage, not forgery.
        precision, rotation, simd: as of Rig.

    Raises:
        DnaError: as load(path) and Rig.
        ValueError: an unknown option.
    """
    try:
        data = read_file(path, FACE)
    except (OSError, ReadingError):  # load() below fails as well, and its error names the file
        dna = load(path)
        return Rig(dna, precision=precision, rotation=rotation, simd=simd)
    file = Path(cache_dir) if cache_dir is not None else cache_folder() / "rigs"
    file /= _key(data, precision, rotation)
    with contextlib.suppress(DnaError):
        return Rig.load(file, trusted=None, simd=simd)
    try:
        dna = load(data)
    except DnaError as error:
        if not os.path.isfile(path):  # a pipe gives its bytes once
            named = DnaError(f"{os.fspath(path)}: {error}")
            named.code, named.where, named.offset = error.code, error.where, error.offset
            raise named from None
        dna = load(path)  # names the file
    rig = Rig(dna, precision=precision, rotation=rotation, simd=simd)
    with contextlib.suppress(OSError, DnaError):
        file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        rig.save(file)
    return rig


def _key(data: bytes, precision: str, rotation: str) -> str:
    what = hashlib.sha256(data)  # CPUs have instructions for it: twice as fast as blake2b
    versions = (version.__version__, rig_block_version(), compile_version())
    about = (*versions, sys.byteorder, precision, rotation)
    what.update(repr(about).encode())
    return what.hexdigest() + ".rig"
