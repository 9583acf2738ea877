# SPDX-License-Identifier: MIT
"""Makes a complete face by formula: 62 joints, 9 correctives, a neck solver, a map and 3 LODs."""

import face_shapes
import numpy as np
import risorius

NAMED = [
    "root", "spine_04", "neck_01", "neck_02", "head", "FACIAL_C_FacialRoot", "FACIAL_L_Eye",
    "FACIAL_R_Eye", "FACIAL_C_Jaw",
]  # fmt: skip
_PLACES = [
    (0, -60, 0), (0, -40, 0), (0, -22, 0), (0, -17, 0), (0, -10, 0), (0, -8, 0), (3, 3, 6),
    (-3, 3, 6), (0, -2, -2),
]  # fmt: skip
_PARENTS = [0, 0, 1, 2, 3, 4, 5, 5, 5]
SKIN = 53
TURNS = [f"{joint}.q{part}" for joint in ("neck_01", "head") for part in "xyzw"]


def build() -> risorius.Dna:
    """Build the face.

    Joints of both sides move symmetrically, except for noise with a standard deviation of 0.004 cm.
    """
    positions, _ = face_shapes.head()
    moved = face_shapes.expressions(positions)
    names = list(moved)
    raw, count = len(names) + len(TURNS), len(NAMED) + SKIN
    dna = risorius.Dna(
        name="jointed", translation_unit="cm", rotation_unit="degrees",
        coordinate_system=("right", "up", "front"), rotation_sequence="xyz",
        rotation_signs=(1, 1, 1),
        lod_count=3, gui_control_names=[f"CTRL_{n}.ty" for n in names],
        raw_control_names=[*(f"CTRL_expressions.{n}" for n in names), *TURNS],
    )  # fmt: skip
    skin = _skin_places(positions)
    dna.joint_names = [*NAMED, *(f"FACIAL_C_Skin{i}" for i in range(SKIN))]
    parents = [*_PARENTS, *[5] * SKIN]
    parents[-1] = len(parents) - 2  # the last joint has another skin joint as its parent
    places = np.array([*_PLACES, *skin], float)
    places[0] = _PLACES[0]
    dna.joint_parents = parents
    own = np.arange(count)
    dna.neutral_joint_translations = np.where(
        (np.array(parents) == own)[:, None], places, places - places[parents]
    )
    dna.neutral_joint_rotations = np.zeros((count, 3))
    dna.lod_joint_mapping = [list(range(count)), list(range(count - 10)), list(range(count - 24))]
    _meshes(dna, positions, places, moved)
    _behavior(dna, positions, skin, moved, raw)
    return risorius.load(dna.to_bytes())


def _skin_places(positions):
    """Places of skin joints: pairs on both sides, four on the middle line, one above these four."""
    grid = positions.reshape(face_shapes.DOWN, face_shapes.ACROSS, 3)
    right = grid[2::4, 1:11:2].reshape(-1, 3)[:24]
    middle = grid[2::5, face_shapes.ACROSS // 2][:4]
    pairs = np.stack([right, right * [-1, 1, 1]], axis=1).reshape(-1, 3)
    lone = middle[0] + np.array([0, 0.5, 0])
    return np.concatenate([pairs, middle, lone[None]])[:SKIN]


def _meshes(dna, positions, places, moved):
    meshes, names = [], []
    channel = {name: i for i, name in enumerate(moved)}
    for lod, step in enumerate((1, 2, 3)):
        grid = np.arange(len(positions)).reshape(face_shapes.DOWN, face_shapes.ACROSS)
        some = grid[::step, ::step]
        points = positions[some.ravel()]
        at = np.arange(some.size).reshape(some.shape)
        quads = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], axis=-1)
        quads = quads.reshape(-1, 4)
        last = len(dna.lod_joint_mapping[lod])
        apart = np.linalg.norm(points[:, None] - places[None, :last], axis=2)
        apart[:, :9] += [90, 30, 20, 14, 6, 8, 20, 20, 12]
        near = np.argsort(apart, axis=1, kind="stable")[:, :4]
        weights = 1 / (0.5 + np.take_along_axis(apart, near, axis=1)) ** 2
        weights /= weights.sum(axis=1, keepdims=True)
        crown = points[:, 1] > 11.5  # weighted to the head only
        near[crown, 0], weights[crown] = 4, [1, 0, 0, 0]
        targets = [] if lod == 2 else [
            risorius.BlendShapeTarget(
                deltas=0.1 * shape[some.ravel()][rows], vertex_indices=rows,
                blend_shape_channel_index=channel[name],
            )
            for name, shape in list(moved.items())[:4]
            for rows in [np.flatnonzero(shape[some.ravel()].any(axis=1))]
        ]  # fmt: skip
        flat = np.arange(len(points))
        meshes.append(
            risorius.Mesh(
                positions=points, normals=points / 10, texture_coordinates=points[:, :2] / 30,
                layout_positions=flat, layout_texture_coordinates=flat, layout_normals=flat,
                face_offsets=4 * np.arange(len(quads) + 1), face_layouts=quads.ravel(),
                maximum_influence_per_vertex=4, skin_offsets=4 * np.arange(len(points) + 1),
                skin_weights=weights.ravel(), skin_joint_indices=near.ravel(),
                blend_shape_targets=targets,
            )
        )  # fmt: skip
        names.append(f"head_lod{lod}_mesh")
    dna.meshes, dna.mesh_names = meshes, names
    dna.lod_mesh_mapping = [[0], [1], [2]]
    dna.blend_shape_channel_names = [*channel, "corrective_1"]
    dna.lod_blend_shape_mapping = [[0, 1, 2, 3, len(channel)], [0, 1, 2, 3], []]
    dna.mesh_blend_shape_channel_mapping = [(m, c) for m in (0, 1) for c in range(4)]
    dna.animated_map_names = ["wrinkle"]
    dna.lod_animated_map_mapping = [[0], [], []]


