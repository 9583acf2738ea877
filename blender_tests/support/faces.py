# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes small Dna objects for tests: three meshes, two LODs, joints, channels, maps, odd names."""

import numpy as np
import risorius

CONTROLS = (
    "CTRL_expressions.jawOpen",
    "CTRL_expressions.mouthCornerPullL",
    "CTRL_expressions.mouthCornerPullR",
    "CTRL_expressions.browDownL",
    "CTRL_expressions.eyeLookLeftL",
    "CTRL_expressions.eyeLookRightL",
    "CTRL_expressions.eyeLookUpL",
    "CTRL_expressions.eyeLookDownL",
    "CTRL_expressions." + "x" * 90,
    "twice",
    "twice",
)
JOINTS = ("spine_04", "neck_01", "head", "FACIAL_C_Jaw", "FACIAL_L_Eye", "user_joint", "user_joint")
PARENTS = (0, 0, 1, 2, 2, 2, 5)
CHANNELS = 6
HEAD, JAW, EYE = 2, 3, 4
UNOWNED = 5  # a joint that no joint group moves


def _grid(columns, rows, radius, center):
    """Positions, normals, UVs and quads of a patch of a sphere whose outside faces +z.

    In the axes of `small_face`, +z is the front of the face.

    Args:
        columns, rows: numbers of vertices along x and along y.
        radius: radius of the sphere in the DNA's unit.
        center: float[3], centre of the sphere.
    """
    u, v = np.meshgrid(np.linspace(-1.2, 1.2, columns), np.linspace(-1.2, 1.2, rows))
    u, v = u.ravel(), v.ravel()
    unit = np.stack([np.sin(u) * np.cos(v), np.sin(v), np.cos(u) * np.cos(v)], axis=1)
    i = np.arange(columns - 1)[None] + np.arange(rows - 1)[:, None] * columns
    faces = np.stack([i, i + 1, i + 1 + columns, i + columns], axis=-1).reshape(-1, 4)
    uvs = np.stack([u, v], axis=1) / 2.4 + 0.5
    return unit * radius + center, unit, uvs, faces


