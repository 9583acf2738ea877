# SPDX-License-Identifier: MIT
"""Installs the extension into the running Blender, as Blender's preferences do.

Inside bpy or `blender -b --python`:  install(zip) -> name of the enabled module.
"""

from __future__ import annotations

import sys
from pathlib import Path


def install(package: str | Path) -> str:
    """Install and enable the extension. Returns the name of its module.

    Args:
        package: zip of the extension.

    Raises:
        RuntimeError: Blender did not enable the extension.
    """
    import addon_utils
    import bpy

    module = "bl_ext.user_default.risorius"
    if "bl_pkg" not in bpy.context.preferences.addons:
        addon_utils.enable("bl_pkg", default_set=True)
    result = bpy.ops.extensions.package_install_files(
        filepath=str(package), repo="user_default", enable_on_install=True
    )
    if module not in bpy.context.preferences.addons:
        addon_utils.enable(module, default_set=True)
    if module not in bpy.context.preferences.addons:
        raise RuntimeError(f"Blender did not install {package}: {result}")
    return module


def arguments() -> list[str]:
    """The command line arguments after `--`, or all arguments if there is no `--`."""
    return sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
