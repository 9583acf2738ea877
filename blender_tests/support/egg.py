# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes an egg-shaped head with shape keys and without a rig, from which tests make a joint rig."""

import importlib.util
from pathlib import Path

import bpy
import numpy as np

_FILE = Path(__file__).parents[2] / "tests" / "python" / "support" / "face_shapes.py"
_SPEC = importlib.util.spec_from_file_location("face_shapes", _FILE)
face_shapes = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(face_shapes)

_METRES = 0.01


def egg():
    """Add the head as active object.

    The head faces -y, and has a shape key for each expression of face_shapes.expressions.
    """
    positions, faces = face_shapes.head()
    mesh = bpy.data.meshes.new("Egg")
    mesh.from_pydata(_to_blender(positions).tolist(), [], faces.tolist())
    item = bpy.data.objects.new("Egg", mesh)
    bpy.context.scene.collection.objects.link(item)
    item.shape_key_add(name="Basis")
    for name, delta in face_shapes.expressions(positions).items():
        key = item.shape_key_add(name=name)
        key.data.foreach_set("co", _to_blender(positions + delta).astype(np.float32).ravel())
        key.value = 0.0
    bpy.context.view_layer.objects.active = item
    item.select_set(True)
    return item


def _to_blender(points):
    """Convert points from centimetres with y up to metres with z up."""
    return np.stack([points[:, 0], -points[:, 2], points[:, 1]], axis=1) * _METRES
