# SPDX-License-Identifier: MIT
"""Writes frames of faces by a plain loop, to measure the time that Blender itself takes."""

from __future__ import annotations

import bpy
import numpy as np

CHANNELS = {"location": 3, "rotation_quaternion": 4, "scale": 3}


class Bare:
    """Replays poses that the add-on has computed.

    A pose consists of vertex positions, or in the add-on's shape mode Live of bones and shape keys.
    """

    def __init__(self, rigs):
        # Names instead of objects, because an undo replaces all objects.
        self.rigs, self.poses, self.turn = [rig.name for rig in rigs], [], 0

    def remember(self):
        """Store the scene's present pose; write() writes the stored poses in turn."""
        pose = []
        for rig in map(bpy.data.objects.get, self.rigs):
            meshes = [item for item in rig.children_recursive if item.type == "MESH"]
            bones = {}
            for name, width in CHANNELS.items():
                bones[name] = np.empty(len(rig.pose.bones) * width, np.float32)
                rig.pose.bones.foreach_get(name, bones[name])
            if any("risorius_finished" in item for item in meshes):
                bones = {}
            keys = []
            for item in meshes:
                key = item.data.shape_keys
                if key is not None and len(key.key_blocks) == 2 and not item.hide_viewport:
                    points = np.empty(len(key.key_blocks[1].points) * 3, np.float32)
                    key.key_blocks[1].points.foreach_get("co", points)
                    keys.append((item.name, points))
            pose.append((rig.name, bones, keys))
        self.poses.append(pose)

    def begin(self):
        """Disable Armature modifiers of meshes that get final positions, as the add-on does."""
        self._switch(False)

    def end(self):
        """Enable the modifiers that begin() disabled.

        Otherwise the add-on would assume that a user disabled them.
        """
        self._switch(True)

    def _switch(self, on):
        for rig_name, bones, keys in self.poses[0]:
            for item_name, _points in keys if not bones else ():
                for modifier in bpy.data.objects[item_name].modifiers:
                    ours = modifier.type == "ARMATURE" and modifier.object.name == rig_name
                    if ours and modifier.show_viewport != on:
                        modifier.show_viewport = on

    def write(self, *_arguments):
        """Write the next stored pose into the scene; can be used as a handler of Blender."""
        self.turn += 1
        for rig_name, bones, keys in self.poses[self.turn % len(self.poses)]:
            rig = bpy.data.objects[rig_name]
            for name, values in bones.items():
                rig.pose.bones.foreach_set(name, values)
            if bones:
                rig.update_tag(refresh={"OBJECT"})
            for item_name, points in keys:
                item = bpy.data.objects[item_name]
                key = item.data.shape_keys
                key.key_blocks[1].points.foreach_set("co", points)
                if bones:
                    key.update_tag()
                item.data.update_tag()
