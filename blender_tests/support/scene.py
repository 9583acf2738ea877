# SPDX-License-Identifier: GPL-3.0-or-later
"""Short functions with which tests edit and read a scene."""

import sys

import bpy
import numpy as np
import risorius

from . import oracle

MODULE = "bl_ext.user_default.risorius"
TOLERANCE = 1e-4  # of the head's size: float32 of Blender and bone axes kept as a roll angle


def submodule(name):
    """A module of the enabled add-on."""
    return sys.modules[f"{MODULE}.{name}"]


def load(path, mode="AUTO", **options):
    """Import a DNA file. Returns the deforming armature."""
    before = set(bpy.data.objects)
    assert bpy.ops.risorius.import_dna(filepath=str(path), shape_mode=mode, **options) == {
        "FINISHED"
    }
    return next(o for o in bpy.data.objects if o not in before and "risorius_controls" in o)


def add_board(kind="COMPLETE"):
    """Add a board to the active face and return to object mode."""
    assert bpy.ops.risorius.add_board(kind=kind) == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")


def controls(rig):
    """The control armature."""
    return rig["risorius_controls"]


def face(rig):
    """The bone with the sliders."""
    return controls(rig).pose.bones["face"]


def meshes(rig):
    """DNA mesh index -> mesh object."""
    found = [rig[k] for k in rig.keys() if k.startswith("risorius_mesh_")]  # noqa: SIM118
    return {o["dna_mesh"]: o for o in found}


def update(*items):
    """Tag objects and evaluate the scene."""
    for item in items:
        item.update_tag()
    bpy.context.view_layer.update()


def set_controls(rig, **values):
    """Set sliders by the ends of their names, and update."""
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
    """The raw controls from the current values of the sliders, float32[R]."""
    labels = submodule("logic.base.names").unique_labels(risorius.load(str(path)).raw_control_names)
    return np.array([float(face(rig)[n]) for n in labels], np.float32)


def error_against_oracle(rig, path, raw, lod=0, unit_scale=1.0):
    """The largest distance of Blender's vertices from the oracle's, as a share of the mesh's size.

    The face may be at any place.
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
    """The F-curves of an object's own action, in Blender with slots and without."""
    data = item.animation_data
    if hasattr(data, "action_slot"):
        bags = (s.channelbag(data.action_slot) for s in data.action.layers[0].strips)
        return [c for bag in bags if bag for c in bag.fcurves]
    return list(data.action.fcurves)


def pose_bones(rig):
    """Take a face out of Direct mode, so that the bones of its deforming armature are posed."""
    rig["risorius_skinning"] = "LIVE"
    update(controls(rig))


def snapshot(rig):
    """Vertices of all meshes of a character, joined."""
    return np.concatenate([evaluated(m) for _, m in sorted(meshes(rig).items())])


def counts():
    """The number of datablocks of every kind."""
    return {
        p.identifier: len(getattr(bpy.data, p.identifier))
        for p in bpy.data.bl_rna.properties
        if p.type == "COLLECTION" and p.identifier != "all_ids"  # since 5.2, all others together
    }


def invalid_drivers():
    """Data paths of invalid drivers in the file, and the number of all drivers."""
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
