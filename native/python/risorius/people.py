# SPDX-License-Identifier: MIT
"""Finds the modules of the separate wheel `risorius-people`, which makes sample people."""

from __future__ import annotations

from importlib import metadata
from types import ModuleType

from .base.errors import RisoriusError
from .base.version import __version__

GROUP = "risorius.people"


class NoPeopleError(RisoriusError):
    """The wheel of the sample people is not installed, or has another version."""

    code = "no_people"


def people(name: str = "package") -> ModuleType:
    """A module of the wheel `risorius-people`.

    Args:
        name: name of the entry point: `package` makes people, `command` is `risorius sample`.

    Raises:
        NoPeopleError: the wheel is not installed or has no such entry point, or its version is not
            the version of this package.
    """
    for entry in metadata.entry_points(group=GROUP, name=name):
        found = entry.dist.version if entry.dist else __version__
        if found != __version__:
            raise NoPeopleError(
                f"risorius-people {__version__} was expected, found {found}: install the wheel "
                "that was built with this package"
            )
        module = entry.load()
        assert isinstance(module, ModuleType)
        return module
    raise NoPeopleError(
        f"the wheel risorius-people is not installed: install risorius-people {__version__} to "
        "build sample people"
    )
