# SPDX-License-Identifier: GPL-3.0-or-later
"""Controls -> pose -> scene. Every frame is a function of the controls at that frame alone.

Values are read from the evaluated objects of the depsgraph that is passed in (the originals
are stale while an animation renders) and written to the originals, in bulk.
"""

import numpy as np

from .. import native
from ..logic import plans
from ..logic import space as spaces
from . import armatures, meshes, parts, runtime, testing

_AHEAD = np.array([0.0, -1.0, 0.0])


def evaluate_all(depsgraph, force=False):
    """Bring every character of this file up to its controls.

    Args:
        depsgraph: the evaluated dependency graph to read from.
        force: write also what seems unchanged.
    """
    if native.problem():
        return
    for rig in parts.rigs():
        evaluate(rig, depsgraph, force)


def evaluate(rig, depsgraph, force=False):
    """Bring one character up to its controls.

    Args:
        rig: its deforming armature, the original.
        depsgraph: the evaluated dependency graph to read from.
        force: write also what seems unchanged.

    Returns:
        Whether there was anything to write.
    """
    controls = parts.controls_of(rig)
    live = runtime.of(rig) if controls is not None else None
    if live is None:
        return False
    seen = controls.evaluated_get(depsgraph)
    raw, turns = read_inputs(seen, live, _maximum(controls))
    lod = min(max(int(rig.get(parts.LOD, 0)), 0), max(live.rig.lod_count - 1, 0))
    test = testing.override(rig, raw, depsgraph.scene)
    state = (raw.tobytes(), lod, test, *(t.tobytes() for t in turns.values()))
    if not _changed(rig, "inputs", state) and not force:
        return False
    pose = live.rig.evaluate(raw, lod)
    testing.apply(test, pose.blend_shapes)
    _write_bones(rig, live, pose.joints, turns, depsgraph)
    _write_values(rig, pose)
    for item in parts.meshes_of(rig):
        if lod in list(item.get(parts.LODS, [lod])):
            _write_shape(item, live, pose.blend_shapes, force)
    rig.update_tag(refresh={"OBJECT"})
    return True


def _changed(item, what, state):
    key = (what, item.session_uid)
    if runtime.outputs.get(key) == state:
        return False
    runtime.outputs[key] = state
    return True


def _maximum(controls):
    return 1.5 if controls.get(parts.OVERDRIVE) else 1.0


def read_inputs(seen, live, maximum=1.0):
    """Read the sliders and bones of an evaluated control armature.

    Args:
        seen: the evaluated control armature object.
        live: the character's Runtime.
        maximum: what the look controls are clamped to after the eye bones are added.

    Returns:
        float32[R] raw controls, and joint turns: "neck" and "head" -> float64[4] quaternion
        (w x y z) in the armature's axes.
    """
    bones = seen.pose.bones
    face = bones[parts.FACE]
    rests = live.rests
    raw = np.array([face.get(label, rests[i]) for i, label in enumerate(live.labels)], np.float32)
    np.nan_to_num(raw, copy=False, nan=0.0, posinf=0.0, neginf=0.0)
    turns = {}
    for name in ("neck", "head"):
        bone = bones.get(name)
        turns[name] = _turn(seen, bone) if bone else np.array([1.0, 0.0, 0.0, 0.0])
    _add_look(seen, live, raw, maximum)
    return raw, turns


def _local(seen, bone):
    """A bone's own transform after its constraints, relative to its rest."""
    return seen.convert_space(
        pose_bone=bone, matrix=bone.matrix, from_space="POSE", to_space="LOCAL"
    )


def _turn(seen, bone):
    """A bone's own rotation in the armature's axes, quaternion (w x y z)."""
    rest = bone.bone.matrix_local.to_quaternion()
    turned = rest @ _local(seen, bone).to_quaternion() @ rest.inverted()
    return np.array(turned[:])


def _add_look(seen, live, raw, maximum):
    """Add what the eye bones and their target ask for to the look controls."""
    bones = seen.pose.bones
    target = bones.get("eyes")
    moved = np.zeros(3)
    if target is not None:
        rest = target.bone.matrix_local.to_3x3()
        moved = np.array((rest @ _local(seen, target).translation)[:])
    for side, controls in live.look.items():
        bone = bones.get(f"eye_{side}")
        yaw = pitch = 0.0
        if target is not None and bone is not None and np.any(np.abs(moved) > 1e-9):
            start = np.array((target.bone.head_local - bone.bone.head_local)[:])
            before, after = spaces.yaw_pitch(start), spaces.yaw_pitch(start + moved)
            yaw, pitch = after[0] - before[0], after[1] - before[1]
        if bone is not None:
            own = spaces.yaw_pitch(spaces.quaternion_matrix(_turn(seen, bone)) @ _AHEAD)
            yaw, pitch = yaw + own[0], pitch + own[1]
        for index, yaw_at_one, pitch_at_one in controls:
            asked = yaw / yaw_at_one if yaw_at_one else pitch / pitch_at_one
            if asked > 1e-6:
                raw[index] = min(raw[index] + asked, max(maximum, raw[index]))


