# SPDX-License-Identifier: GPL-3.0-or-later
"""Names for annotations where Blender's own say too little.

Objects by what they hold: Blender's own class may hold data of any kind. While the add-on runs all
of them are bpy.types.Object. What is Any here is so because the base class lacks what its kinds
have.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import bpy

Context = Any  # its members may be None and are read as methods: one of them is named property
Node = Any  # one of some hundred kinds, each with settings of its own
Attribute = Any  # of a mesh: each type has data of its own
NodeTree = Any  # of a material, a scene or a group
Socket = Any  # each kind has another default_value
Animated = bpy.types.Object | bpy.types.Key  # what a face has that plays actions

if TYPE_CHECKING:

    class ArmatureObject(bpy.types.Object):
        """The deforming or the control armature of a character."""

        data: bpy.types.Armature  # pyright: ignore[reportIncompatibleVariableOverride]
        risorius_layer_rules: bool  # see layer_properties, as the two below
        risorius_layers_index: int
        risorius_reactions_index: int

        @property
        def pose(self) -> bpy.types.Pose: ...
        @property
        def original(self) -> ArmatureObject: ...

    class MeshObject(bpy.types.Object):
        """A mesh of a character."""

        data: bpy.types.Mesh  # pyright: ignore[reportIncompatibleVariableOverride]

    class Depsgraph(bpy.types.Depsgraph):
        """An evaluated dependency graph: it has a scene."""

        @property
        def scene(self) -> bpy.types.Scene: ...

else:
    ArmatureObject = MeshObject = bpy.types.Object
    Depsgraph = bpy.types.Depsgraph


def current_context() -> Context:
    """What bpy.context is now."""
    return bpy.context
