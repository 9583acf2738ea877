# SPDX-License-Identifier: MIT
"""The joints that all sample people share, fitted once on the man.

joints.npz, made by packaging/ship/find_joints.py, has the joints for build.RIG; joints for other
options are kept in the user's cache."""

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
    """The reference for build.RIG, which is part of the package."""
    return Reference.read(SHIPPED)


def _path(options: RigOptions) -> Path:
    """Path of a cached reference; its name begins with a hash of all inputs but the options."""
    known = hashlib.sha256(SHA256.encode() + fingerprint())
    for entry in sorted(Path(__file__).parent.rglob("*")):
        if entry.suffix in (".py", ".toml"):
            known.update(entry.read_bytes())
    asked = hashlib.sha256(str(options).encode()).hexdigest()
    return downloads() / f"joints-{known.hexdigest()[:16]}-{asked[:8]}.npz"


def kept(options: RigOptions) -> Reference | None:
    """The cached reference for these options, or None if this version did not make one here.

    Args:
        options: options of the joint rig.
    """
    try:
        return Reference.read(_path(options))
    except (OSError, ArgumentError):
        return None


def keep(options: RigOptions, reference: Reference) -> None:
    """Caches a reference, and removes those of other versions; if it fails, the next build refits.

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
