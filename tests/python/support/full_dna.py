# SPDX-License-Identifier: MIT
"""A small Dna without empty layers or lists, and functions that change one of its fields."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from typing import Any

import numpy as np
import risorius


def full() -> risorius.Dna:
    """A Dna with 2 LODs and controls: raw 0-4, correctives 5-6, networks 7-8, RBF poses 9-10."""
    dna = risorius.Dna(
        name="full", archetype="other", gender="female", age=30, metadata={"a": "1", "b": "2"},
        translation_unit="cm", rotation_unit="degrees", coordinate_system=("right", "up", "front"),
        rotation_sequence="zyx", rotation_signs=(1, -1, 1), face_winding_order="cw",
        lod_count=2, max_lod=1, complexity="low", db_name="db",
        gui_control_names=["g0", "g1"], raw_control_names=["q.x", "q.y", "q.z", "q.w", "jaw"],
        joint_names=["root", "jaw_joint", "lip"], joint_parents=[0, 0, 1],
        neutral_joint_translations=[[0, 1, 0], [1, 2, 3], [0, 0, 1]],
        neutral_joint_rotations=[[0, 0, 0], [10, 0, 0], [0, 5, 0]],
        blend_shape_channel_names=["open", "smile"], animated_map_names=["m0", "m1"],
        mesh_names=["head", "teeth"], mesh_blend_shape_channel_mapping=[[0, 0], [0, 1], [1, 0]],
        lod_joint_mapping=[[0, 1, 2], [0, 1]], lod_mesh_mapping=[[0, 1], [1]],
        lod_blend_shape_mapping=[[0, 1], [0]], lod_animated_map_mapping=[[0, 1], [1]],
        unknown_layers=[("abcd", "1.2", b"\x01\x02"), ("abcd", "1.3", b"\x03")],
    )  # fmt: skip
    _behavior(dna)
    dna.meshes = [_mesh(1.0, 2), _mesh(2.0, 1)]
    _networks(dna)
    _rotations(dna)
    return risorius.load(dna.to_bytes())  # loaded from bytes, so that it has an index


def _table(outputs: list[int], inputs: list[int]) -> risorius.Conditionals:
    n = len(outputs)
    return risorius.Conditionals(
        input_indices=inputs, output_indices=outputs, from_values=[0.0] * n, to_values=[1.0] * n,
        slope_values=[1.0, 0.5, 0.25][:n], cut_values=[0.0, 0.125, 0.5][:n],
    )  # fmt: skip


def _behavior(dna: risorius.Dna) -> None:
    dna.gui_to_raw = _table([4, 0, 1], [0, 1, 1])
    dna.psd_count = 2
    dna.psds = risorius.Psds(rows=[5, 5, 6, 6], columns=[0, 4, 1, 5], values=[1, 2, 1, 0.5])
    dna.joint_row_count, dna.joint_column_count = 27, 10
    dna.joint_groups = [
        risorius.JointGroup(
            lods=[3, 1], input_indices=[4, 5], output_indices=[9, 12, 15], joint_indices=[1, 2],
            values=[[1, 2], [3, 4], [5, 6]],
        ),
        risorius.JointGroup(
            lods=[2, 2], input_indices=[0, 9, 7], output_indices=[18, 19], joint_indices=[2],
            values=[[1, 2, 3], [4, 5, 6]],
        ),
    ]  # fmt: skip
    dna.blend_shape_channels = risorius.BlendShapeChannels(
        lods=[2, 1], input_indices=[4, 5], output_indices=[0, 1]
    )
    dna.animated_maps = risorius.AnimatedMaps(
        lods=[3, 1], conditionals=_table([0, 1, 1], [4, 5, 6])
    )


def _mesh(size: float, targets: int) -> risorius.Mesh:
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 1]]) * size
    return risorius.Mesh(
        positions=corners, normals=corners[::-1], texture_coordinates=corners[:3, :2] / 4,
        layout_positions=[0, 1, 2, 3, 1], layout_texture_coordinates=[0, 1, 2, 0, 1],
        layout_normals=[3, 2, 1, 0, 0], face_offsets=[0, 3, 7], face_layouts=[0, 1, 2, 0, 2, 3, 4],
        maximum_influence_per_vertex=2, skin_offsets=[0, 2, 3, 4, 6],
        skin_weights=[0.25, 0.75, 1, 1, 0.5, 0.5], skin_joint_indices=[0, 1, 0, 2, 1, 2],
        blend_shape_targets=[
            risorius.BlendShapeTarget(
                deltas=corners[1:] * (1 + i), vertex_indices=[0, 1, 3],
                blend_shape_channel_index=i,
            )
            for i in range(targets)
        ],
    )  # fmt: skip


def _network(output: int) -> risorius.NeuralNetwork:
    def layer(rows: int, columns: int) -> risorius.NeuralNetworkLayer:
        return risorius.NeuralNetworkLayer(
            biases=np.arange(rows), weights=np.arange(rows * columns), activation_function=2,
            activation_parameters=[0.1],
        )  # fmt: skip

    return risorius.NeuralNetwork(
        output_indices=[output], input_indices=[0, 4], layers=[layer(2, 2), layer(1, 2)]
    )


def _networks(dna: risorius.Dna) -> None:
    ml, ext = dna.machine_learned_behavior, dna.machine_learned_behavior_ext
    ml.ml_control_names = ["n0", "n1"]
    ml.lod_neural_network_mapping = [[0, 1], [1]]
    ml.neural_networks = [_network(7), _network(8)]
    ml.region_names = [["lips", "brow"], ["all"]]
    ml.region_network_indices = [[[0], [1]], [[0, 1]]]

    def operation(kind: int, parameters: list[int], before: list[int]) -> risorius.MlOperation:
        return risorius.MlOperation(
            operation_type=kind, parameters=parameters,
            operation_set_dependency_indices=[0] * len(before),
            operation_dependency_indices=before,
        )  # fmt: skip

    ext.types = [
        risorius.MlType(
            lod_operation_mappings=[[[0, 1], [0]], [[0, 1], [1]]],
            operations=[
                [operation(1, [0, 4], []), operation(1, [1, 4], [])],
                [operation(3, [0], [0]), operation(3, [1], [1])],
            ],
        )
    ]
    ext.joints = risorius.MlJoints(
        parameter_keys=[0, 1], parameter_values=[0, 0], input_indices=[7, 8], output_indices=[9, 10]
    )


def _rotations(dna: risorius.Dna) -> None:
    rbf, ext = dna.rbf_behavior, dna.rbf_behavior_ext
    rbf.lod_solver_mapping = [[0, 1], [1]]
    rbf.solvers = [
        risorius.RbfSolver(
            name=name, raw_control_indices=[0, 1, 2, 3], pose_indices=[0, 1],
            raw_control_values=np.arange(8) / 8, radius=0.5, weight_threshold=0.125,
            solver_type=1, automatic_radius=1, distance_method=1, normalize_method=1,
            function_type=1, twist_axis=1,
        )
        for name in ("s0", "s1")
    ]  # fmt: skip
    rbf.poses = [risorius.RbfPose(name="p0", scale=1), risorius.RbfPose(name="p1", scale=0.5)]
    ext.pose_control_names = ["c0", "c1"]
    ext.poses = [
        risorius.RbfPoseControls(
            input_control_indices=[4], output_control_indices=[9, 10][:n],
            output_control_weights=[1, 0.5][:n],
        )
        for n in (1, 2)
    ]  # fmt: skip
    dna.joint_behavior_metadata.joint_representations = [[0, 1, 0], [0, 0, 0], [0, 1, 0]]

    def setup(joints: list[int]) -> risorius.TwistSwingSetup:
        return risorius.TwistSwingSetup(
            blend_weights=[0.25, 0.5][: len(joints)], output_joint_indices=joints,
            input_control_indices=[0, 1, 2, 3], twist_axis=1,
        )  # fmt: skip

    dna.twist_swing_behavior.twists = [setup([0, 1]), setup([2])]
    dna.twist_swing_behavior.swings = [setup([1, 2])]


# ---- every change of one field

Step = str | int
CHOICES = (
    ("asian", "black", "caucasian", "hispanic", "alien", "other"),
    ("male", "female", "other"),
    ("cm", "m"),
    ("degrees", "radians"),
    ("xyz", "zyx", "yzx"),
    ("ccw", "cw"),
)


def is_struct(value: Any) -> bool:
    return type(value).__module__.startswith("risorius") and not is_mapping(value)


def is_mapping(value: Any) -> bool:
    return isinstance(value, risorius.LodMapping)


def settable(owner: Any) -> list[str]:
    return [n for n, v in vars(type(owner)).items() if isinstance(v, property) and v.fset]


def fields(owner: Any, path: tuple[Step, ...] = ()) -> Iterator[tuple[tuple[Step, ...], Any]]:
    """(path, value) of every property that can be set, including properties of nested objects."""
    for name in settable(owner):
        value = getattr(owner, name)
        yield (*path, name), value
        yield from _inside(value, (*path, name))


def _inside(value: Any, path: tuple[Step, ...]) -> Iterator[tuple[tuple[Step, ...], Any]]:
    if is_struct(value):
        yield from fields(value, path)
    elif isinstance(value, list | tuple):
        for i, item in enumerate(value):
            if is_struct(item) or isinstance(item, tuple):
                yield from _inside(item, (*path, i))


def name_of(path: tuple[Step, ...]) -> str:
    return ".".join(step for step in path if isinstance(step, str))


def changed(dna: risorius.Dna, path: tuple[Step, ...], value: Any) -> risorius.Dna:
    """A copy of the face with another value of one field."""
    out = copy.deepcopy(dna)
    owner: Any = out
    for step in path[:-1]:
        owner = getattr(owner, step) if isinstance(step, str) else owner[step]
    setattr(owner, path[-1], value)
    return out


def others(value: Any) -> Iterator[Any]:
    """Values that differ slightly from a given value and are mostly valid in the same field."""
    if isinstance(value, bool | int):
        yield from (value + 1, max(0, value - 1))
    elif isinstance(value, float):
        yield value + 0.25
    elif isinstance(value, str):
        words = [word for words in CHOICES if value in words for word in words if word != value]
        yield from words or [value + "x"]
    elif isinstance(value, np.ndarray):
        yield from _other_arrays(value)
    elif isinstance(value, dict):
        yield from _other_dicts(value)
    elif is_mapping(value):
        yield from _other_lists(_rows(value))
    elif isinstance(value, list | tuple):
        yield from _other_lists(list(value))


def _other_arrays(value: np.ndarray) -> Iterator[np.ndarray]:
    for at in {0, value.size // 2, value.size - 1} if value.size else ():
        for change in (1, -1):
            out = value.copy()
            if value.dtype.kind != "u":
                out.flat[at] += change / 4
            elif 0 <= int(out.flat[at]) + change <= np.iinfo(value.dtype).max:
                out.flat[at] = int(out.flat[at]) + change  # NumPy 2 adds no -1 to unsigned numbers
            else:
                continue
            yield out
    if value.dtype.kind == "f" and value.size:
        for special in (np.nan, -value.flat[0] if value.flat[0] == 0 else np.inf):
            out = value.copy()
            out.flat[0] = special
            yield out
    if value.size:
        yield value[:-1]
        yield value[::-1]
        yield np.concatenate([value, value[-1:]])


def _rows(mapping: risorius.LodMapping) -> list[list[int]]:
    return [mapping[lod].tolist() for lod in range(len(mapping))]


def _other_dicts(value: dict[str, str]) -> Iterator[dict[str, str]]:
    yield value | {"new": "1"}
    for key in value:
        yield value | {key: "other"}
        yield {k: v for k, v in value.items() if k != key}
    yield dict(reversed(value.items()))


def _other_lists(value: list[Any]) -> Iterator[list[Any]]:
    yield value[::-1]
    value = [_rows(item) if is_mapping(item) else item for item in value]
    for i, item in enumerate(value):
        yield value[:i] + value[i + 1 :]
        yield [*value[:i], item, *value[i:]]
        if isinstance(item, str):
            yield [*value[:i], item + "x", *value[i + 1 :]]
        elif isinstance(item, int) and len(value) == 3:  # rotation signs
            yield [*value[:i], -item, *value[i + 1 :]]
        elif isinstance(item, list | np.ndarray):
            for inner in _other_lists(list(item)):
                yield [*value[:i], inner, *value[i + 1 :]]
        elif isinstance(item, tuple) and len(item) == 3 and isinstance(item[2], bytes):
            yield [*value[:i], (item[0], item[1], item[2] + b"\x00"), *value[i + 1 :]]
            yield [*value[:i], (item[0], "9.9", item[2]), *value[i + 1 :]]
