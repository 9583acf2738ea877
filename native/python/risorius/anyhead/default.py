# SPDX-License-Identifier: MIT
"""Builds the default template, the sample person, once and stores it in the cache folder."""

from __future__ import annotations

import hashlib
import shutil
from pathlib import Path
from types import ModuleType

from .. import DnaError, load
from ..base.version import __version__
from ..files.caches import cache_folder
from ..people import NoPeopleError, people
from .errors import AnyHeadError

_TEXELS = 512  # texture size in pixels; only parts that a head lacks, such as eyes, use textures


def default_template() -> Path:
    """The DNA file of the sample person, a face of blend shapes with its textures beside it.

    The first call takes half a minute to build the person.

    Raises:
        AnyHeadError: the person's data are not on this machine; the message says how to get them.
        OSError: the cache cannot be written.
    """
    try:
        package = people()
    except NoPeopleError as missing:
        raise AnyHeadError(f"name a DNA file as template: {missing}") from None
    folder = cache_folder() / f"template-{__version__}-{_digest(package)}"
    path = folder / "person.dna"
    if not _is_complete(path):
        if not package.is_fetched():
            raise AnyHeadError(
                "a template was expected: name a DNA file with expressions, or run `risorius "
                "sample man.dna` once, because it downloads the data of the default template"
            )
        _remove_earlier(folder)
        folder.mkdir(parents=True, exist_ok=True)
        package.build_sample(path, rig=None, offline=True, texture_size=_TEXELS, say=_quiet)
    return path


def _is_complete(path: Path) -> bool:
    """Whether a DNA file can be loaded. It cannot be loaded if, for example, the disk became full
    while the file was written."""
    try:
        load(path)
    except (DnaError, OSError):
        return False
    return True


def _remove_earlier(folder: Path) -> None:
    """Removes cached templates that other code with the version number of this package built, for
    example during development."""
    for path in folder.parent.glob(f"template-{__version__}-*"):
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)


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
