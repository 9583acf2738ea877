# SPDX-License-Identifier: GPL-3.0-or-later
"""Risorius: faces from DNA files in Blender. Delegates to registration."""

from collections.abc import Mapping


def register() -> None:
    """Add everything to Blender."""
    from . import registration

    registration.register()


def unregister() -> None:
    """Take everything out of Blender again."""
    from . import registration

    registration.unregister()


def glTF2_pre_export_callback(settings: Mapping[str, object]) -> None:
    """Blender's glTF exporter looks for this name in every add-on and calls it before it writes.

    Args:
        settings: the exporter's.
    """
    from . import registration

    registration.before_gltf(settings)


def glTF2_post_export_callback(settings: Mapping[str, object]) -> None:
    """Blender's glTF exporter calls this after it has written. Args: settings  the exporter's."""
    del settings
    from . import registration

    registration.after_gltf()