def _mesh(random, size, radius, center, joints, channels):
    positions, normals, uvs, faces = _grid(*size, radius, center)
    count = len(positions)
    weights = random.random((count, len(joints))).astype(np.float32)
    weights /= weights.sum(axis=1, keepdims=True)
    targets = []
    for channel in channels:
        moved = np.sort(random.choice(count, count // 3, replace=False))
        targets.append(
            risorius.BlendShapeTarget(
                deltas=random.normal(0, radius * 0.05, (len(moved), 3)).astype(np.float32),
                vertex_indices=moved.astype(np.uint32),
                blend_shape_channel_index=channel,
            )
        )
    layout = np.arange(count, dtype=np.uint32)
    return risorius.Mesh(
        positions=positions.astype(np.float32),
        normals=normals.astype(np.float32),
        texture_coordinates=uvs.astype(np.float32),
        layout_positions=layout,
        layout_normals=layout,
        layout_texture_coordinates=layout,
        face_offsets=np.arange(0, faces.size + 1, 4, dtype=np.uint32),
        face_layouts=faces.ravel().astype(np.uint32),
        maximum_influence_per_vertex=len(joints),
        skin_offsets=np.arange(0, count * len(joints) + 1, len(joints), dtype=np.uint32),
        skin_weights=weights.ravel(),
        skin_joint_indices=np.tile(np.array(joints, np.uint16), count),
        blend_shape_targets=targets,
    )


def small_face(
    name="Small",
    axes=("right", "up", "front"),
    rotation_sequence="xyz",
    rotation_signs=(1, 1, 1),
    rotation_unit="degrees",
    translation_unit="cm",
    head_grid=(12, 14),
):
    """A Dna with all data that the add-on imports, except RBF poses.

    Equal arguments give an equal Dna.

    Args:
        name: name of the face.
        axes, rotation_sequence, rotation_signs, rotation_unit, translation_unit: the Dna's axes,
            conventions of its Euler angles, and units.
        head_grid: columns and rows of vertices of the head mesh.
    """
    random = np.random.default_rng(7)
    dna = risorius.Dna()
    dna.name, dna.lod_count, dna.max_lod = name, 2, 0
    dna.coordinate_system = axes
    dna.rotation_sequence, dna.rotation_signs = rotation_sequence, rotation_signs
    dna.rotation_unit, dna.translation_unit = rotation_unit, translation_unit
    dna.raw_control_names = list(CONTROLS)
    dna.gui_control_names = ["CTRL_C_jaw.ty"]
    dna.gui_to_raw = risorius.Conditionals(
        input_indices=[0],
        output_indices=[0],
        from_values=[0.0],
        to_values=[1.0],
        slope_values=[1.0],
        cut_values=[0.0],
    )
    dna.joint_names, dna.joint_parents = list(JOINTS), np.array(PARENTS, np.uint16)
    dna.neutral_joint_translations = np.array(
        [[0, 140, 0], [0, 8, 1], [0, 8, 1], [0, -2, 6], [3, 4, 9], [4, 1, 2], [1, 1, 1]], np.float32
    )
    angle = 1.0 if rotation_unit == "degrees" else np.pi / 180
    dna.neutral_joint_rotations = (random.uniform(-40, 40, (7, 3)) * angle).astype(np.float32)
    dna.blend_shape_channel_names = ["jaw", "pull_l", "pull_r", "y" * 80, "same", "same"]
    dna.animated_map_names = ["flush", "wrinkle"]
    dna.mesh_names = ["head_lod0_mesh", "teeth_lod0_mesh", "head_lod1_mesh"]
    dna.lod_mesh_mapping = [[0, 1], [2]]
    dna.lod_joint_mapping = [list(range(7)), list(range(7))]
    dna.lod_blend_shape_mapping = [list(range(CHANNELS))] * 2
    dna.lod_animated_map_mapping = [[0, 1]] * 2
    _behave(dna, random, angle)
    center = np.array([0.0, 158.0, 2.0])
    dna.meshes = [
        _mesh(random, head_grid, 10.0, center, (1, 2, 3, 4, 5), range(CHANNELS)),
        _mesh(random, (5, 5), 3.0, center + np.array([0.0, -3.0, 5.0]), (3,), (0,)),
        _mesh(random, (6, 7), 10.0, center, (2, 3), range(CHANNELS)),
    ]
    dna.mesh_blend_shape_channel_mapping = [
        (m, t.blend_shape_channel_index)
        for m, mesh in enumerate(dna.meshes)
        for t in mesh.blend_shape_targets
    ]
    return dna


def _behave(dna, random, angle):
    """Add the behaviour of a small face: joint groups, one corrective, channels and animated maps.

    Args:
        dna: the face.
        random: random generator of the jaw's values.
        angle: 1 degree in the unit of the Dna's rotations.
    """
    count = len(CONTROLS)
    jaw = random.uniform(-1, 1, (9, 3)).astype(np.float32)
    jaw[3:6] *= 25 * angle
    jaw[6:] *= 0.2
    eye = np.zeros((3, 4), np.float32)
    eye[1, 0], eye[1, 1] = 30 * angle, -28 * angle
    eye[0, 2], eye[0, 3] = -20 * angle, 22 * angle
    dna.joint_row_count, dna.joint_column_count = 9 * len(JOINTS), count + 1
    dna.joint_groups = [
        risorius.JointGroup(
            lods=[9, 6],
            input_indices=[0, 1, count],
            output_indices=[JAW * 9 + i for i in range(9)],
            values=jaw,
            joint_indices=[JAW],
        ),
        risorius.JointGroup(
            lods=[3, 3],
            input_indices=[4, 5, 6, 7],
            output_indices=[EYE * 9 + 3, EYE * 9 + 4, EYE * 9 + 5],
            values=eye,
            joint_indices=[EYE],
        ),
    ]
    dna.psd_count = 1
    dna.psds = risorius.Psds(rows=[count, count], columns=[0, 1], values=[1.0, 1.0])
    dna.blend_shape_channels = risorius.BlendShapeChannels(
        lods=[CHANNELS, 3], input_indices=[0, 1, 2, count, 8, 9], output_indices=range(CHANNELS)
    )
    dna.animated_maps = risorius.AnimatedMaps(
        lods=[2, 2],
        conditionals=risorius.Conditionals(
            input_indices=[0, 3],
            output_indices=[0, 1],
            from_values=[0.0, 0.0],
            to_values=[1.0, 1.0],
            slope_values=[1.0, 0.5],
            cut_values=[0.0, 0.0],
        ),
    )


def renumbered(dna, joints=None, controls=None, channels=None, maps=None):
    """Reorder, add or remove joints, controls, channels and maps of a face in place.

    Args:
        dna: a small_face.
        joints, controls, channels, maps: the new items in their order: an index stands for an old
            item, a name for a new item. Old items that are missing are removed with their data.
            None: no change.

    Returns:
        The same Dna.
    """
    if channels is not None:
        _renumber_channels(dna, channels)
    if maps is not None:
        dna.animated_map_names, where = _order(dna.animated_map_names, maps)
        conditionals = dna.animated_maps.conditionals
        _keep_rows(conditionals, "output_indices", where)
        dna.animated_maps.lods = [len(conditionals.output_indices)] * 2
        dna.lod_animated_map_mapping = [list(range(len(maps)))] * 2
    if controls is not None:
        _renumber_controls(dna, controls)
    if joints is not None:
        _renumber_joints(dna, joints)
    return dna


def _order(names, order):
    """Apply an order of `renumbered` to names.

    Returns the new names, and for each old name its new index (-1: removed), int64[names].
    """
    where = np.full(len(names), -1)
    for new, old in enumerate(order):
        if not isinstance(old, str):
            where[old] = new
    return [old if isinstance(old, str) else names[old] for old in order], where


def _keep_rows(conditionals, field, where):
    moved = where[getattr(conditionals, field)]
    kept = moved >= 0
    fields = ("input_indices", "output_indices", "from_values", "to_values")
    columns = {f: getattr(conditionals, f)[kept] for f in (*fields, "slope_values", "cut_values")}
    for name, values in columns.items():
        setattr(conditionals, name, moved[kept] if name == field else values)


def _renumber_channels(dna, order):
    dna.blend_shape_channel_names, where = _order(dna.blend_shape_channel_names, order)
    for mesh in dna.meshes:
        targets = []
        for target in mesh.blend_shape_targets:
            there = int(where[target.blend_shape_channel_index])
            if there >= 0:
                target.blend_shape_channel_index = there
                targets.append(target)
        mesh.blend_shape_targets = targets
    rows = dna.blend_shape_channels
    moved = where[rows.output_indices]
    kept, coarse = moved >= 0, moved[: rows.lods[1]] >= 0
    rows.input_indices, rows.output_indices = rows.input_indices[kept], moved[kept]
    rows.lods = [int(kept.sum()), int(coarse.sum())]
    dna.lod_blend_shape_mapping = [list(range(len(order)))] * 2
    dna.mesh_blend_shape_channel_mapping = [
        (m, t.blend_shape_channel_index)
        for m, mesh in enumerate(dna.meshes)
        for t in mesh.blend_shape_targets
    ]


def _renumber_controls(dna, order):
    """Reorder raw controls by `order`, as `renumbered` describes it.

    Controls that joints, correctives or GUI controls use must not be removed.
    """
    count = len(dna.raw_control_names)
    dna.raw_control_names, where = _order(dna.raw_control_names, order)
    where = np.append(where, len(order))  # the corrective has the index after the controls
    _keep_rows(dna.animated_maps.conditionals, "input_indices", where)
    dna.animated_maps.lods = [len(dna.animated_maps.conditionals.input_indices)] * 2
    dna.gui_to_raw.output_indices = where[dna.gui_to_raw.output_indices]
    for group in dna.joint_groups:
        group.input_indices = where[group.input_indices]
    rows = dna.blend_shape_channels
    moved = where[rows.input_indices]
    kept, coarse = moved >= 0, moved[: rows.lods[1]] >= 0
    rows.input_indices, rows.output_indices = moved[kept], rows.output_indices[kept]
    rows.lods = [int(kept.sum()), int(coarse.sum())]
    dna.psds.rows, dna.psds.columns = where[dna.psds.rows], where[dna.psds.columns]
    dna.joint_column_count += len(order) - count


def _renumber_joints(dna, order):
    """Reorder joints by `order`, as `renumbered` describes it.

    New joints become children of the joint that was first before. Joints with joint groups or skin
    weights must not be removed.
    """
    offsets, angles = dna.neutral_joint_translations, dna.neutral_joint_rotations
    parents = dna.joint_parents
    dna.joint_names, where = _order(dna.joint_names, order)
    rows = [0 if isinstance(o, str) else o for o in order]
    new = np.array([isinstance(o, str) for o in order])
    first = int(where[0])
    dna.joint_parents = np.where(new, first, where[parents[rows]]).astype(np.uint16)
    dna.neutral_joint_translations = np.where(new[:, None], [[1.0, 5.0, 3.0]], offsets[rows])
    dna.neutral_joint_rotations = np.where(new[:, None], 0.0, angles[rows])
    for mesh in dna.meshes:
        mesh.skin_joint_indices = where[mesh.skin_joint_indices]
    for group in dna.joint_groups:
        outputs = group.output_indices
        group.output_indices = where[outputs // 9] * 9 + outputs % 9
        group.joint_indices = where[group.joint_indices]
    dna.lod_joint_mapping = [list(range(len(order)))] * 2
    dna.joint_row_count = 9 * len(order)


def other_face(**options):
    """The small face as in a later version of its file: with other, removed and new items.

    Most joints, controls, channels and maps have other indices than in the small face.
    """
    dna = renumbered(
        small_face(**options),
        joints=[0, "new_joint", 1, 2, 5, 4, 3],
        controls=[9, 1, "CTRL_expressions.tongueUp", 0, 2, 7, 6, 5, 4, 8],
        channels=[5, "new_shape", 1, 0, 2],
        maps=[1, "new_map", 0],
    )
    offsets = dna.neutral_joint_translations.copy()
    offsets[2] += [0.5, 1.0, 0.0]  # an offset of the neck joint
    dna.neutral_joint_translations = offsets
    return dna


TURNING = tuple(f"{joint}.q{part}" for joint in ("neck_01", "head") for part in "xyzw")
UP, SIDE = 1, 2  # indices in NECK_POSES of two poses of neck_face
# For each pose, the rotations of neck_01 and head from rest about the joints' axes: two quaternions
# x, y, z, w one after the other.
NECK_POSES = (
    (0, 0, 0, 1, 0, 0, 0, 1),
    (0, 0, 0.0871557, 0.9961947, 0, 0, 0.2164396, 0.9762960),
    (0.1305262, 0, 0, 0.9914449, 0.2588190, 0, 0, 0.9659258),
)


def neck_face(**options):
    """The small face with an RBF solver that deforms it when neck and head rotate.

    The raw controls TURNING are the quaternions of neck and head. The poses of the solver are
    NECK_POSES: pose UP drives channel 4, and pose SIDE drives channel 5. Pose UP together with the
    open jaw activates a corrective that drives channel 2.
    """
    dna = small_face(**options)
    count = len(CONTROLS)
    renumbered(dna, controls=[*range(count), *TURNING])
    raw = count + len(TURNING)
    pose = raw + 2
    dna.psd_count = 2
    dna.psds = risorius.Psds(
        rows=[raw, raw, raw + 1, raw + 1], columns=[0, 1, pose + UP, 0], values=[1.0] * 4
    )
    channels = dna.blend_shape_channels
    channels.input_indices = [0, 1, raw + 1, raw, pose + UP, pose + SIDE]
    dna.joint_column_count = pose + len(NECK_POSES)
    dna.rbf_behavior.lod_solver_mapping = [[0], [0]]
    dna.rbf_behavior.solvers = [
        risorius.RbfSolver(
            name="neck", raw_control_indices=range(count, raw),
            pose_indices=range(len(NECK_POSES)), raw_control_values=np.ravel(NECK_POSES),
            radius=1.0, automatic_radius=0, solver_type=1, distance_method=1,
            normalize_method=0, function_type=0, twist_axis=0, weight_threshold=0.001,
        )
    ]  # fmt: skip
    dna.rbf_behavior.poses = [risorius.RbfPose(name=n, scale=1) for n in ("rest", "up", "side")]
    dna.rbf_behavior_ext.pose_control_names = ["neck_rest", "neck_up", "neck_side"]
    dna.rbf_behavior_ext.poses = [
        risorius.RbfPoseControls(output_control_indices=[pose + i], output_control_weights=[1.0])
        for i in range(len(NECK_POSES))
    ]
    return dna
