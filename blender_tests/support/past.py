# SPDX-License-Identifier: GPL-3.0-or-later
"""Opens .blend files of old versions in several ways, and records how their faces move."""

import json
import os
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np

DATA = Path(__file__).resolve().parents[1] / "data" / "past"
FRAMES = (1.0, 4.5, 9.0, 14.0, 20.0, 31.0)
AS_SAVED = "as saved"
LIVE_AGAIN = "live again"
# Name of a file -> ways to play it: AS_SAVED, LIVE_AGAIN (after its bake was undone), or the name
# of an action that is assigned before.
PLAYS = {
    "layers": (AS_SAVED, "Other"),
    "meta": (AS_SAVED,),
    "linked_action": (AS_SAVED,),
    "shared_action": (AS_SAVED,),
    "nla": (AS_SAVED,),
    "baked_result": (AS_SAVED, LIVE_AGAIN),
    "baked_controls": (AS_SAVED, LIVE_AGAIN),
    "shape_modes": (AS_SAVED,),
    "bones": (AS_SAVED,),
    "overridden_live": (AS_SAVED,),
    "overridden_keys": (AS_SAVED,),
}


@contextmanager
def scalar():
    """Context manager in which faces are evaluated without SIMD, with equal results on all CPUs."""
    before = os.environ.get("RISORIUS_SIMD")
    os.environ["RISORIUS_SIMD"] = "scalar"
    try:
        yield
    finally:
        if before is None:
            del os.environ["RISORIUS_SIMD"]
        else:
            os.environ["RISORIUS_SIMD"] = before


def rigs():
    """The deforming armatures of all faces in the scene, sorted by name; linked faces count too."""
    found = [o for o in bpy.context.scene.objects if "risorius_controls" in o]
    return sorted(found, key=lambda o: o.name)


def controls():
    """The control armatures of all faces in the scene, in the order of `rigs`."""
    return [rig["risorius_controls"] for rig in rigs()]


def open_it(path, _folder):
    """Open a file.

    Blender 5.2 raises an error when it repairs hierarchy roots of overrides from 4.2; this error is
    ignored.
    """
    try:
        bpy.ops.wm.open_mainfile(filepath=str(path))
    except RuntimeError as error:
        if "library override hierarchy root" not in str(error):
            raise


def _open_if_needed(path, folder):
    """Open a file, unless it is open and unchanged: opening takes most of the tests' time."""
    if bpy.data.filepath != str(path) or "touched" in bpy.context.scene:
        open_it(path, folder)


def save_and_open(path, folder):
    """Open a file, save it under another name, and open the saved copy."""
    _open_if_needed(path, folder)
    again = folder / f"again_{path.name}"
    bpy.ops.wm.save_as_mainfile(filepath=str(again))
    open_it(again, folder)


def append(path, _folder):
    """Append the characters and actions of a .blend to an empty file."""
    bpy.ops.wm.read_homefile(use_empty=True)
    with bpy.data.libraries.load(str(path)) as (there, _here):
        collections, actions = list(there.collections), list(there.actions)
    for name in collections:
        bpy.ops.wm.append(directory=f"{path}/Collection/", filename=name)
    for name in actions:
        if name not in bpy.data.actions:
            bpy.ops.wm.append(directory=f"{path}/Action/", filename=name)
    bpy.context.view_layer.update()


def link(path, _folder):
    """Link the characters and actions of a .blend into an empty file."""
    bpy.ops.wm.read_homefile(use_empty=True)
    with bpy.data.libraries.load(str(path), link=True) as (there, here):
        collections = list(there.collections)
        here.actions = list(there.actions)
    for name in collections:
        bpy.ops.wm.link(directory=f"{path}/Collection/", filename=name, instance_collections=False)
    bpy.context.view_layer.update()


def override(path, folder):
    """Link the characters of a .blend and make library overrides of them."""
    link(path, folder)
    for rig in rigs():
        bpy.context.view_layer.objects.active = rig["risorius_controls"]
        assert bpy.ops.risorius.make_override() == {"FINISHED"}
    bpy.context.view_layer.update()


def undo(path, folder):
    """Open a file, change its sliders and layers, and undo the change."""
    bpy.context.preferences.edit.use_global_undo = True
    _open_if_needed(path, folder)
    bpy.ops.ed.undo_push(message="as it was")
    for item in controls():
        item.pose.bones["face"]["CTRL_expressions.jawOpen"] = 0.77
        for layer in item.risorius_layers:
            layer.weight = 0.123
        item.update_tag()
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message="changed")
    bpy.ops.ed.undo()
    bpy.context.view_layer.update()


ROUTES = {
    "open": open_it,
    "undo": undo,
    "save": save_and_open,
    "append": append,
    "link": link,
    "override": override,
}
# Ways to open a file (keys of ROUTES) that are not used for files with library overrides.
NOT_OVERRIDDEN = ("append", "link", "override")


def routes_of(name):
    """The ways to open the file `name` (keys of ROUTES)."""
    skipped = NOT_OVERRIDDEN if name.startswith("overridden") else ()
    return [route for route in ROUTES if route not in skipped]


def show(mode):
    """Set the mode of all faces: Direct mode ("AUTO"), or posed bones ("LIVE").

    Linked faces and library overrides keep their mode.
    """
    for rig in rigs():
        if rig.library is None and rig.override_library is None:
            rig["risorius_skinning"] = mode
            rig["risorius_controls"].update_tag()
    bpy.context.view_layer.update()


