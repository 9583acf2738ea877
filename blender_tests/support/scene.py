# SPDX-License-Identifier: GPL-3.0-or-later
"""Short functions for tests that edit and read a scene."""

import sys

import bpy
import numpy as np
import risorius

from . import oracle

MODULE = "bl_ext.user_default.risorius"
TOLERANCE = 1e-4  # relative to the head's size, for float32 and bone axes stored as a roll


def submodule(name):
    """A module of the enabled add-on, such as "scene.lod.lods"."""
    return sys.modules[f"{MODULE}.{name}"]


def load(path, mode="AUTO", **options):
    """Import a DNA file. Returns the deforming armature.

    Args:
        path: path of the DNA file.
        mode: shape mode: "AUTO" (Direct mode), "LIVE" or "KEYS".
        options: other properties of the import operator.
    """
    before = set(bpy.data.objects)
    assert bpy.ops.risorius.import_dna(filepath=str(path), shape_mode=mode, **options) == {
        "FINISHED"
    }
    return next(o for o in bpy.data.objects if o not in before and "risorius_controls" in o)


def add_board(kind="COMPLETE"):
    """Add a face board to the active face, and return to object mode.

    Args:
        kind: kind of the board, "COMPLETE" or "PRIMARY".
    """
    assert bpy.ops.risorius.add_board(kind=kind) == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")


def controls(rig):
    """The control armature of a face, given its deforming armature."""
    return rig["risorius_controls"]


def face(rig):
    """The pose bone of a face whose custom properties are the sliders."""
    return controls(rig).pose.bones["face"]


def meshes(rig):
    """The mesh objects of a face: index of the mesh in the DNA file -> object."""
    found = [rig[k] for k in rig.keys() if k.startswith("risorius_mesh_")]  # noqa: SIM118
    return {o["dna_mesh"]: o for o in found}


def update(*items):
    """Tag objects as changed and evaluate the view layer."""
    for item in items:
        item.update_tag()
    bpy.context.view_layer.update()


def set_controls(rig, **values):
    """Set sliders of a face and evaluate the scene.

    Args:
        rig: deforming armature of the face.
        values: end of a slider's name -> value.
    """
    bone = face(rig)
    for end, value in values.items():
        name = next(k for k in bone.keys() if k.endswith(end))  # noqa: SIM118
        bone[name] = value
    update(controls(rig))


def evaluated(item):
    """The evaluated vertices of a mesh in world space, float64[V, 3]."""
    seen = item.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = seen.to_mesh()
    flat = np.empty(len(mesh.vertices) * 3, np.float32)
    mesh.vertices.foreach_get("co", flat)
    seen.to_mesh_clear()
    world = np.array(seen.matrix_world)
    return flat.reshape(-1, 3).astype(np.float64) @ world[:3, :3].T + world[:3, 3]


def raw_of(rig, path):
    """The values of a face's sliders in the order of the raw controls, float32[R].

    Args:
        rig: deforming armature of the face.
        path: path of the face's DNA file.
    """
    labels = submodule("logic.base.names").unique_labels(risorius.load(str(path)).raw_control_names)
    return np.array([float(face(rig)[n]) for n in labels], np.float32)


def error_against_oracle(rig, path, raw, lod=0, unit_scale=1.0):
    """Largest coordinate difference between Blender's and the oracle's vertices of a face.

    The difference is a share of the size of the mesh. The armature may have any transform.

    Args:
        rig: deforming armature.
        path: the face's DNA file.
        raw: float32[R], raw controls for the oracle.
        lod: level of detail to compare.
        unit_scale: metres per Blender unit.
    """
    place = np.array(rig.matrix_world)
    dna = risorius.load(str(path))
    pose = risorius.Rig(dna).evaluate(np.asarray(raw, np.float32), lod)
    worst = 0.0
    for index, item in meshes(rig).items():
        if lod not in list(item["dna_lods"]):
            continue
        wanted = oracle.vertices(dna, index, pose, unit_scale) @ place[:3, :3].T + place[:3, 3]
        size = np.ptp(wanted, axis=0).max()
        worst = max(worst, float(np.abs(evaluated(item) - wanted).max() / size))
    return worst


def curves(item):
    """The F-curves of an object's assigned action, whether Blender has action slots or not."""
    data = item.animation_data
    if hasattr(data, "action_slot"):
        bags = (s.channelbag(data.action_slot) for s in data.action.layers[0].strips)
        return [c for bag in bags if bag for c in bag.fcurves]
    return list(data.action.fcurves)


def pose_bones(rig):
    """Switch a face from Direct to Live mode, so that its deforming armature has posed bones."""
    rig["risorius_skinning"] = "LIVE"
    update(controls(rig))


def snapshot(rig):
    """Evaluated vertices of all meshes of a face in world space, concatenated, float64[V, 3]."""
    return np.concatenate([evaluated(m) for _, m in sorted(meshes(rig).items())])


def counts():
    """Type of data-block -> number of such data-blocks in the open .blend file."""
    return {
        p.identifier: len(getattr(bpy.data, p.identifier))
        for p in bpy.data.bl_rna.properties
        if p.type == "COLLECTION" and p.identifier != "all_ids"  # since 5.2, contains all others
    }


def invalid_drivers():
    """The invalid drivers of objects, shape keys and node trees of materials.

    Returns (name of the owner, data path) of each invalid driver, and the number of all drivers of
    these owners in the .blend file.
    """
    owners = [
        *bpy.data.objects,
        *bpy.data.shape_keys,
        *(m.node_tree for m in bpy.data.materials if m.node_tree),
    ]
    bad, seen = [], 0
    for owner in owners:
        for curve in owner.animation_data.drivers if owner.animation_data else ():
            seen += 1
            if not curve.driver.is_valid or not curve.is_valid:
                bad.append((owner.name, curve.data_path))
    return bad, seen
