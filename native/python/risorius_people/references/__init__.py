# SPDX-License-Identifier: MIT
"""The joints that all sample people share, fitted once on the man. joints.npz, made by
packaging/ship/find_joints.py, has the joints of the shipped people; others are kept in the user's
cache."""

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
    """The reference of build.RIG, which ships with the package."""
    return Reference.read(SHIPPED)


def _path(options: RigOptions) -> Path:
    """File of a reference; the start of its name is the same for one version of all inputs."""
    known = hashlib.sha256(SHA256.encode() + fingerprint())
    for entry in sorted(Path(__file__).parent.rglob("*")):
        if entry.suffix in (".py", ".toml"):
            known.update(entry.read_bytes())
    asked = hashlib.sha256(str(options).encode()).hexdigest()
    return downloads() / f"joints-{known.hexdigest()[:16]}-{asked[:8]}.npz"


def kept(options: RigOptions) -> Reference | None:
    """The reference of these options, if this version of Risorius made one on this machine.

    Args:
        options: options of the joint rig.
    """
    try:
        return Reference.read(_path(options))
    except (OSError, ArgumentError):
        return None


def keep(options: RigOptions, reference: Reference) -> None:
    """Keep a reference and remove other versions; if that fails, the next build makes it again.

    Args:
        options: options of the joint rig.
        reference: the man's reference.
    """
    path = _path(options)
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        version = path.name.rpartition("-")[0]
        for old in path.parent.glob("joints-*.npz"):
            if not old.name.startswith(version):
                old.unlink()
        fileio.write_bytes(path, reference.to_bytes())