def prepare(play):
    """Prepare the open file for playing, with posed bones as when the files were made.

    Args:
        play: a way to play the file, from PLAYS.
    """
    show("LIVE")
    if play != AS_SAVED:
        bpy.context.scene["touched"] = True
    for rig, item in [(r, r["risorius_controls"]) for r in rigs()]:
        if item.library is not None:
            continue  # linked: its state in the library stays
        _choose_slot(item)
        if play == LIVE_AGAIN:
            bpy.context.view_layer.objects.active = item
            if bpy.ops.risorius.unbake.poll():
                assert bpy.ops.risorius.unbake() == {"FINISHED"}, rig.name
        elif play != AS_SAVED:
            action = next(a for a in bpy.data.actions if a.name == play)
            item.animation_data.action = action
            _choose_slot(item)
    bpy.context.view_layer.update()


def _choose_slot(item):
    """Choose the first slot of an object's action if no slot is chosen.

    If an override and its action come from 4.2, Blender 5.0 chooses no slot.
    """
    data = item.animation_data
    if data is not None and data.action is not None and hasattr(data, "action_slot"):
        data.action_slot = data.action_slot or data.action.slots[0]


def film(frames=FRAMES, read=None):
    """Play the open file, and record its faces: {"face/frame/kind of value": float32[...]}.

    Args:
        frames: frames to play, in this order.
        read: function of the deforming armature and the depsgraph that returns kind of value ->
            values; None: `_read`, which reads bones, shape keys, channels, maps and the world
            matrix.
    """
    found = {}
    for frame in frames:
        bpy.context.scene.frame_set(int(np.floor(frame)), subframe=float(frame % 1))
        bpy.context.view_layer.update()
        depsgraph = bpy.context.evaluated_depsgraph_get()
        for rig in rigs():
            for what, values in (read or _read)(rig, depsgraph).items():
                found[f"{rig.name}/{frame:g}/{what}"] = values
    return found


def _read(rig, depsgraph):
    """Evaluated bones, shape keys, maps and world matrix of a face, and its original channels."""
    seen = rig.evaluated_get(depsgraph)
    bones = seen.pose.bones
    found = {
        "bones": np.array([_numbers(bone) for bone in bones], np.float32),
        "channels": np.array(list(rig["channels"]), np.float32),
        "maps": np.array(list(seen["maps"]), np.float32),
        "place": np.array(seen.matrix_world, np.float32),
    }
    for key in sorted(k for k in rig.keys() if k.startswith("risorius_mesh_")):  # noqa: SIM118
        item = rig[key].evaluated_get(depsgraph)
        blocks = item.data.shape_keys
        if blocks is None:
            continue
        blocks = blocks.evaluated_get(depsgraph).key_blocks
        number = key.removeprefix("risorius_mesh_")
        found[f"values{number}"] = np.array([b.value for b in blocks], np.float32)
        live = rig[key].data.shape_keys.key_blocks.get("<channel sum>")
        if live is not None:
            points = np.empty(len(live.points) * 3, np.float32)
            live.points.foreach_get("co", points)
            found[f"points{number}"] = points
    return found


def vertices(rig, depsgraph):
    """The vertices of each mesh of a face in world space, float64[V, 3]; for `read` of `film`."""
    found = {}
    for key in sorted(k for k in rig.keys() if k.startswith("risorius_mesh_")):  # noqa: SIM118
        seen = rig[key].evaluated_get(depsgraph)
        points = np.empty(len(seen.data.vertices) * 3, np.float32)
        seen.data.vertices.foreach_get("co", points)
        place = np.array(seen.matrix_world)
        found[key] = points.reshape(-1, 3) @ place[:3, :3].T + place[:3, 3]
    return found


def direct_rigs():
    """The deforming armatures of faces that have at least one mesh in Direct mode."""
    return [
        rig
        for rig in rigs()
        if any("risorius_finished" in rig[k] for k in rig.keys() if k.startswith("risorius_mesh_"))  # noqa: SIM118
    ]


def _numbers(bone):
    turn = bone.rotation_quaternion
    if bone.rotation_mode not in ("QUATERNION", "AXIS_ANGLE"):
        turn = (*bone.rotation_euler, 0.0)
    return (*bone.location, *turn, *bone.scale)


def films(folder, name, work, routes=None):
    """Open a file in each way of ROUTES, and play it in each way of PLAYS.

    Args:
        folder: folder of the files.
        name: a key of PLAYS.
        work: folder for copies of the file.
        routes: ways to open the file; None: all ways of `routes_of`.

    Yields:
        "name/route/play", and what `film` recorded.
    """
    for route in routes or routes_of(name):
        ROUTES[route](folder / f"{name}.blend", work)
        for play in PLAYS[name]:
            prepare(play)
            yield f"{name}/{route}/{play}", film()


def record(folder):
    """Record the files of a folder by `film`, and write the recordings to the folder's values.npz.

    Equal recordings are written once.
    """
    index, kept = {}, []
    for name in PLAYS:
        for key, found in films(folder, name, Path(bpy.app.tempdir)):
            flat = np.concatenate([v.ravel() for v in found.values()])
            assert np.isfinite(flat).all(), key
            same = next((i for i, k in enumerate(kept) if np.array_equal(k, flat)), len(kept))
            if same == len(kept):
                kept.append(flat)
            index[key] = {"film": same, "layout": [[k, v.size] for k, v in found.items()]}
    named = {f"film{i}": flat for i, flat in enumerate(kept)}
    np.savez_compressed(folder / "values.npz", index=json.dumps(index), **named)


def recorded(folder):
    """The recordings in a folder's values.npz: "name/route/play" -> result of `film`."""
    with np.load(folder / "values.npz") as held:
        films_of = {}
        for key, entry in json.loads(str(held["index"])).items():
            ends = np.cumsum([size for _name, size in entry["layout"]])[:-1]
            parts = np.split(held[f"film{entry['film']}"], ends)
            names = [name for name, _size in entry["layout"]]
            films_of[key] = dict(zip(names, parts, strict=True))
        return films_of