def _write_bones(rig, live, deltas, turns, depsgraph):
    """Write the joints that the evaluator owns; all others keep what the user gave them."""
    location, rotation, scale = live.joints.bone_channels(deltas)
    _add_turns(live, rotation, turns)
    bones = rig.pose.bones
    where, rows, mine = _bone_rows(rig, live)
    seen = rig.evaluated_get(depsgraph).pose.bones
    channels = [
        ("location", 3, location),
        ("rotation_quaternion", 4, rotation),
        ("scale", 3, scale),
    ]
    if not mine.all():
        # A bulk write that leaves out their animated values would undo them.
        channels += [("rotation_euler", 3, None)]
    source = seen if len(seen) == len(bones) else bones
    for name, width, values in channels:
        flat = np.empty(len(bones) * width, np.float32)
        source.foreach_get(name, flat)
        if values is not None:
            flat.reshape(-1, width)[where] = values[rows]
        bones.foreach_set(name, flat)


def _bone_rows(rig, live):
    """Which pose bones are owned: their positions, the row of each, a mask of all bones."""
    key = ("bones", rig.session_uid)
    kept = runtime.outputs.get(key)
    count = len(rig.pose.bones)
    if kept is None or len(kept[2]) != count:
        row_of = {int(joint): row for row, joint in enumerate(live.joints.joints)}
        pairs = [
            (i, row_of[joint])
            for i, joint in enumerate(b.bone.get(parts.JOINT, -1) for b in rig.pose.bones)
            if joint in row_of
        ]
        where = np.array([p[0] for p in pairs], np.int64)
        mine = np.zeros(count, bool)
        mine[where] = True
        kept = runtime.outputs[key] = (where, np.array([p[1] for p in pairs], np.int64), mine)
    return kept


def _add_turns(live, rotation, turns):
    """Add the head and neck bones' rotations on top of the evaluator's result, in place."""
    anchors = live.anchors
    shares = [(joint, turns["neck"], 1.0 / len(anchors.neck)) for joint in anchors.neck]
    if anchors.head is not None:
        shares.append((anchors.head, turns["head"], 1.0))
    for joint, turn, share in shares:
        row = int(np.searchsorted(live.joints.joints, joint))
        part = spaces.quaternion_fraction(turn, share)
        rest = live.rest[joint][:3, :3]
        inner = spaces.quaternions((rest.T @ spaces.quaternion_matrix(part) @ rest)[None])[0]
        rotation[row] = spaces.quaternion_product(inner, rotation[row])


def _write_values(rig, pose):
    """Write channels and maps to the array properties that drivers read."""
    for name, values in ((parts.MAPS, pose.animated_maps), (parts.CHANNELS, pose.blend_shapes)):
        if len(values) and len(rig.get(name, ())) == len(values):
            rig[name][:] = values.tolist()


def _write_shape(item, live, weights, force):
    """Write the sum of all channels to the live key of a mesh, where it has one."""
    key = item.data.shape_keys
    block = meshes.live_block(item)
    if block is None or item.mode == "EDIT":
        return
    morph = live.morph(item[parts.MESH])
    if morph.vertex_count != len(block.points):
        return  # the user changed the topology
    if parts.REAL in key:
        weights = weights.copy()
        weights[list(key[parts.REAL])] = 0.0
    if not _changed(key, "weights", weights[morph.channel_indices].tobytes()) and not force:
        return
    basis = meshes.points_of(key.reference_key)
    points = morph.evaluate(weights, base=basis)
    block.points.foreach_set("co", points.ravel())
    key.update_tag()
    item.data.update_tag()


def mend_types(rig):
    """Turn controls that a script made integers back to float properties."""
    face = parts.face_bone(rig)
    live = runtime.of(rig)
    if face is None or live is None:
        return
    wrong = [i for i, label in enumerate(live.labels) if isinstance(face.get(label), int)]
    if not wrong:
        return
    controls = plans.plan_controls(live.dna.raw_control_names, live.rests)
    maximum = _maximum(parts.controls_of(rig))
    for i in wrong:
        label = live.labels[i]
        value = float(face[label])
        del face[label]
        face[label] = value
        armatures.describe_property(face, controls[i], maximum)
