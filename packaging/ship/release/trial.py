# SPDX-License-Identifier: MIT
"""Installs, updates and removes the extension as a user does, in Blender's window; see trial.sh.

    blender --python trial.py -- STEP,STEP,... OUT URL

Steps are generators. A step yields a float to let Blender's window run for that number of seconds,
and at last a dictionary with its results. Results are appended to OUT/results.jsonl as one line of
JSON. OUT/*.png are pictures of the whole screen.
"""

import json
import os
import subprocess
import sys
import traceback
from contextlib import suppress
from pathlib import Path

import addon_utils
import bpy

NAMES, OUT, URL = sys.argv[sys.argv.index("--") + 1 :]
OUT = Path(OUT)
NAME = "Risorius trial"
SLIDER = "CTRL_expressions.jawOpen"


def shot(name):
    """Take a picture of the whole screen, OUT/<name>.png."""
    subprocess.run(["import", "-window", "root", str(OUT / f"{name}.png")], check=True)


def changed(one, other):
    """Root mean square difference of two pictures of the screen; 1 is black against white."""
    command = ["compare", "-metric", "RMSE", OUT / f"{one}.png", OUT / f"{other}.png", "null:"]
    done = subprocess.run(command, stderr=subprocess.PIPE, text=True, check=False)
    return float(done.stderr.split("(")[1].split(")")[0])


def repository():
    """Index and module name of the repository that this trial added to Blender."""
    for index, repo in enumerate(bpy.context.preferences.extensions.repos):
        if repo.name == NAME:
            return index, repo.module
    raise RuntimeError("the repository is not there")


def module():
    return f"bl_ext.{repository()[1]}.risorius"


def window():
    """A context override that lets operators run in the 3D viewport of the main window."""
    main = bpy.context.window_manager.windows[0]
    area = next(a for a in main.screen.areas if a.type == "VIEW_3D")
    region = next(r for r in area.regions if r.type == "WINDOW")
    return bpy.context.temp_override(window=main, area=area, region=region)


def show_tab():
    """Open the sidebar with the Risorius tab. Needs the override of window()."""
    bpy.context.space_data.show_region_ui = True
    sidebar = next(r for r in bpy.context.area.regions if r.type == "UI")
    with suppress(AttributeError, TypeError):  # raised until the sidebar is first drawn
        sidebar.active_panel_category = "Risorius"


def preferences(section="EXTENSIONS"):
    bpy.ops.screen.userpref_show("INVOKE_DEFAULT")
    bpy.context.preferences.active_section = section
    bpy.context.window_manager.extension_search = "risorius"
    bpy.context.preferences.view.show_developer_ui = False


def close_preferences():
    for one in list(bpy.context.window_manager.windows)[1:]:
        with bpy.context.temp_override(window=one):
            bpy.ops.wm.window_close()


def said(call, **arguments):
    """The result of an operator as a list such as ["FINISHED"], or the text of its error."""
    try:
        return sorted(call(**arguments))
    except RuntimeError as error:
        return str(error).strip()


def face():
    rig = next(o for o in bpy.data.objects if "risorius_controls" in o)
    return rig, rig["risorius_controls"].pose.bones["face"]


def chin(value):
    """The positions of the head's vertices, after the slider jawOpen has been set to a value."""
    rig, bone = face()
    bone[SLIDER] = value
    rig["risorius_controls"].update_tag()
    bpy.context.view_layer.update()
    head = next(o for o in bpy.data.objects if o.type == "MESH" and "head" in o.name)
    graph = bpy.context.evaluated_depsgraph_get()
    return [tuple(v.co) for v in head.evaluated_get(graph).data.vertices]


def moves():
    """The number of the head's vertices that the slider jawOpen moves."""
    return sum(a != b for a, b in zip(chin(0.0), chin(1.0), strict=True))


def ours():
    """The classes, modules and enabled add-ons of Risorius in this process."""
    return {
        "classes": [n for n in dir(bpy.types) if n.startswith("RISORIUS_")],
        "modules": sorted(m for m in sys.modules if m.startswith("bl_ext.") and "risorius" in m),
        "enabled": [a.module for a in bpy.context.preferences.addons if "risorius" in a.module],
    }


def native():
    return sys.modules[f"{module()}.native"]


