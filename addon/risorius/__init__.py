# SPDX-License-Identifier: GPL-3.0-or-later
"""Risorius: faces from DNA files in Blender. Delegates to registration."""


def register() -> None:
    """Add everything to Blender."""
    from . import registration

    registration.register()


def unregister() -> None:
    """Take everything out of Blender again."""
    from . import registration

    registration.unregister()
