# SPDX-License-Identifier: GPL-3.0-or-later
"""Links the add-on's operators to their pages in the documentation, for Blender's Online Manual."""

import bpy

from ... import native

_FOLDER = "reference/blender/"


def pages() -> tuple[str, tuple[tuple[str, str], ...]]:
    """The site's address and (pattern, page) pairs for `bpy.utils.register_manual_map`."""
    rows = []
    for name in sorted(dir(bpy.ops.risorius)):  # pyright: ignore  made by registration
        page = f"{_FOLDER}risorius.{name}.html"
        rows += [(f"bpy.ops.risorius.{name}", page), (f"bpy.types.risorius_ot_{name}.*", page)]
    rows.append(("bpy.types.*.risorius_*", f"{_FOLDER}index.html"))
    return native.website(), tuple(rows)


def register() -> None:
    """Register the pages, if the package was built with the address of a site."""
    if native.website():
        bpy.utils.register_manual_map(pages)


def unregister() -> None:
    """Remove the pages from Blender's Online Manual, if they were registered."""
    if native.website():
        bpy.utils.unregister_manual_map(pages)
