# SPDX-License-Identifier: GPL-3.0-or-later
"""Installs, uses, disables or removes the extension: one step per Blender process.

    blender -b --python extension_steps.py -- STEP [ARGUMENTS]
    python extension_steps.py -- STEP [ARGUMENTS]

The script prints the result of the step as one line of JSON after `RESULT `. An exception gives
exit code 1.
"""

import json
import os
import socket
import subprocess
import sys
import traceback
from pathlib import Path

import bpy

MODULE = "bl_ext.user_default.risorius"


def of_ours():
    """The parts of the add-on that are registered in this process.

    The result contains the names of the add-on's preferences, handlers, classes, operators and
    properties, and the number of its entries in the menus Import and Add.
    """
    handlers = [
        name
        for name in dir(bpy.app.handlers)
        for handler in _list(getattr(bpy.app.handlers, name))
        if "risorius" in getattr(handler, "__module__", "")
    ]
    return {
        "preferences": [a.module for a in bpy.context.preferences.addons if "risorius" in a.module],
        "handlers": sorted(handlers),
        "classes": sorted(n for n in dir(bpy.types) if n.startswith("RISORIUS_")),
        "operators": sorted(dir(bpy.ops.risorius)),
        "properties": [n for n in dir(bpy.types.WindowManager) if "risorius" in n],
        "menus": sum(
            "risorius" in getattr(draw, "__module__", "")
            for menu in (bpy.types.TOPBAR_MT_file_import, bpy.types.VIEW3D_MT_add)
            for draw in getattr(menu.draw, "_draw_funcs", ())
        ),
    }


def _list(value):
    return value if isinstance(value, list) else []


def _manager():
    """Enable Blender's installer of extensions, which is not enabled in the bpy module."""
    import addon_utils

    if "bl_pkg" not in bpy.context.preferences.addons:
        addon_utils.enable("bl_pkg", default_set=True)


def _read_preferences(step):
    """Read the user's preferences, because the bpy module starts with factory settings.

    Versions of the bpy module before 4.5 crash while they read preferences, so this function
    enables the extension directly there.

    Args:
        step: name of the step.
    """
    if bpy.app.version >= (4, 5, 0):
        bpy.ops.wm.read_userpref()
    elif step in ("use", "add", "disable", "remove"):
        import addon_utils

        addon_utils.extensions_refresh()
        addon_utils.enable(MODULE, default_set=True)


def install(package):
    """Install a package file and enable it, as Preferences > Install from Disk does."""
    _manager()
    bpy.ops.extensions.package_install_files(
        filepath=package, repo="user_default", enable_on_install=True
    )
    bpy.ops.wm.save_userpref()
    return of_ours()


def _vertices(item):
    """Places of the evaluated vertices of a mesh object, in object space."""
    graph = bpy.context.evaluated_depsgraph_get()
    return [tuple(v.co) for v in item.evaluated_get(graph).data.vertices]


def use(path):
    """Import a face, open its jaw, and save the scene in the folder of the DNA file."""
    assert bpy.ops.risorius.import_dna(filepath=path) == {"FINISHED"}
    rig = next(o for o in bpy.data.objects if "risorius_controls" in o)
    bone = rig["risorius_controls"].pose.bones["face"]
    before = _vertices(rig["risorius_mesh_000"])
    bone["CTRL_expressions.jawOpen"] = 1.0
    rig["risorius_controls"].update_tag()
    bpy.context.view_layer.update()
    moved = _vertices(rig["risorius_mesh_000"]) != before
    bpy.ops.wm.save_as_mainfile(filepath=str(Path(path).with_suffix(".blend")))
    import risorius

    return {**of_ours(), "moved": moved, "wheel": risorius.__file__}


def add(_nothing=""):
    """Add the sample face by Add > Face; fail if this starts a program or uses the network."""

    def forbidden(*_arguments, **_options):
        raise AssertionError("the sample face needs another program")

    subprocess.Popen.__init__ = forbidden
    socket.socket.connect = forbidden
    assert bpy.ops.risorius.add_character() == {"FINISHED"}
    rig = next(o for o in bpy.data.objects if "risorius_controls" in o)
    head = next(o for o in bpy.data.objects if o.type == "MESH" and "head" in o.name)

    before = _vertices(head)
    rig["risorius_controls"].pose.bones["face"]["CTRL_expressions.jawOpen"] = 1.0
    rig["risorius_controls"].update_tag()
    bpy.context.view_layer.update()
    after = _vertices(head)
    return {
        "name": rig.name.removesuffix("_rig"),
        "moved": sum(a != b for a, b in zip(before, after, strict=True)),
        "textures": {i.name: list(i.size) for i in bpy.data.images if i.packed_file},
        "licence": rig["risorius_controls"].data.get("dna_licence", ""),
    }


def disable(_nothing=""):
    """Disable the add-on, as the check box in the preferences does."""
    bpy.ops.preferences.addon_disable(module=MODULE)
    bpy.ops.wm.save_userpref()
    return of_ours()


def look(blend):
    """Open a .blend file with a face while the add-on is disabled or removed, and change the frame.

    Returns the registered parts of the add-on, and the number of the face's meshes.
    """
    bpy.ops.wm.open_mainfile(filepath=blend)
    bpy.context.scene.frame_set(3)
    rig = next(o for o in bpy.data.objects if "risorius_controls" in o)
    return {**of_ours(), "meshes": len([o for o in bpy.data.objects if o.parent == rig])}


def remove(_nothing=""):
    """Uninstall the extension, as Uninstall in the preferences does."""
    _manager()
    names = [r.module for r in bpy.context.preferences.extensions.repos]
    bpy.ops.extensions.package_uninstall(repo_index=names.index("user_default"), pkg_id="risorius")
    bpy.ops.wm.save_userpref()
    return of_ours()


STEPS = {
    "install": install,
    "use": use,
    "add": add,
    "disable": disable,
    "look": look,
    "remove": remove,
}


if __name__ == "__main__":
    code = 1
    try:
        step, *arguments = sys.argv[sys.argv.index("--") + 1 :]
        if not bpy.app.binary_path:
            _read_preferences(step)
        print("RESULT " + json.dumps(STEPS[step](*arguments)))
        code = 0
    except BaseException:  # noqa: BLE001  printed, and the exit code says it
        traceback.print_exc()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)
