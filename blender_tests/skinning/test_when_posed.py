# SPDX-License-Identifier: GPL-3.0-or-later
"""Bones are posed only while something needs them; meanwhile meshes stay in Direct mode.

In pose mode the face is in Live mode.
"""

import bpy
import pytest
from support import both_ways, scene

BONES_NEAR = 1e-5  # tolerance of elements of posed matrices, in metres and ratios


@pytest.fixture
def pair(dna_file):
    pair = both_ways.Pair(dna_file)
    pair.set(jawOpen=0.6, mouthCornerPullL=0.5, eyeLookUpL=0.4)
    assert both_ways.is_direct(pair.direct)
    assert not both_ways.plan(pair.direct).posed
    assert pair.bones_apart() > 1e-3
    return pair


def _empty(name="Empty"):
    made = bpy.data.objects.new(name, None)
    bpy.context.scene.collection.objects.link(made)
    return made


def _gone(item):
    return lambda: bpy.data.objects.remove(item)


def selected(rig):
    rig.hide_viewport = False
    rig.hide_set(False)
    rig.select_set(True)
    return lambda: rig.select_set(False)


def child_of_a_bone(rig):
    child = _empty()
    child.parent, child.parent_type, child.parent_bone = rig, "BONE", "FACIAL_C_Jaw"
    return _gone(child)


def constraint(rig):
    item = _empty()
    hold = item.constraints.new("COPY_TRANSFORMS")
    hold.target, hold.subtarget = rig, "FACIAL_C_Jaw"
    return _gone(item)


def bone_constraint_elsewhere(rig):
    """Make a bone of another armature follow the jaw bone by a constraint."""
    armature = bpy.data.objects.new("Other", bpy.data.armatures.new("Other"))
    bpy.context.scene.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    armature.data.edit_bones.new("bone").tail = (0.0, 0.0, 1.0)
    bpy.ops.object.mode_set(mode="OBJECT")
    hold = armature.pose.bones["bone"].constraints.new("COPY_ROTATION")
    hold.target, hold.subtarget = rig, "FACIAL_C_Jaw"
    return _gone(armature)


def armature_constraint(rig):
    item = _empty()
    target = item.constraints.new("ARMATURE").targets.new()
    target.target, target.subtarget = rig, "FACIAL_C_Jaw"
    return _gone(item)


def driver(rig):
    item = _empty()
    curve = item.driver_add("location", 0)
    variable = curve.driver.variables.new()
    variable.type = "TRANSFORMS"
    variable.targets[0].id, variable.targets[0].bone_target = rig, "FACIAL_C_Jaw"
    curve.driver.expression = variable.name
    return _gone(item)


def driver_of_a_material(rig):
    """Add a driver that reads the jaw bone to a node of the face's material."""
    material = scene.meshes(rig)[0].material_slots[0].material
    node = material.node_tree.nodes.new("ShaderNodeValue")
    curve = node.outputs[0].driver_add("default_value")
    variable = curve.driver.variables.new()
    variable.type = "TRANSFORMS"
    variable.targets[0].id, variable.targets[0].bone_target = rig, "FACIAL_C_Jaw"

    def back():
        node.outputs[0].driver_remove("default_value")
        material.node_tree.nodes.remove(node)

    return back


def clothes(rig):
    """Add an object with an armature modifier by which the face's armature deforms it."""
    shirt = bpy.data.objects.new("Shirt", bpy.data.meshes.new("Shirt"))
    bpy.context.scene.collection.objects.link(shirt)
    shirt.data.from_pydata([(0, 0, 1.5), (0.1, 0, 1.5), (0, 0.1, 1.4)], [], [(0, 1, 2)])
    shirt.vertex_groups.new(name="FACIAL_C_Jaw").add(range(3), 1.0, "REPLACE")
    shirt.modifiers.new("Armature", "ARMATURE").object = rig
    return _gone(shirt)