def _behavior(dna, positions, skin, moved, raw):
    names, first = list(moved), len(NAMED)
    dna.gui_to_raw = _ramp(range(len(names)), range(len(names)))
    # Nine correctives with two or three factors. The sixth and the seventh have all factors of an
    # earlier corrective and one more. The eighth reads a corrective, the ninth the pose of a
    # solver.
    on = [(0, 1), (2, 3), (4, 5), (0, 2), (1, 3), (0, 1, 6), (2, 3, 6), (raw + 1, 4), (raw + 9, 6)]
    dna.psd_count = len(on)
    dna.psds = risorius.Psds(
        rows=[raw + i for i, parts in enumerate(on) for _ in parts],
        columns=[part for parts in on for part in parts],
        values=np.ones(sum(map(len, on))),
    )
    _solver(dna, raw)
    rng = np.random.default_rng(1)
    nearest = [int(np.linalg.norm(positions - place, axis=1).argmin()) for place in skin]
    shifts = [moved[name][nearest] for name in names]
    # A corrective moves the joints by a fraction of a control's shift, 0.2 for the first one and
    # less for each further one. The last one moves them by the whole shift of the first control.
    shifts += [0.2 / (i + 1) * shifts[i % len(names)] for i in range(len(on) - 1)] + [shifts[0]]
    values = np.concatenate(shifts, axis=1).reshape(len(skin), len(shifts), 3).transpose(0, 2, 1)
    columns = [*range(len(names)), *range(raw, raw + len(on))]
    values = values + rng.normal(0, 0.004, values.shape) * (np.abs(values) > 0.02)
    turns = np.zeros((3, len(columns)))
    turns[0, names.index("jawOpen")] = 17.0
    joints = np.arange(first, first + len(skin))
    dna.joint_row_count, dna.joint_column_count = 9 * len(dna.joint_names), raw + len(on)
    dna.joint_groups = [
        risorius.JointGroup(
            lods=[3, 3, 3], input_indices=columns, output_indices=9 * 8 + 3 + np.arange(3),
            values=turns, joint_indices=[8],
        ),
        risorius.JointGroup(
            lods=[3 * len(skin), 3 * (len(skin) - 10), 3 * (len(skin) - 24)], input_indices=columns,
            output_indices=(9 * joints[:, None] + np.arange(3)).ravel(),
            values=values.reshape(-1, len(columns)), joint_indices=joints,
        ),
    ]  # fmt: skip
    dna.blend_shape_channels = risorius.BlendShapeChannels(
        lods=[5, 4, 0], input_indices=[0, 1, 2, 3, raw + 1], output_indices=[0, 1, 2, 3, len(names)]
    )
    dna.animated_maps = risorius.AnimatedMaps(lods=[1, 0, 0], conditionals=_ramp([raw + 6], [0]))


def _ramp(inputs, outputs):
    n = len(inputs)
    return risorius.Conditionals(
        input_indices=list(inputs), output_indices=list(outputs), from_values=[0.0] * n,
        to_values=[1.0] * n, slope_values=[1.0] * n, cut_values=[0.0] * n,
    )  # fmt: skip


def _solver(dna, raw):
    first = raw - len(TURNS)
    at_rest, up = [0, 0, 0, 1], [0, 0, 0.26, 0.9656]
    dna.rbf_behavior.lod_solver_mapping = [[0], [0], [0]]
    dna.rbf_behavior.solvers = [
        risorius.RbfSolver(
            name="neck", raw_control_indices=range(first, raw), pose_indices=[0, 1],
            raw_control_values=[*at_rest, *at_rest, *up, *up], radius=1.0, weight_threshold=0.001,
            solver_type=1, automatic_radius=1, distance_method=1, normalize_method=1,
            function_type=0, twist_axis=0,
        )
    ]  # fmt: skip
    dna.rbf_behavior.poses = [risorius.RbfPose(name=n, scale=1) for n in ("default", "turnUp")]
    dna.rbf_behavior_ext.pose_control_names = ["turnUp"]
    dna.rbf_behavior_ext.poses = [
        risorius.RbfPoseControls(input_control_indices=[], output_control_indices=[]),
        risorius.RbfPoseControls(
            input_control_indices=[], output_control_indices=[raw + 9], output_control_weights=[1.0]
        ),
    ]