def install():
    """Add the repository, find and install the extension, add a face, open its jaw, save."""
    bpy.context.preferences.system.use_online_access = True
    bpy.ops.preferences.extension_repo_add(name=NAME, remote_url=URL, type="REMOTE")
    index, _ = repository()
    synced = said(bpy.ops.extensions.repo_sync, repo_index=index)
    preferences()
    yield 3.0
    shot("1-found")
    made = said(
        bpy.ops.extensions.package_install,
        repo_index=index,
        pkg_id="risorius",
        enable_on_install=True,
    )
    yield 3.0
    shot("2-installed")
    bpy.ops.wm.save_userpref()
    close_preferences()
    yield 1.0
    bpy.data.objects.remove(bpy.data.objects["Cube"])  # because the cube would hide the face
    with window():
        added = said(bpy.ops.risorius.add_character)
        show_tab()
    yield 2.0
    with window():
        show_tab()
    yield 3.0
    shot("3-face")
    moved = moves()
    with window():
        bpy.context.area.tag_redraw()  # dragging a slider redraws the view too
    yield 3.0
    shot("4-jaw-open")
    seen = changed("3-face", "4-jaw-open")
    bpy.ops.wm.save_as_mainfile(filepath=str(OUT / "face.blend"))
    yield {"sync": synced, "install": made, "add": added, "moved": moved,
           "seen": seen, "version": native().addon_version()}  # fmt: skip


def update():
    """Open the saved face, update the extension while the face is open, and save."""
    bpy.ops.wm.open_mainfile(filepath=str(OUT / "face.blend"))
    yield 2.0
    before, moved = native().addon_version(), moves()
    index, _ = repository()
    said(bpy.ops.extensions.repo_sync, repo_index=index)
    preferences()
    yield 3.0
    shot("5-update-found")
    made = said(bpy.ops.extensions.package_upgrade_all)
    yield 3.0
    shot("6-updated")
    close_preferences()
    with window():
        show_tab()
    yield 2.0
    shot("7-says-restart")
    bpy.context.scene.frame_set(2)
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.save_userpref()
    yield {"before": before, "moved": moved, "update": made, "after": native().addon_version(),
           "problem": native().problem()}  # fmt: skip


def after():
    """After a restart: check the new version, the saved face and the self-test."""
    bpy.ops.wm.open_mainfile(filepath=str(OUT / "face.blend"))
    yield 2.0
    found = {"version": native().addon_version(), "problem": native().problem(), "moved": moves()}
    found["self_test"] = said(bpy.ops.risorius.self_test)
    yield 3.0
    shot("8-self-test")
    preferences("ADDONS")
    bpy.ops.preferences.addon_expand(module=module())
    yield 3.0
    shot("9-preferences")
    yield found


def twice():
    """Install the add-on a second time, into another repository, and uninstall this copy."""
    path = next((OUT / "twice").glob("*.zip"))
    found = {"install": said(
        bpy.ops.extensions.package_install_files,
        filepath=str(path), repo="user_default", enable_on_install=True,
    )}  # fmt: skip
    yield 2.0
    preferences("ADDONS")
    yield 3.0
    shot("10-twice")
    found["enabled"] = ours()["enabled"]
    found["handlers"] = len([h for h in bpy.app.handlers.frame_change_post
                             if "risorius" in getattr(h, "__module__", "")])  # fmt: skip
    names = [r.module for r in bpy.context.preferences.extensions.repos]
    found["uninstall"] = said(
        bpy.ops.extensions.package_uninstall,
        repo_index=names.index("user_default"), pkg_id="risorius",
    )  # fmt: skip
    bpy.ops.wm.save_userpref()
    yield found


def remove():
    """Disable and remove the extension, and remove the repository."""
    bpy.ops.preferences.addon_disable(module=module())
    disabled = ours()
    index, _ = repository()
    gone = said(bpy.ops.extensions.package_uninstall, repo_index=index, pkg_id="risorius")
    preferences()
    yield 3.0
    shot("11-removed")
    bpy.ops.preferences.extension_repo_remove(index=index, remove_files=True)
    bpy.ops.wm.save_userpref()
    yield {"disabled": disabled, "remove": gone, "left": ours()}


def look():
    """After a restart: list what is left of Risorius."""
    addon_utils.modules_refresh()
    yield ours()


STEPS = {f.__name__: f for f in (install, update, after, twice, remove, look)}


def run():
    """Continue the current step or start the next one. Ends the process after the last step.

    Returns: seconds until the next call, for bpy.app.timers.
    """
    try:
        given = next(steps[0])
    except BaseException:  # noqa: BLE001  printed, and the result says it
        traceback.print_exc()
        given = {"traceback": traceback.format_exc()}
    if isinstance(given, float):
        return given
    row = {"step": names.pop(0), "blender": bpy.app.version_string, **given}
    with (OUT / "results.jsonl").open("a", encoding="utf-8") as file:
        file.write(json.dumps(row) + "\n")
    steps.pop(0)
    if not steps:
        sys.stdout.flush()
        os._exit(0)  # because quitting normally would ask about unsaved changes
    return 1.0


bpy.context.preferences.view.show_splash = False
names = NAMES.split(",")
steps = [STEPS[name]() for name in names]
if bpy.app.background:
    while True:
        run()
bpy.app.timers.register(run, first_interval=2.0, persistent=True)
