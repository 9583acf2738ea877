# SPDX-License-Identifier: GPL-3.0-or-later
"""Entry points of the add-on that Blender calls; the module `registration` does their work."""

from collections.abc import Mapping


def register() -> None:
    """Register the add-on; Blender calls this when it is enabled."""
    from . import registration

    registration.register()


def unregister() -> None:
    """Unregister the add-on; Blender calls this when it is disabled."""
    from . import registration

    registration.unregister()


def glTF2_pre_export_callback(settings: Mapping[str, object]) -> None:
    """Prepare all faces for a glTF export.

    Before Blender's glTF exporter writes, it calls the function of this name in every add-on.

    Args:
        settings: settings of the exporter.
    """
    from . import registration

    registration.before_gltf(settings)


def glTF2_post_export_callback(settings: Mapping[str, object]) -> None:
    """Undo the pre-export function; Blender's glTF exporter calls this after it has written.

    Args:
        settings: settings of the exporter.
    """
    del settings
    from . import registration

    registration.after_gltf()
