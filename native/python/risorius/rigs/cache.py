# SPDX-License-Identifier: MIT
"""A cache of compiled faces on the disk."""

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
    """Rig(load(path)), taken from a cache if it was compiled before.

    The cache file is named by a hash of the DNA's bytes, the options, this version and the byte
    order, so that an edited DNA gets another file. The hash of its content is checked each time,
    and a damaged file is replaced. If the folder cannot be written, the face is compiled each time
    without an error. Nothing is ever deleted; users may delete files.

    Args:
        path: path of a DNA file.
        cache_dir: default is a folder among the user's caches; made if missing. If others may write
            to it, its files are checked like DNA files, see Rig.load: a hash finds damage, not
            forgery.
        precision, rotation, simd: as in Rig.

    Raises:
        DnaError: as load(path) and Rig.
        ValueError: an unknown option.
    """
    try:
        data = read_file(path, FACE)
    except (OSError, ReadingError):  # load() below fails too, and its error names the file
        dna = load(path)
        return Rig(dna, precision=precision, rotation=rotation, simd=simd)
    file = Path(cache_dir) if cache_dir is not None else cache_folder() / "rigs"
    file /= _key(data, precision, rotation)
    with contextlib.suppress(DnaError):
        return Rig.load(file, trusted=None, simd=simd)
    try:
        dna = load(data)
    except DnaError as error:
        if not os.path.isfile(path):  # a pipe can be read only once
            named = DnaError(f"{os.fspath(path)}: {error}")
            named.code, named.where, named.offset = error.code, error.where, error.offset
            raise named from None
        dna = load(path)  # its error names the file
    rig = Rig(dna, precision=precision, rotation=rotation, simd=simd)
    with contextlib.suppress(OSError, DnaError):
        file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        rig.save(file)
    return rig


def _key(data: bytes, precision: str, rotation: str) -> str:
    what = hashlib.sha256(data)  # CPUs have instructions for SHA-256: twice as fast as blake2b
    versions = (version.__version__, rig_block_version(), compile_version())
    about = (*versions, sys.byteorder, precision, rotation)
    what.update(repr(about).encode())
    return what.hexdigest() + ".rig"