def nodes_with_the_rig(rig):
    """Add an object with geometry nodes that get the face's armature as an input."""
    tree = bpy.data.node_groups.new("Reads", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Rig", in_out="INPUT", socket_type="NodeSocketObject")
    inside, outside = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    tree.links.new(inside.outputs[0], outside.inputs[0])
    mesh = bpy.data.objects.new("Hat", bpy.data.meshes.new("Hat"))
    bpy.context.scene.collection.objects.link(mesh)
    modifier = mesh.modifiers.new("Nodes", "NODES")
    modifier.node_group = tree
    name = tree.interface.items_tree[-1].identifier
    modifier[next(n for n in modifier.keys() if n == name)] = rig  # noqa: SIM118
    mesh.update_tag()
    return _gone(mesh)


def node_of_the_rig(rig):
    """Add an object with geometry nodes in which a node Object Info reads the face's armature."""
    tree = bpy.data.node_groups.new("Names", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    tree.nodes.new("NodeGroupOutput")
    tree.nodes.new("GeometryNodeObjectInfo").inputs[0].default_value = rig
    mesh = bpy.data.objects.new("Hat", bpy.data.meshes.new("Hat"))
    bpy.context.scene.collection.objects.link(mesh)
    mesh.modifiers.new("Nodes", "NODES").node_group = tree

    def back():
        bpy.data.objects.remove(mesh)
        bpy.data.node_groups.remove(tree)

    return back


def hook(rig):
    """Add a Hook modifier, which follows a bone, to a mesh of the face."""
    head = scene.meshes(rig)[0]
    modifier = head.modifiers.new("Hook", "HOOK")
    modifier.object, modifier.subtarget = rig, "FACIAL_C_Jaw"
    return lambda: head.modifiers.remove(modifier)


NEEDED = [
    selected, child_of_a_bone, constraint, bone_constraint_elsewhere, armature_constraint, driver,
    driver_of_a_material, clothes, nodes_with_the_rig, node_of_the_rig, hook,
]  # fmt: skip


def test_bones_are_posed_while_they_are_needed(pair):
    for change in NEEDED:
        back = change(pair.direct)
        both_ways.settle()
        plan = both_ways.plan(pair.direct)
        assert plan.posed, change.__name__
        assert plan.why, change.__name__
        assert both_ways.is_direct(pair.direct), change.__name__
        assert pair.bones_apart() < BONES_NEAR, change.__name__
        pair.set(jawOpen=0.2, eyeLookUpL=0.7)
        assert pair.bones_apart() < BONES_NEAR, change.__name__
        assert pair.apart() < both_ways.NEAR, change.__name__
        pair.set(jawOpen=0.6)
        back()
        both_ways.settle()
        assert not both_ways.plan(pair.direct).posed, change.__name__
        pair.set(jawOpen=0.5)
        assert pair.bones_apart() > 1e-3, change.__name__
        assert pair.apart() < both_ways.NEAR, change.__name__


def test_pose_mode(pair):
    """In pose mode the face is in Live mode, because the user poses the bones."""
    for rig in pair.each():
        rig.hide_viewport = False
        rig.hide_set(False)
        bpy.context.view_layer.objects.active = rig
        bpy.ops.object.mode_set(mode="POSE")
        both_ways.settle()
        if rig == pair.direct:
            assert not both_ways.plan(rig).direct
        rig.pose.bones["user_joint"].location = (0.01, 0.0, 0.02)
        both_ways.settle()
    assert pair.bones_apart() < BONES_NEAR
    assert pair.apart() < both_ways.NEAR
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.objects.active = pair.direct
    if pair.direct.mode == "POSE":
        bpy.ops.object.mode_set(mode="OBJECT")
    bpy.ops.object.select_all(action="DESELECT")
    both_ways.settle()
    assert both_ways.is_direct(pair.direct)
    pair.check()  # the joint that the user posed keeps its pose


def test_shown_joints(pair):
    rig = pair.direct
    for shelf in rig.data.collections_all:
        shelf.is_visible = True
    both_ways.settle()
    assert both_ways.plan(rig).posed
    assert both_ways.is_direct(rig)
    assert pair.bones_apart() < BONES_NEAR
    bpy.context.view_layer.objects.active = scene.controls(rig)
    assert bpy.ops.risorius.hide_joints() == {"FINISHED"}
    both_ways.settle()
    assert not both_ways.plan(rig).posed


SCRIPTED = [child_of_a_bone, constraint, driver, clothes]


def test_a_script_that_steps_to_the_next_frame_without_an_update(pair):
    """Edits by a script are noticed at the next frame, although no update comes before it.

    Without an interface, Blender tells add-ons of an edit only at the next frame change.
    """
    for rig in pair.each():
        bone = scene.face(rig)
        name = next(k for k in bone.keys() if k.endswith("jawOpen"))  # noqa: SIM118
        for frame, value in ((1, 0.0), (100, 1.0)):
            bone[name] = value
            bone.keyframe_insert(f'["{name}"]', frame=frame)
    frame = 10
    for change in SCRIPTED:
        back = change(pair.direct)
        frame += 10
        bpy.context.scene.frame_set(frame)
        assert pair.bones_apart() < BONES_NEAR, change.__name__
        assert pair.apart() < both_ways.NEAR, change.__name__
        back()
        bpy.context.scene.frame_set(frame + 5)
        bpy.context.scene.frame_set(frame + 6)
        assert not both_ways.plan(pair.direct).posed, change.__name__


def test_a_mesh_that_a_script_edits_before_the_next_frame(pair):
    for rig in pair.each():
        bone = scene.face(rig)
        name = next(k for k in bone.keys() if k.endswith("jawOpen"))  # noqa: SIM118
        for frame, value in ((1, 0.0), (100, 1.0)):
            bone[name] = value
            bone.keyframe_insert(f'["{name}"]', frame=frame)
    bpy.context.scene.frame_set(1)

    def step(frame, change):
        for rig in pair.each():
            change(scene.meshes(rig)[0])
        bpy.context.scene.frame_set(frame)
        assert pair.apart() < both_ways.NEAR, frame

    def first(head):
        head.modifiers.new("Smooth", "SMOOTH")
        head.modifiers.move(len(head.modifiers) - 1, 0)

    step(20, first)
    step(30, lambda head: head.modifiers.remove(head.modifiers["Smooth"]))
    step(40, lambda head: setattr(head.modifiers[0], "use_deform_preserve_volume", True))
    step(50, lambda head: setattr(head.modifiers[0], "use_deform_preserve_volume", False))
    step(60, lambda head: head.vertex_groups[0].add(range(60), 0.9, "REPLACE"))
    step(70, lambda head: None)
    bpy.context.view_layer.update()
    assert both_ways.is_direct(pair.direct)
    assert pair.apart() < both_ways.NEAR
