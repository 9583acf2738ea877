# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's Online Manual of our buttons: a page of the documentation's site for each operator."""

import bpy

from ... import native

_FOLDER = "reference/blender/"


def pages() -> tuple[str, tuple[tuple[str, str], ...]]:
    """As `bpy.utils.register_manual_map` takes it: the site, and (pattern, page) of ours."""
    rows = []
    for name in sorted(dir(bpy.ops.risorius)):  # pyright: ignore  made by registration
        page = f"{_FOLDER}risorius.{name}.html"
        rows += [(f"bpy.ops.risorius.{name}", page), (f"bpy.types.risorius_ot_{name}.*", page)]
    rows.append(("bpy.types.*.risorius_*", f"{_FOLDER}index.html"))
    return native.website(), tuple(rows)


def register() -> None:
    """Let Blender ask us, where this package was made with the address of a site."""
    if native.website():
        bpy.utils.register_manual_map(pages)


def unregister() -> None:
    """Undo `register`."""
    if native.website():
        bpy.utils.unregister_manual_map(pages)
