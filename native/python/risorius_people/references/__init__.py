# SPDX-License-Identifier: MIT
"""Stores references: the joints that all sample people share, fitted once on the man.

joints.npz, made by packaging/ship/find_joints.py, has the joints for the options build.RIG. The
joints for other options are files in the user's cache."""

from __future__ import annotations

import contextlib
import hashlib
from pathlib import Path

from risorius.author import Reference, RigOptions
from risorius.author.reference import fingerprint
from risorius.base.errors import ArgumentError
from risorius.files import fileio

from ..source import SHA256, downloads

SHIPPED = Path(__file__).with_name("joints.npz")


def shipped() -> Reference:
    """The joints for the options build.RIG, from a file of the package."""
    return Reference.read(SHIPPED)


def _path(options: RigOptions) -> Path:
    """Path of a cached reference; its name has a hash of data and code, and a hash of `options`."""
    known = hashlib.sha256(SHA256.encode() + fingerprint())
    for entry in sorted(Path(__file__).parent.rglob("*")):
        if entry.suffix in (".py", ".toml"):
            known.update(entry.read_bytes())
    asked = hashlib.sha256(str(options).encode()).hexdigest()
    return downloads() / f"joints-{known.hexdigest()[:16]}-{asked[:8]}.npz"


def kept(options: RigOptions) -> Reference | None:
    """The cached reference for these options, or None if this version has not fitted it yet.

    Args:
        options: options of the joint rig.
    """
    try:
        return Reference.read(_path(options))
    except (OSError, ArgumentError):
        return None


def keep(options: RigOptions, reference: Reference) -> None:
    """Caches a reference, and removes the references of other versions.

    Errors of files are ignored, because the next build can fit the joints again.

    Args:
        options: options of the joint rig.
        reference: the reference, fitted on the man.
    """
    path = _path(options)
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        version = path.name.rpartition("-")[0]
        for old in path.parent.glob("joints-*.npz"):
            if not old.name.startswith(version):
                old.unlink()
        fileio.write_bytes(path, reference.to_bytes())
