# SPDX-License-Identifier: MIT
"""Builds the default template, the sample person, once and stores it in the cache folder."""

from __future__ import annotations

import hashlib
import tempfile
from pathlib import Path
from types import ModuleType

from .. import Dna, DnaError, load
from ..base.version import __version__
from ..files import fileio
from ..files.caches import cache_folder
from ..people import NoPeopleError, people
from .errors import AnyHeadError

_TEXELS = 64  # texture size in pixels; small because the textures are deleted


def default_template() -> Dna:
    """The sample person as a face of blend shapes. The first call takes half a minute to build it.

    Raises:
        AnyHeadError: the person's data are not on this machine; the message says how to get them.
        OSError: the cache cannot be written.
    """
    try:
        package = people()
    except NoPeopleError as missing:
        raise AnyHeadError(f"name a DNA file as template: {missing}") from None
    path = cache_folder() / f"template-{__version__}-{_digest(package)}.dna"
    if path.is_file():
        try:
            return load(path)
        except DnaError:
            path.unlink()  # incomplete, for example after a full disk: built again below
    if not package.is_fetched():
        raise AnyHeadError(
            "a template was expected: name a DNA file with expressions, or build the sample person "
            "once with `risorius sample man.dna`, whose data are then the template's as well"
        )
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        dna = package.build_sample(
            Path(folder) / "template.dna", rig=None, offline=True, texture_size=_TEXELS, say=_quiet
        )
    assert isinstance(dna, Dna)
    fileio.write_bytes(path, dna.to_bytes())
    return dna


def _quiet(_line: str) -> None:
    pass


def _digest(package: ModuleType) -> str:
    """Hash of the code that builds the person, so that a new version builds a new template."""
    out = hashlib.sha256()
    folder = Path(package.__path__[0])
    for path in sorted(folder.rglob("*")):
        if path.suffix in (".py", ".toml"):
            out.update(path.read_bytes())
    return out.hexdigest()[:16]
