# SPDX-License-Identifier: MIT
# The names match the built module: tests/python/bindings/test_stub.py compares both.
"""The native part of Risorius: DNA files and rig evaluation."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from os import PathLike
from typing import Any, SupportsFloat, SupportsIndex, SupportsInt, TypeAlias

import numpy as np
import numpy.typing as npt

from .base.errors import RisoriusError

_F32: TypeAlias = npt.NDArray[np.float32]
_F64: TypeAlias = npt.NDArray[np.float64]
_I32: TypeAlias = npt.NDArray[np.int32]
_U16: TypeAlias = npt.NDArray[np.uint16]
_U32: TypeAlias = npt.NDArray[np.uint32]
_Int: TypeAlias = SupportsInt | SupportsIndex
_Float: TypeAlias = SupportsFloat | SupportsIndex
_Path: TypeAlias = PathLike[str] | str | bytes
# (is_error, code, where, byte offset in the file or None, message)
_Finding: TypeAlias = tuple[bool, str, str, int | None, str]

# (time in seconds, name, duration in seconds, value)
_Event: TypeAlias = tuple[float, str, float, str]

class ClipError(RisoriusError):
    """A clip that cannot be read or written."""

    code: str
    """E.g. "truncated"."""
    offset: int | None
    """Byte offset in the file."""
    where: str
    """The part of the clip, e.g. "blocks[3].times"."""

class ClipFile:
    """A .rzc file, read in parts."""

    def __init__(self, source: _Path, recover: bool = False) -> None: ...
    @property
    def names(self) -> tuple[str, ...]: ...
    @property
    def rate(self) -> float: ...
    @property
    def start(self) -> float: ...
    @property
    def has_times(self) -> bool: ...
    @property
    def frame_count(self) -> int: ...
    @property
    def byte_count(self) -> int: ...
    @property
    def block_starts(self) -> list[int]: ...
    @property
    def metadata(self) -> dict[str, str]: ...
    @property
    def events(self) -> list[_Event]: ...
    def read(
        self, begin: _Int, end: _Int, controls: Sequence[_Int] | None = None
    ) -> tuple[_F32, _F64 | None]:
        """float32[controls, frames] of frames begin to end - 1, and the times of these frames in
        seconds; None instead of the times if the clip stores no times."""

class ClipFileWriter:
    """A .rzc file during recording."""

    def __init__(
        self,
        path: _Path,
        names: Sequence[str],
        rate: _Float,
        start: _Float,
        has_times: bool,
        metadata: Sequence[tuple[str, str]],
        block_frames: _Int = 512,
    ) -> None: ...
    @property
    def frame_count(self) -> int: ...
    @property
    def is_open(self) -> bool: ...
    @property
    def part(self) -> PathLike[str]: ...
    def append(self, frames: npt.ArrayLike, times: npt.ArrayLike | None = None) -> None: ...
    def event(self, event: _Event) -> None: ...
    def close(self) -> None: ...

def encode_clip(
    names: Sequence[str],
    curves: npt.ArrayLike,
    rate: _Float,
    start: _Float,
    times: npt.ArrayLike | None,
    events: Sequence[_Event],
    metadata: Sequence[tuple[str, str]],
    block_frames: _Int = 512,
) -> bytes: ...
def write_clip(path: _Path, bytes: bytes) -> None: ...

class DnaError(RisoriusError):
    """A DNA file or Dna value that is invalid."""

    code: str
    """E.g. "truncated"."""
    offset: int | None
    """Byte offset in the file."""
    where: str
    """The DNA field."""

class LodMapping:
    """A list of indices per LOD; mapping[lod] is a uint16 array."""

    def __len__(self) -> int: ...
    def __getitem__(self, lod: _Int) -> _U16: ...
    @property
    def lods(self) -> _U16: ...
    @property
    def rows(self) -> list[_U16]: ...

class Conditionals:
    """Rows from <= in <= to: out += slope * in + cut; six parallel arrays."""

    def __init__(self, **fields: Any) -> None: ...
    def __copy__(self) -> Conditionals: ...
    def __deepcopy__(self, memo: dict[int, object]) -> Conditionals: ...
    @property
    def input_indices(self) -> _U16: ...
    @input_indices.setter
    def input_indices(self, value: npt.ArrayLike) -> None: ...
    @property
    def output_indices(self) -> _U16: ...
    @output_indices.setter
    def output_indices(self, value: npt.ArrayLike) -> None: ...
    @property
    def from_values(self) -> _F32: ...
    @from_values.setter
    def from_values(self, value: npt.ArrayLike) -> None: ...
    @property
    def to_values(self) -> _F32: ...
    @to_values.setter
    def to_values(self, value: npt.ArrayLike) -> None: ...
    @property
    def slope_values(self) -> _F32: ...
    @slope_values.setter
    def slope_values(self, value: npt.ArrayLike) -> None: ...
    @property
    def cut_values(self) -> _F32: ...
    @cut_values.setter
    def cut_values(self, value: npt.ArrayLike) -> None: ...

class Psds:
    """Correctives as a sparse matrix: columns[i] drives rows[i] with weight values[i]."""

    def __init__(self, **fields: Any) -> None: ...
    def __copy__(self) -> Psds: ...
    def __deepcopy__(self, memo: dict[int, object]) -> Psds: ...
    @property
    def rows(self) -> _U16: ...
    @rows.setter
    def rows(self, value: npt.ArrayLike) -> None: ...
    @property
    def columns(self) -> _U16: ...
    @columns.setter
    def columns(self, value: npt.ArrayLike) -> None: ...
    @property
    def values(self) -> _F32: ...
    @values.setter
    def values(self, value: npt.ArrayLike) -> None: ...

class JointGroup:
    """A dense matrix from controls (columns) to joint attributes (rows)."""

    def __init__(self, **fields: Any) -> None: ...
    def __copy__(self) -> JointGroup: ...
    def __deepcopy__(self, memo: dict[int, object]) -> JointGroup: ...
    @property
    def lods(self) -> _U16: ...
    @lods.setter
    def lods(self, value: npt.ArrayLike) -> None: ...
    @property
    def input_indices(self) -> _U16: ...
    @input_indices.setter
    def input_indices(self, value: npt.ArrayLike) -> None: ...
    @property
    def output_indices(self) -> _U16: ...
    @output_indices.setter
    def output_indices(self, value: npt.ArrayLike) -> None: ...
    @property
    def joint_indices(self) -> _U16: ...
    @joint_indices.setter
    def joint_indices(self, value: npt.ArrayLike) -> None: ...
    @property
    def values(self) -> _F32:
        """float32[rows, columns]"""
    @values.setter
    def values(self, value: npt.ArrayLike) -> None: ...

class BlendShapeChannels:
    """Which control drives which channel."""

    def __init__(self, **fields: Any) -> None: ...
    def __copy__(self) -> BlendShapeChannels: ...
    def __deepcopy__(self, memo: dict[int, object]) -> BlendShapeChannels: ...
    @property
    def lods(self) -> _U16: ...
    @lods.setter
    def lods(self, value: npt.ArrayLike) -> None: ...
    @property
    def input_indices(self) -> _U16: ...
    @input_indices.setter
    def input_indices(self, value: npt.ArrayLike) -> None: ...
    @property
    def output_indices(self) -> _U16: ...
    @output_indices.setter
    def output_indices(self, value: npt.ArrayLike) -> None: ...

class AnimatedMaps:
    """Conditionals that turn control values into values of animated maps."""

    def __init__(self, **fields: Any) -> None: ...
    def __copy__(self) -> AnimatedMaps: ...
    def __deepcopy__(self, memo: dict[int, object]) -> AnimatedMaps: ...
    @property
    def lods(self) -> _U16: ...
    @lods.setter
    def lods(self, value: npt.ArrayLike) -> None: ...
    conditionals: Conditionals

class BlendShapeTarget:
    """Sparse deltas of one channel on one mesh."""

    def __init__(self, **fields: Any) -> None: ...
    def __copy__(self) -> BlendShapeTarget: ...
    def __deepcopy__(self, memo: dict[int, object]) -> BlendShapeTarget: ...
    @property
    def deltas(self) -> _F32: ...
    @deltas.setter
    def deltas(self, value: npt.ArrayLike) -> None: ...
    @property
    def vertex_indices(self) -> _U32: ...
    @vertex_indices.setter
    def vertex_indices(self, value: npt.ArrayLike) -> None: ...
    @property
    def blend_shape_channel_index(self) -> int: ...
    @blend_shape_channel_index.setter
    def blend_shape_channel_index(self, value: _Int) -> None: ...

class Mesh:
    """Geometry in file units; faces and skin weights are flat lists with offsets."""

    def __init__(self, **fields: Any) -> None: ...
    def __copy__(self) -> Mesh: ...
    def __deepcopy__(self, memo: dict[int, object]) -> Mesh: ...
    @property
    def positions(self) -> _F32: ...
    @positions.setter
    def positions(self, value: npt.ArrayLike) -> None: ...
    @property
    def texture_coordinates(self) -> _F32: ...
    @texture_coordinates.setter
    def texture_coordinates(self, value: npt.ArrayLike) -> None: ...
    @property
    def normals(self) -> _F32: ...
    @normals.setter
    def normals(self, value: npt.ArrayLike) -> None: ...
    @property
    def layout_positions(self) -> _U32: ...
    @layout_positions.setter
    def layout_positions(self, value: npt.ArrayLike) -> None: ...
    @property
    def layout_texture_coordinates(self) -> _U32: ...
    @layout_texture_coordinates.setter
    def layout_texture_coordinates(self, value: npt.ArrayLike) -> None: ...
    @property
    def layout_normals(self) -> _U32: ...
    @layout_normals.setter
    def layout_normals(self, value: npt.ArrayLike) -> None: ...
    @property
    def face_offsets(self) -> _U32: ...
    @face_offsets.setter
    def face_offsets(self, value: npt.ArrayLike) -> None: ...
    @property
    def face_layouts(self) -> _U32: ...
    @face_layouts.setter
    def face_layouts(self, value: npt.ArrayLike) -> None: ...
    @property
    def maximum_influence_per_vertex(self) -> int: ...
    @maximum_influence_per_vertex.setter
    def maximum_influence_per_vertex(self, value: _Int) -> None: ...
    @property
    def skin_offsets(self) -> _U32: ...
    @skin_offsets.setter
    def skin_offsets(self, value: npt.ArrayLike) -> None: ...
    @property
    def skin_weights(self) -> _F32: ...
    @skin_weights.setter
    def skin_weights(self, value: npt.ArrayLike) -> None: ...
    @property
    def skin_joint_indices(self) -> _U16: ...
    @skin_joint_indices.setter
    def skin_joint_indices(self, value: npt.ArrayLike) -> None: ...
    @property
    def blend_shape_targets(self) -> tuple[BlendShapeTarget, ...]: ...
    @blend_shape_targets.setter
    def blend_shape_targets(self, value: Iterable[BlendShapeTarget]) -> None: ...

class NeuralNetworkLayer:
    """y = activation(W x + b); activation_function: 0 linear 1 relu 2 leakyrelu 3 tanh 4 sigmoid."""

    def __init__(self, **fields: Any) -> None: ...
    def __copy__(self) -> NeuralNetworkLayer: ...
    def __deepcopy__(self, memo: dict[int, object]) -> NeuralNetworkLayer: ...
    @property
    def biases(self) -> _F32: ...
    @biases.setter
    def biases(self, value: npt.ArrayLike) -> None: ...
    @property
    def weights(self) -> _F32: ...
    @weights.setter
    def weights(self, value: npt.ArrayLike) -> None: ...
    @property
    def activation_function(self) -> int: ...
    @activation_function.setter
    def activation_function(self, value: _Int) -> None: ...
    @property
    def activation_parameters(self) -> _F32: ...
    @activation_parameters.setter
    def activation_parameters(self, value: npt.ArrayLike) -> None: ...

class NeuralNetwork:
    """A network that reads the controls input_indices and writes the controls output_indices."""

    def __init__(self, **fields: Any) -> None: ...
    def __copy__(self) -> NeuralNetwork: ...
    def __deepcopy__(self, memo: dict[int, object]) -> NeuralNetwork: ...
    @property
    def output_indices(self) -> _U16: ...
    @output_indices.setter
    def output_indices(self, value: npt.ArrayLike) -> None: ...
    @property
    def input_indices(self) -> _U16: ...
    @input_indices.setter
    def input_indices(self, value: npt.ArrayLike) -> None: ...
    @property
    def layers(self) -> tuple[NeuralNetworkLayer, ...]: ...
    @layers.setter
    def layers(self, value: Iterable[NeuralNetworkLayer]) -> None: ...

class MachineLearnedBehavior:
    """Layer mlbh: neural networks and the controls that they write."""

    def __init__(self, **fields: Any) -> None: ...
    def __copy__(self) -> MachineLearnedBehavior: ...
    def __deepcopy__(self, memo: dict[int, object]) -> MachineLearnedBehavior: ...
    @property
    def ml_control_names(self) -> list[str]: ...
    @ml_control_names.setter
    def ml_control_names(self, value: Iterable[str]) -> None: ...
    @property
    def lod_neural_network_mapping(self) -> LodMapping: ...
    @lod_neural_network_mapping.setter
    def lod_neural_network_mapping(self, value: LodMapping | Iterable[npt.ArrayLike]) -> None: ...
    @property
    def neural_networks(self) -> tuple[NeuralNetwork, ...]: ...
    @neural_networks.setter
    def neural_networks(self, value: Iterable[NeuralNetwork]) -> None: ...
    @property
    def region_names(self) -> list[list[str]]:
        """[mesh][region] -> name"""
    @region_names.setter
    def region_names(self, value: Iterable[Iterable[str]]) -> None: ...
    @property
    def region_network_indices(self) -> list[list[_U16]]:
        """[mesh][region] -> uint16 network indices"""
    @region_network_indices.setter
    def region_network_indices(self, value: Iterable[Iterable[npt.ArrayLike]]) -> None: ...

class MlOperation:
    """operation_type: 0 unspecified 1 gather 2 scatter 3 MLP 4 weighted sum."""

    def __init__(self, **fields: Any) -> None: ...
    def __copy__(self) -> MlOperation: ...
    def __deepcopy__(self, memo: dict[int, object]) -> MlOperation: ...
    @property
    def parameters(self) -> _U32: ...
    @parameters.setter
    def parameters(self, value: npt.ArrayLike) -> None: ...
    @property
    def operation_set_dependency_indices(self) -> _U16: ...
    @operation_set_dependency_indices.setter
    def operation_set_dependency_indices(self, value: npt.ArrayLike) -> None: ...
    @property
    def operation_dependency_indices(self) -> _U16: ...
    @operation_dependency_indices.setter
    def operation_dependency_indices(self, value: npt.ArrayLike) -> None: ...
    @property
    def operation_type(self) -> int: ...
    @operation_type.setter
    def operation_type(self, value: _Int) -> None: ...

class MlType:
    """A graph of operations: operations[set][i], lod_operation_mappings[set]."""

    def __init__(self, **fields: Any) -> None: ...
    def __copy__(self) -> MlType: ...
    def __deepcopy__(self, memo: dict[int, object]) -> MlType: ...
    @property
    def lod_operation_mappings(self) -> list[LodMapping]: ...
    @lod_operation_mappings.setter
    def lod_operation_mappings(
        self, value: Iterable[LodMapping | Iterable[npt.ArrayLike]]
    ) -> None: ...
    @property
    def operations(self) -> list[tuple[MlOperation, ...]]: ...
    @operations.setter
    def operations(self, value: Iterable[Iterable[MlOperation]]) -> None: ...

class MlJoints:
    """Joints that networks move: outputs are joint * 9 (or 10) + attribute."""

    def __init__(self, **fields: Any) -> None: ...
    def __copy__(self) -> MlJoints: ...
    def __deepcopy__(self, memo: dict[int, object]) -> MlJoints: ...
    @property
    def parameter_keys(self) -> _U16: ...
    @parameter_keys.setter
    def parameter_keys(self, value: npt.ArrayLike) -> None: ...
    @property
    def parameter_values(self) -> _U16: ...
    @parameter_values.setter
    def parameter_values(self, value: npt.ArrayLike) -> None: ...
    @property
    def input_indices(self) -> _U16: ...
    @input_indices.setter
    def input_indices(self, value: npt.ArrayLike) -> None: ...
    @property
    def output_indices(self) -> _U16: ...
    @output_indices.setter
    def output_indices(self, value: npt.ArrayLike) -> None: ...

class MachineLearnedBehaviorExt:
    """Layer mlbe: operations that run the networks of layer mlbh, and joints that networks move."""

    def __init__(self, **fields: Any) -> None: ...
    def __copy__(self) -> MachineLearnedBehaviorExt: ...
    def __deepcopy__(self, memo: dict[int, object]) -> MachineLearnedBehaviorExt: ...
    @property
    def types(self) -> tuple[MlType, ...]: ...
    @types.setter
    def types(self, value: Iterable[MlType]) -> None: ...
    joints: MlJoints

class RbfSolver:
    """solver_type: 0 additive 1 interpolative; automatic_radius: 0 on 1 off; distance_method: 0
    euclidean 1 quaternion 2 swing angle 3 twist angle; normalize_method: 0 only above one 1
    always; function_type: 0 gaussian 1 exponential 2 linear 3 cubic 4 quintic.
    """

    def __init__(self, **fields: Any) -> None: ...
    def __copy__(self) -> RbfSolver: ...
    def __deepcopy__(self, memo: dict[int, object]) -> RbfSolver: ...
    name: str
    @property
    def raw_control_indices(self) -> _U16: ...
    @raw_control_indices.setter
    def raw_control_indices(self, value: npt.ArrayLike) -> None: ...
    @property
    def pose_indices(self) -> _U16: ...
    @pose_indices.setter
    def pose_indices(self, value: npt.ArrayLike) -> None: ...
    @property
    def raw_control_values(self) -> _F32: ...
    @raw_control_values.setter
    def raw_control_values(self, value: npt.ArrayLike) -> None: ...
    @property
    def radius(self) -> float: ...
    @radius.setter
    def radius(self, value: _Float) -> None: ...
    @property
    def weight_threshold(self) -> float: ...
    @weight_threshold.setter
    def weight_threshold(self, value: _Float) -> None: ...
    @property
    def solver_type(self) -> int: ...
    @solver_type.setter
    def solver_type(self, value: _Int) -> None: ...
    @property
    def automatic_radius(self) -> int: ...
    @automatic_radius.setter
    def automatic_radius(self, value: _Int) -> None: ...
    @property
    def distance_method(self) -> int: ...
    @distance_method.setter
    def distance_method(self, value: _Int) -> None: ...
    @property
    def normalize_method(self) -> int: ...
    @normalize_method.setter
    def normalize_method(self, value: _Int) -> None: ...
    @property
    def function_type(self) -> int: ...
    @function_type.setter
    def function_type(self, value: _Int) -> None: ...
    @property
    def twist_axis(self) -> int: ...
    @twist_axis.setter
    def twist_axis(self, value: _Int) -> None: ...

class RbfPose:
    """Name and scale of a pose."""

    def __init__(self, **fields: Any) -> None: ...
    def __copy__(self) -> RbfPose: ...
    def __deepcopy__(self, memo: dict[int, object]) -> RbfPose: ...
    name: str
    @property
    def scale(self) -> float: ...
    @scale.setter
    def scale(self, value: _Float) -> None: ...

class RbfBehavior:
    """Layer rbfb: radial basis function solvers and their poses."""

    def __init__(self, **fields: Any) -> None: ...
    def __copy__(self) -> RbfBehavior: ...
    def __deepcopy__(self, memo: dict[int, object]) -> RbfBehavior: ...
    @property
    def lod_solver_mapping(self) -> LodMapping: ...
    @lod_solver_mapping.setter
    def lod_solver_mapping(self, value: LodMapping | Iterable[npt.ArrayLike]) -> None: ...
    @property
    def solvers(self) -> tuple[RbfSolver, ...]: ...
    @solvers.setter
    def solvers(self, value: Iterable[RbfSolver]) -> None: ...
    @property
    def poses(self) -> tuple[RbfPose, ...]: ...
    @poses.setter
    def poses(self, value: Iterable[RbfPose]) -> None: ...

class RbfPoseControls:
    """The output controls of a pose of layer rbfb. Each output control gets its weight times the
    value of the pose times the product of the input controls.
    """

    def __init__(self, **fields: Any) -> None: ...
    def __copy__(self) -> RbfPoseControls: ...
    def __deepcopy__(self, memo: dict[int, object]) -> RbfPoseControls: ...
    @property
    def input_control_indices(self) -> _U16: ...
    @input_control_indices.setter
    def input_control_indices(self, value: npt.ArrayLike) -> None: ...
    @property
    def output_control_indices(self) -> _U16: ...
    @output_control_indices.setter
    def output_control_indices(self, value: npt.ArrayLike) -> None: ...
    @property
    def output_control_weights(self) -> _F32: ...
    @output_control_weights.setter
    def output_control_weights(self, value: npt.ArrayLike) -> None: ...

class RbfBehaviorExt:
    """Layer rbfe: the output controls of each pose of layer rbfb."""

    def __init__(self, **fields: Any) -> None: ...
    def __copy__(self) -> RbfBehaviorExt: ...
    def __deepcopy__(self, memo: dict[int, object]) -> RbfBehaviorExt: ...
    @property
    def pose_control_names(self) -> list[str]: ...
    @pose_control_names.setter
    def pose_control_names(self, value: Iterable[str]) -> None: ...
    @property
    def poses(self) -> tuple[RbfPoseControls, ...]: ...
    @poses.setter
    def poses(self, value: Iterable[RbfPoseControls]) -> None: ...

class JointBehaviorMetadata:
    """Layer jbmd: the representation of the attributes of each joint."""

    def __init__(self, **fields: Any) -> None: ...
    def __copy__(self) -> JointBehaviorMetadata: ...
    def __deepcopy__(self, memo: dict[int, object]) -> JointBehaviorMetadata: ...
    @property
    def joint_representations(self) -> _U16:
        """uint16[J, 3]: translation, rotation (0 Euler 1 quaternion), scale"""
    @joint_representations.setter
    def joint_representations(self, value: npt.ArrayLike) -> None: ...

class TwistSwingSetup:
    """Distributes the rotation of four controls (x y z w) over joints."""

    def __init__(self, **fields: Any) -> None: ...
    def __copy__(self) -> TwistSwingSetup: ...
    def __deepcopy__(self, memo: dict[int, object]) -> TwistSwingSetup: ...
    @property
    def blend_weights(self) -> _F32: ...
    @blend_weights.setter
    def blend_weights(self, value: npt.ArrayLike) -> None: ...
    @property
    def output_joint_indices(self) -> _U16: ...
    @output_joint_indices.setter
    def output_joint_indices(self, value: npt.ArrayLike) -> None: ...
    @property
    def input_control_indices(self) -> _U16: ...
    @input_control_indices.setter
    def input_control_indices(self, value: npt.ArrayLike) -> None: ...
    @property
    def twist_axis(self) -> int: ...
    @twist_axis.setter
    def twist_axis(self, value: _Int) -> None: ...

class TwistSwingBehavior:
    """Layer twsw: setups that distribute the twist or the swing of a rotation over joints."""

    def __init__(self, **fields: Any) -> None: ...
    def __copy__(self) -> TwistSwingBehavior: ...
    def __deepcopy__(self, memo: dict[int, object]) -> TwistSwingBehavior: ...
    @property
    def twists(self) -> tuple[TwistSwingSetup, ...]: ...
    @twists.setter
    def twists(self, value: Iterable[TwistSwingSetup]) -> None: ...
    @property
    def swings(self) -> tuple[TwistSwingSetup, ...]: ...
    @swings.setter
    def swings(self, value: Iterable[TwistSwingSetup]) -> None: ...

class Dna:
    """A whole DNA file as a value; see risorius.load."""

    def __init__(self, **fields: Any) -> None: ...
    def __copy__(self) -> Dna: ...
    def __deepcopy__(self, memo: dict[int, object]) -> Dna: ...
    @property
    def generation(self) -> int: ...
    @property
    def version(self) -> int:
        """Minor version of the file that was read: 8 is 2.8."""
    name: str
    archetype: str
    gender: str
    @property
    def age(self) -> int: ...
    @age.setter
    def age(self, value: _Int) -> None: ...
    translation_unit: str
    rotation_unit: str
    @property
    def lod_count(self) -> int: ...
    @lod_count.setter
    def lod_count(self, value: _Int) -> None: ...
    @property
    def max_lod(self) -> int: ...
    @max_lod.setter
    def max_lod(self, value: _Int) -> None: ...
    complexity: str
    db_name: str
    rotation_sequence: str
    face_winding_order: str
    @property
    def rotation_signs(self) -> tuple[int, int, int]: ...
    @rotation_signs.setter
    def rotation_signs(self, value: Sequence[_Int]) -> None: ...
    @property
    def coordinate_system(self) -> tuple[str, str, str]:
        """Directions of the file's x, y and z axes, e.g. ('right', 'up', 'front')."""
    @coordinate_system.setter
    def coordinate_system(self, value: Sequence[str]) -> None: ...
    metadata: dict[str, str]
    @property
    def gui_control_names(self) -> list[str]: ...
    @gui_control_names.setter
    def gui_control_names(self, value: Iterable[str]) -> None: ...
    @property
    def raw_control_names(self) -> list[str]: ...
    @raw_control_names.setter
    def raw_control_names(self, value: Iterable[str]) -> None: ...
    @property
    def joint_names(self) -> list[str]: ...
    @joint_names.setter
    def joint_names(self, value: Iterable[str]) -> None: ...
    @property
    def blend_shape_channel_names(self) -> list[str]: ...
    @blend_shape_channel_names.setter
    def blend_shape_channel_names(self, value: Iterable[str]) -> None: ...
    @property
    def animated_map_names(self) -> list[str]: ...
    @animated_map_names.setter
    def animated_map_names(self, value: Iterable[str]) -> None: ...
    @property
    def mesh_names(self) -> list[str]: ...
    @mesh_names.setter
    def mesh_names(self, value: Iterable[str]) -> None: ...
    @property
    def joint_parents(self) -> _U16: ...
    @joint_parents.setter
    def joint_parents(self, value: npt.ArrayLike) -> None: ...
    @property
    def neutral_joint_translations(self) -> _F32: ...
    @neutral_joint_translations.setter
    def neutral_joint_translations(self, value: npt.ArrayLike) -> None: ...
    @property
    def neutral_joint_rotations(self) -> _F32: ...
    @neutral_joint_rotations.setter
    def neutral_joint_rotations(self, value: npt.ArrayLike) -> None: ...
    @property
    def lod_joint_mapping(self) -> LodMapping: ...
    @lod_joint_mapping.setter
    def lod_joint_mapping(self, value: LodMapping | Iterable[npt.ArrayLike]) -> None: ...
    @property
    def lod_blend_shape_mapping(self) -> LodMapping: ...
    @lod_blend_shape_mapping.setter
    def lod_blend_shape_mapping(self, value: LodMapping | Iterable[npt.ArrayLike]) -> None: ...
    @property
    def lod_animated_map_mapping(self) -> LodMapping: ...
    @lod_animated_map_mapping.setter
    def lod_animated_map_mapping(self, value: LodMapping | Iterable[npt.ArrayLike]) -> None: ...
    @property
    def lod_mesh_mapping(self) -> LodMapping: ...
    @lod_mesh_mapping.setter
    def lod_mesh_mapping(self, value: LodMapping | Iterable[npt.ArrayLike]) -> None: ...
    @property
    def mesh_blend_shape_channel_mapping(self) -> _U16:
        """uint16[n, 2]: mesh, channel"""
    @mesh_blend_shape_channel_mapping.setter
    def mesh_blend_shape_channel_mapping(self, value: npt.ArrayLike) -> None: ...
    @property
    def psd_count(self) -> int: ...
    @psd_count.setter
    def psd_count(self, value: _Int) -> None: ...
    gui_to_raw: Conditionals
    psds: Psds
    @property
    def joint_row_count(self) -> int: ...
    @joint_row_count.setter
    def joint_row_count(self, value: _Int) -> None: ...
    @property
    def joint_column_count(self) -> int: ...
    @joint_column_count.setter
    def joint_column_count(self, value: _Int) -> None: ...
    @property
    def joint_groups(self) -> tuple[JointGroup, ...]: ...
    @joint_groups.setter
    def joint_groups(self, value: Iterable[JointGroup]) -> None: ...
    blend_shape_channels: BlendShapeChannels
    animated_maps: AnimatedMaps
    @property
    def meshes(self) -> tuple[Mesh, ...]: ...
    @meshes.setter
    def meshes(self, value: Iterable[Mesh]) -> None: ...
    machine_learned_behavior: MachineLearnedBehavior
    machine_learned_behavior_ext: MachineLearnedBehaviorExt
    rbf_behavior: RbfBehavior
    rbf_behavior_ext: RbfBehaviorExt
    joint_behavior_metadata: JointBehaviorMetadata
    twist_swing_behavior: TwistSwingBehavior
    def to_bytes(self, version: str = "2.8", unknown_layers: str = "preserve") -> bytes:
        """The bytes of a file of this version. A UserWarning names each layer that the version does
        not know. Newer and unknown layers are written anyway (2.1 has no place for them), or left
        out with unknown_layers='ignore'.
        """
    def save(self, path: _Path, version: str = "2.8", unknown_layers: str = "preserve") -> None:
        """Writes the file atomically: the old file stays until the new one is complete."""
    def to_json(self) -> str:
        """The whole value as JSON with the format's own field names. Lossless: numbers have the
        fewest digits that give the same bits back.
        """
    @staticmethod
    def from_json(text: str, limits: Limits = ...) -> Dna:
        """Reads the output of to_json."""
    @property
    def unknown_layers(self) -> list[tuple[str, str, bytes]]:
        """Layers unknown to this version: (id, version, bytes)."""
    @unknown_layers.setter
    def unknown_layers(self, value: Sequence[tuple[str, str, bytes]]) -> None: ...
    @property
    def layers(self) -> list[str]:
        """Ids of the file's layers, in file order."""
    @property
    def warnings(self) -> list[str]: ...
    def validate(self) -> list[str]:
        """The tolerable oddities. Raises DnaError for an error."""
    def size_in_bytes(self) -> int:
        """Bytes of its numbers and texts in a file, the basis of limits on work with it."""
    def filter_lods(self, lods: tuple[int, int] | Sequence[int] | None) -> Dna:
        """A copy with (max_lod, min_lod) or [lod, ...] only; all indices refer to the remaining
        items."""
    def convert(
        self,
        *,
        axes: Sequence[str] | None = None,
        rotation_sequence: str | None = None,
        rotation_signs: Sequence[_Int] | None = None,
        face_winding_order: str | None = None,
        translation_unit: str | None = None,
        rotation_unit: str | None = None,
    ) -> Dna:
        """A copy in another coordinate system or other units, e.g. axes=('right', 'front', 'up'),
        rotation_sequence='xyz', rotation_signs=(1, 1, 1), face_winding_order='ccw',
        translation_unit='m', rotation_unit='radians'; missing arguments keep the file's. Raw
        controls with a rotation are interpreted in the new axes. A UserWarning names data that the
        format cannot express. Raises ValueError for invalid values, DnaError if the file's own
        values are invalid.
        """
    def __reduce__(self) -> tuple[Any, ...]: ...

class Limits:
    """Limits on a file: bytes of the file, layers in its index, elements of any list, levels of
    JSON.
    """

    def __init__(
        self,
        *,
        max_bytes: _Int = 4294967296,
        max_layers: _Int = 4096,
        max_count: _Int = 268435456,
        max_nesting: _Int = 32,
    ) -> None: ...
    @property
    def max_bytes(self) -> int: ...
    @max_bytes.setter
    def max_bytes(self, value: _Int) -> None: ...
    @property
    def max_layers(self) -> int: ...
    @max_layers.setter
    def max_layers(self, value: _Int) -> None: ...
    @property
    def max_count(self) -> int: ...
    @max_count.setter
    def max_count(self, value: _Int) -> None: ...
    @property
    def max_nesting(self) -> int: ...
    @max_nesting.setter
    def max_nesting(self, value: _Int) -> None: ...

class ParseOptions:
    def __init__(self) -> None: ...
    definition: bool
    behavior: bool
    geometry: bool
    blend_shapes: bool
    machine_learned_behavior: bool
    rbf_behavior: bool
    joint_behavior_metadata: bool
    twist_swing_behavior: bool
    unknown_layers: bool
    unreferenced_blend_shapes: bool
    limits: Limits
    def set_lods(self, lods: tuple[int, int] | Sequence[int] | None) -> None: ...

class FileReplacement:
    """A new file beside `path`: write it under the name `temporary` and close it; commit() then
    puts it in the place of `path`."""

    def __init__(self, path: _Path, sweep: bool = True) -> None: ...
    @property
    def temporary(self) -> PathLike[str]: ...
    def commit(self) -> None: ...
    def discard(self) -> None: ...

def make_hidden_folder(path: _Path) -> PathLike[str]:
    """Makes a hidden folder beside the file `path`, and removes leftovers there like
    remove_leftovers. If this process ends before it removes the folder, a later call does."""

def put_in_place(file: _Path, path: _Path) -> None:
    """Flushes a whole file to the disk and puts it in the place of the file `path`, with the
    permissions of the old file; both must be on one file system."""

def remove_leftovers(folder: _Path) -> None:
    """Removes partial files of ended processes of this machine."""

def parse_bytes(data: bytes, options: ParseOptions, /) -> Dna: ...
def parse_file(path: _Path, options: ParseOptions, /) -> Dna: ...
def check_bytes(data: bytes, limits: Limits, /) -> list[_Finding]: ...
def check_file(path: _Path, limits: Limits, /) -> list[_Finding]: ...

class Pose:
    """joints float32[J, 9]: tx ty tz rx ry rz sx sy sz deltas from neutral in the file's units and
    axes, or with rotation='quaternion' [J, 10]: tx ty tz qx qy qz qw sx sy sz; blend_shapes[B];
    animated_maps[A] in [0, 1]; controls[raw + corrective + ...]
    """

    @property
    def joints(self) -> _F32: ...
    @property
    def blend_shapes(self) -> _F32: ...
    @property
    def animated_maps(self) -> _F32: ...
    @property
    def controls(self) -> _F32: ...

class Instance:
    """The state of one face through time, with the reference's one-frame latencies."""

    @property
    def lod(self) -> int: ...
    @lod.setter
    def lod(self, value: _Int) -> None: ...
    @property
    def masks(self) -> _F32:
        """float32, one per region of each mesh; 0 disables the region's networks. The property
        gives a copy: assign the whole array to change a mask."""
    @masks.setter
    def masks(self, value: npt.ArrayLike) -> None: ...
    def evaluate(self, raw: npt.ArrayLike, check: bool = False) -> Pose:
        """float32[R] -> Pose; with check, a value that is not finite raises DnaError and no frame
        passes."""

class Rig:
    """A compiled face: turns raw controls into a Pose. Immutable, shared freely."""

    def __init__(
        self,
        dna: Dna,
        *,
        precision: str = "float32",
        rotation: str = "euler",
        simd: str | None = None,
    ) -> None: ...
    @staticmethod
    def from_bytes(
        bytes: bytes | bytearray | memoryview, trusted: bool = False, simd: str | None = None
    ) -> Rig:
        """A Rig from the output of to_bytes or block, of this version and byte order."""
    def to_bytes(self) -> bytes:
        """The compiled face as bytes, a cache for from_bytes."""
    def save(self, path: _Path) -> None:
        """Writes to_bytes() to a file atomically: an old file stays until the new one is
        complete."""
    @staticmethod
    def load(
        path: _Path,
        trusted: bool | None = False,
        simd: str | None = None,
        *,
        mapped: bool = False,
    ) -> Rig:
        """A Rig from a file written by save, of this version and byte order.

        The hash and every index are checked. trusted=None skips the indices if the file belongs to
        this user and nobody else may write it (never on Windows). Downloaded or unpacked files
        satisfy this too, so use None only for folders that only this program fills. The hash finds
        damage, not forgery. trusted=True skips both checks: one flipped bit may then end the
        process. mapped uses the pages of a trusted file in place: while the Rig lives, replace the
        file only as a whole, never write to it or cut it. Raises DnaError.
        """
    def block(self) -> memoryview:
        """The same as to_bytes, without a copy."""
    @property
    def rotation(self) -> str: ...
    @property
    def initial_raw_controls(self) -> _F32:
        """float32[R]: 0, but 1 for the w of each rotation that solvers and setups read."""
    def raw_to_gui(self, raw: npt.ArrayLike) -> _F32:
        """float32[R] -> float32[G], if the table can be inverted."""
    @property
    def raw_control_names(self) -> list[str]: ...
    @property
    def gui_control_names(self) -> list[str]: ...
    @property
    def joint_count(self) -> int: ...
    @property
    def blend_shape_count(self) -> int: ...
    @property
    def animated_map_count(self) -> int: ...
    @property
    def lod_count(self) -> int: ...
    @property
    def control_count(self) -> int: ...
    @property
    def ignored_layers(self) -> list[str]: ...
    @property
    def memory_bytes(self) -> int: ...
    @property
    def simd(self) -> str: ...
    @property
    def neutral_joints(self) -> _F32: ...
    @property
    def joint_indices_written(self) -> _U16: ...
    def gui_to_raw(self, gui: npt.ArrayLike) -> _F32:
        """float32[G] -> float32[R] in [0, 1]"""
    def evaluate(
        self, raw: npt.ArrayLike, lod: _Int = 0, settle: bool = True, check: bool = False
    ) -> Pose:
        """float32[R] -> Pose; a function of raw alone if settle is true. Values outside [0, 1] are
        used as they are: joints and shapes extrapolate, correctives clamp their factors, maps are 0
        outside their intervals. NaN or infinity affects only the outputs of its control, and no
        later pose; with check it raises DnaError with the name of the control.
        """
    def evaluate_batch(
        self,
        raw: npt.ArrayLike,
        lod: _Int = 0,
        threads: _Int = 0,
        settle: bool = True,
        check: bool = False,
    ) -> Pose:
        """float32[N, R] -> Pose whose fields have a leading N; threads 0 uses all cores. With
        check, the error names the first frame and control that is not finite.
        """
    def find_non_finite(self, raw: npt.ArrayLike) -> list[tuple[int, str, float]]:
        """float32[R] or float32[N, R] -> (frame, name, value) of each NaN or infinity."""
    def solver_poses(
        self, index: _Int, controls: npt.ArrayLike
    ) -> tuple[npt.NDArray[np.float64], _F32]:
        """For an RBF solver and the controls of a Pose: the distances of its poses from the input
        (radians for angles), and the weights of its poses, 0 below the threshold.
        """
    def instance(self) -> Instance: ...

class Morph:
    """The blend shape targets of one mesh, compiled for fast sums."""

    def __init__(
        self, dna: Dna, mesh_index: _Int, *, matrix: npt.ArrayLike | None = None
    ) -> None: ...
    @property
    def vertex_count(self) -> int: ...
    @property
    def channel_indices(self) -> _U16: ...
    @property
    def memory_bytes(self) -> int: ...
    def evaluate(
        self,
        blend_shapes: npt.ArrayLike,
        base: npt.ArrayLike | None = None,
        out: _F32 | None = None,
    ) -> _F32:
        """float32[B] -> float32[V, 3]: base + sum of weight * delta."""

class BoneSpace:
    """Converts joint poses to bone channels of another program, with its axes and units."""

    def __init__(
        self,
        neutral_rotations: npt.ArrayLike,
        bones: Sequence[int],
        *,
        axes: npt.ArrayLike,
        scale: _Float = 1.0,
        radians: _Float = 1.0,
        sequence: Sequence[int] = (0, 1, 2),
        signs: Sequence[float] = (1.0, 1.0, 1.0),
    ) -> None: ...
    def evaluate(self, joints: npt.ArrayLike) -> tuple[_F32, _F32, _F32]:
        """float32[J, 9] of a Pose -> (location[n, 3], rotation[n, 4] w x y z, scale[n, 3])."""

class JointChain:
    """The bones of an armature: from bone channels to matrices that move the skin.

    Each bone passes its whole motion on to its children, shear included.
    """

    def __init__(self, parents: npt.ArrayLike, rest: npt.ArrayLike) -> None:
        """parents int[B], -1: none, in any order; rest float[B, 4, 4], armature space."""
    @property
    def bone_count(self) -> int: ...
    def evaluate(
        self, location: npt.ArrayLike, rotation: npt.ArrayLike, scale: npt.ArrayLike
    ) -> _F32:
        """[B, 3], [B, 4] w x y z, [B, 3] -> float32[B, 3, 4], pose times the inverse of rest."""

class Skin:
    """The skin weights of a mesh by bone."""

    def __init__(
        self,
        vertex_count: _Int,
        offsets: npt.ArrayLike,
        bones: npt.ArrayLike,
        weights: npt.ArrayLike,
        bone_count: _Int,
    ) -> None:
        """offsets int[V + 1]; bones int[N]; weights float32[N], 0 or more, with any sum."""
    @property
    def vertex_count(self) -> int: ...
    @property
    def bone_count(self) -> int: ...
    @property
    def memory_bytes(self) -> int: ...
    def evaluate(
        self,
        points: npt.ArrayLike,
        matrices: npt.ArrayLike,
        out: _F32 | None = None,
        simd: str | None = None,
    ) -> _F32:
        """points float32[V, 3], matrices float32[B, 3, 4] of a JointChain -> float32[V, 3]."""

class DirectFace:
    """A face that writes finished vertices of its meshes, frame by frame.

    A mesh is skipped if nothing changed since it was written to the same memory.
    """

    def __init__(
        self,
        rig: Rig,
        space: BoneSpace,
        chain: JointChain,
        rows: npt.ArrayLike,
        meshes: Sequence[tuple[Morph, npt.ArrayLike, Skin]],
        *,
        turned: npt.ArrayLike = (),
    ) -> None:
        """rows int[n]: the bone of chain of each bone of space; base float32[V, 3] of each mesh."""
    @property
    def mesh_count(self) -> int: ...
    def keep(self, location: npt.ArrayLike, rotation: npt.ArrayLike, scale: npt.ArrayLike) -> None:
        """Channels of the chain's bones that are not in rows: [B, 3], [B, 4], [B, 3]."""
    def set_base(self, mesh: _Int, base: npt.ArrayLike) -> None: ...
    def forget(self) -> None:
        """Makes the next frame write every mesh."""

def evaluate_faces(
    faces: Sequence[DirectFace],
    raw: Sequence[npt.ArrayLike],
    lods: Sequence[_Int],
    targets: Sequence[dict[int, _F32 | tuple[int, int]]],
    *,
    turns: Sequence[npt.ArrayLike | None] | None = None,
    anew: bool = False,
    threads: _Int = 0,
) -> list[tuple[Pose, tuple[int, ...]]]:
    """Evaluates one frame of several faces -> per face (Pose, the meshes that were written).

    targets: per face {mesh: float32[V, 3], or (address, V) of such memory}.
    """

def deform_faces(
    faces: Sequence[DirectFace],
    joints: Sequence[npt.ArrayLike],
    blend_shapes: Sequence[npt.ArrayLike],
    targets: Sequence[dict[int, _F32 | tuple[int, int]]],
    *,
    turns: Sequence[npt.ArrayLike | None] | None = None,
    anew: bool = False,
    threads: _Int = 0,
) -> list[tuple[int, ...]]:
    """Deforms several faces by given poses -> per face the meshes that were written.

    joints float32[J, 9] and blend_shapes float32[C] per face; targets as in evaluate_faces.
    """

class Skins:
    """See risorius.Surface."""

    def __init__(self, dna: Dna, rig: Rig, lod: _Int) -> None: ...

class Probe:
    """Selected points of Skins: uint32[P, 2], mesh and vertex."""

    def __init__(self, skins: Skins, points: npt.ArrayLike) -> None: ...
    def positions(self, raw: npt.ArrayLike) -> _F64:
        """float32[R] -> float64[P, 3]."""
    def linearise(self, raw: npt.ArrayLike, highest: npt.ArrayLike, free: npt.ArrayLike) -> None:
        """Computes and keeps the derivative of the points by each control at the pose `raw`."""
    def jacobian(self) -> _F32:
        """float32[P, 3, R], from the last linearise."""
    def normal_matrix(self) -> _F64:
        """float64[R, R]: J^T J of the last linearise."""
    def gradient(self, residual: npt.ArrayLike) -> _F64:
        """float64[P, 3] -> float64[R]: J^T residual of the last linearise."""

def least_change(
    a: npt.ArrayLike, b: npt.ArrayLike, low: npt.ArrayLike, high: npt.ArrayLike, ridge: _Float
) -> _F64:
    """The x in [low, high] that minimises |a x - b|^2 + ridge |x|^2."""

def descend(
    h: npt.ArrayLike,
    g: npt.ArrayLike,
    low: npt.ArrayLike,
    high: npt.ArrayLike,
    rest: npt.ArrayLike,
    sparse: npt.ArrayLike,
    start: npt.ArrayLike,
    tolerance: _Float = 1e-5,
) -> _F64:
    """The x in [low, high] that minimises 1/2 x^T h x - g^T x + sparse |x - rest|."""

def rig_block_version() -> int:
    """Version of Rig.to_bytes; from_bytes refuses other versions."""

def compile_version() -> int:
    """Version of the compilation from DNA to Rig; it increases if poses of existing files
    change."""

def quaternion_column_orders(dna: Dna) -> list[npt.NDArray[np.uint32]]:
    """The columns of each joint group that rotate quaternion joints, uint32[n], in the order in
    which their rotations are multiplied.

    Raises:
        DnaError: lists that do not fit each other, as Dna.validate.
    """

def available_simd() -> str:
    """The instruction sets of this processor, in the words of `simd=`, separated by ", "."""

class GroupSizes:
    """Number of joint groups, rows, stored coefficients (with zeros), and nonzero coefficients."""

    @property
    def groups(self) -> int: ...
    @property
    def rows(self) -> int: ...
    @property
    def coefficients(self) -> int: ...
    @property
    def nonzero(self) -> int: ...

class LargestChange:
    """The largest difference of one kind between two rigs; joint is "" if nothing differs."""

    @property
    def value(self) -> float: ...
    @property
    def joint(self) -> str: ...
    @property
    def expression(self) -> str: ...
    @property
    def lod(self) -> int: ...

class RegroupReport:
    """The result of regroup."""

    @property
    def before(self) -> GroupSizes: ...
    @property
    def after(self) -> GroupSizes: ...
    @property
    def regions(self) -> list[list[int]]: ...
    @property
    def removed(self) -> int: ...
    @property
    def microseconds_before(self) -> float: ...
    @property
    def microseconds_after(self) -> float: ...
    @property
    def translation_mm(self) -> LargestChange:
        """Translation of a joint relative to its parent."""
    @property
    def rotation_degrees(self) -> LargestChange:
        """Rotation of a joint relative to its parent."""
    @property
    def scale(self) -> LargestChange:
        """Scale of a joint; 1 is the original size."""
    @property
    def position_mm(self) -> LargestChange:
        """Position of a joint in the face."""
    @property
    def expressions(self) -> int:
        """Number of raw controls tried one by one."""
    @property
    def combinations(self) -> int:
        """Number of random poses tried."""

class JointFit:
    """Joints, weights and joint motions that repeat shapes."""

    @property
    def joints(self) -> npt.NDArray[np.float64]:
        """float64[J, 3]: neutral positions."""
    @property
    def mirrored(self) -> npt.NDArray[np.uint32]:
        """uint32[J]: the joint of the other side, itself in the middle."""
    @property
    def weight_joints(self) -> npt.NDArray[np.uint16]:
        """uint16[V, influences]: joints of each vertex."""
    @property
    def weights(self) -> npt.NDArray[np.float32]:
        """float32[V, influences]: their weights, rows sum to 1."""
    @property
    def rotations(self) -> npt.NDArray[np.float64]:
        """float64[E, J, 3]: rotation vectors about the joint, radians."""
    @property
    def translations(self) -> npt.NDArray[np.float64]:
        """float64[E, J, 3]: shifts of the joint."""

class FitShapes:
    """A mesh and the displacements of its expressions."""

    def __init__(
        self,
        neutral: npt.ArrayLike,
        displacements: npt.ArrayLike,
        edges: npt.ArrayLike,
        importance: npt.ArrayLike = ...,
    ) -> None: ...

class GivenJoints:
    """Joints that are there, and their motions."""

    def __init__(
        self,
        positions: npt.ArrayLike,
        rotations: npt.ArrayLike,
        translations: npt.ArrayLike,
        mirrored: npt.ArrayLike = ...,
    ) -> None: ...

class FitPivot:
    """A point that some expressions turn about."""

    def __init__(self, position: npt.ArrayLike, expressions: Sequence[int]) -> None: ...

class FitWeights:
    """Joints and weights of each vertex."""

    def __init__(self, joints: npt.ArrayLike, weights: npt.ArrayLike) -> None: ...

class FitSettings:
    """risorius.author.FitOptions, and the pivots."""

    joints: int
    influences: int
    smoothness: float
    symmetric: bool
    emphasis: float
    least_effect: float
    bound: bool
    rounds: int
    threads: int
    pivots: Sequence[FitPivot]
    def __init__(self) -> None: ...

def fit_joints(
    shapes: FitShapes,
    given: GivenJoints,
    options: FitSettings,
    progress: Callable[[float], bool | None] | None,
) -> JointFit:
    """JointFit: see risorius.author.fitting."""

def fit_weights(
    shapes: FitShapes, given: GivenJoints, options: FitSettings, start: FitWeights
) -> JointFit:
    """JointFit with these joints: see risorius.author.fitting."""

def fit_motions(
    shapes: FitShapes,
    given: GivenJoints,
    options: FitSettings,
    weights: FitWeights,
    at: Sequence[int],
) -> JointFit:
    """JointFit with these weights: see risorius.author.fitting."""

class FaultSums:
    """The faults beyond the allowed ones, as one number of each kind."""

    @property
    def volume(self) -> float:
        """mm3: sum of depth times area."""
    @property
    def deepest(self) -> float:
        """mm beyond the allowed depth."""
    @property
    def stretched(self) -> int:
        """Number of faces with more than 2.5 times their neutral area."""
    @property
    def widest(self) -> float:
        """Area of the most stretched face, relative to its neutral area."""
    @property
    def folded(self) -> int:
        """Number of edges whose two faces lie on each other."""

class SkinFaults:
    """The faults of a posed skin."""

    def __init__(
        self, depth: npt.ArrayLike, stretch: npt.ArrayLike, fold: npt.ArrayLike
    ) -> None: ...
    @property
    def depth(self) -> _F32:
        """float32[V], depth in mm inside a solid or the skin itself."""
    @property
    def stretch(self) -> _F32:
        """float32[F], area relative to the neutral area."""
    @property
    def fold(self) -> _F32:
        """float32[inner edges], cosine between the normals of both faces."""

class SkinChecker:
    """See risorius.author.correctives."""

    def __init__(
        self,
        neutral: npt.ArrayLike,
        face_offsets: npt.ArrayLike,
        corners: npt.ArrayLike,
        solids: Sequence[tuple[npt.ArrayLike, _Int]],
        mm: _Float,
    ) -> None: ...
    @property
    def shown(self) -> npt.NDArray[np.bool_]:
        """bool[V]: visible vertices; only these must stay outside."""
    def nearest(self, points: npt.ArrayLike, normals: npt.ArrayLike) -> tuple[_U32, _F64, _F64]:
        """uint32[n, 3] corners of the nearest triangle of the neutral skin, float64[n, 3]
        barycentric coordinates in these corners, float64[n] distance in mm."""
    def look(self, skin: npt.ArrayLike, solids: Sequence[npt.ArrayLike]) -> SkinFaults:
        """SkinFaults of a pose."""
    def sum(self, faults: SkinFaults, allowed: SkinFaults) -> FaultSums:
        """FaultSums."""
    def repair(
        self,
        skin: npt.ArrayLike,
        solids: Sequence[npt.ArrayLike],
        allowed: SkinFaults,
        without: Sequence[npt.ArrayLike],
    ) -> tuple[_F64, FaultSums, FaultSums]:
        """float64[V, 3] to be added, FaultSums before and after."""

class ClosestPoints:
    """A surface of triangles that finds its points closest to others."""

    def __init__(self, points: npt.ArrayLike, triangles: npt.ArrayLike) -> None: ...
    def nearest(
        self,
        queries: npt.ArrayLike,
        normals: npt.ArrayLike | None = None,
        least_cosine: _Float = -1.0,
        farthest: _Float = ...,
        threads: _Int = 0,
    ) -> tuple[_I32, _F64, _F64]:
        """int32[n] triangle (-1: none), float64[n, 3] barycentric coordinates, float64[n] distance.

        With normals, only triangles count whose normal has at least that cosine with the normal of
        the query."""
    def first_hit(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        farthest: _Float = ...,
        threads: _Int = 0,
    ) -> tuple[_I32, _F64, _F64]:
        """int32[n] the first triangle on each ray (-1: none), float64[n, 3] barycentric
        coordinates, float64[n] distance from the origin."""

class SparseCholesky:
    """The Cholesky factors of a sparse symmetric positive definite matrix."""

    def __init__(
        self, rows: npt.ArrayLike, columns: npt.ArrayLike, values: npt.ArrayLike, size: _Int
    ) -> None: ...
    def solve(self, right: npt.ArrayLike, threads: _Int = 0) -> _F64:
        """float64[n, sides]."""

class RegisterOptions:
    """See risorius.anyhead.registration."""

    def __init__(
        self,
        *,
        mm: _Float,
        trusted: list[int],
        mirrored: list[int],
        symmetry: _Float,
        nodes: _Int,
        noise: _Float,
        threads: _Int,
    ) -> None: ...

def register_surface(
    points: npt.ArrayLike,
    triangles: npt.ArrayLike,
    target_points: npt.ArrayLike,
    target_triangles: npt.ArrayLike,
    pair_vertices: npt.ArrayLike,
    pair_points: npt.ArrayLike,
    pair_weights: npt.ArrayLike,
    start: npt.ArrayLike | None,
    options: RegisterOptions,
    progress: Callable[[float], bool | None] | None,
) -> tuple[_F64, _I32, _F64, _F64, npt.NDArray[np.bool_]]:
    """points, triangle, shares, distance, trusted: see risorius.anyhead.registration."""

def simplify(
    positions: npt.ArrayLike,
    attributes: npt.ArrayLike,
    triangles: npt.ArrayLike,
    count: int,
) -> tuple[_U32, float]:
    """See risorius.author.simplify."""

def unpack_buffer(packed: bytes, count: int, stride: int, mode: str, filter: str) -> bytes:
    """The bytes of a buffer view of glTF's EXT_meshopt_compression, whose words the arguments are."""

def pack_buffer(rows: bytes, count: int, stride: int, mode: str, filter: str) -> bytes:
    """Bytes that unpack_buffer gives back; with a filter, rows of filter_buffer."""

def filter_buffer(values: npt.ArrayLike, stride: int, filter: str, bits: int) -> bytes:
    """Rows of `stride` bytes that the filter of unpack_buffer turns into values[n, k]."""

def regroup(
    dna: Dna,
    *,
    regions: Sequence[Sequence[_Int]],
    translation_mm: float,
    rotation_degrees: float,
    scale: float,
    foreign_share: float,
    combinations: _Int,
    seed: _Int,
    timed: _Int,
) -> tuple[Dna, RegroupReport]:
    """(Dna, RegroupReport): see risorius.rigs.edit.regroup."""

def keep_parts(dna: Dna, *, joints: Sequence[bool], correctives: Sequence[bool]) -> Dna:
    """A copy with only the joints and correctives that are True; all indices refer to the remaining
    items.
    """

class LayerCurves:
    """The curves of a layer, prepared for a list of controls."""

    def __init__(
        self,
        controls: Sequence[str],
        names: Sequence[str],
        values: npt.ArrayLike,
        rate: _Float,
        start: _Float,
        times: npt.ArrayLike | None = None,
        mask: npt.ArrayLike | None = None,
    ) -> None: ...
    @property
    def frame_count(self) -> int: ...
    @property
    def range(self) -> tuple[float, float]:
        """Seconds of the first and of the last frame."""

class MixerCore:
    """The evaluator of risorius.Mixer."""

    def __init__(
        self,
        controls: Sequence[str],
        low: npt.ArrayLike,
        high: npt.ArrayLike,
        max_fired: _Int,
    ) -> None: ...
    def set_layers(self, layers: Sequence[dict[str, Any]]) -> None: ...
    def set_reactions(self, reactions: Sequence[Sequence[tuple[Any, ...]]]) -> None:
        """A list of parts each: controls, weights, delay, attack, hold, release."""
    def set_rules(
        self, yields: Sequence[tuple[Any, ...]], opposites: Sequence[tuple[int, int]]
    ) -> None:
        """Each yields has by, of, measure, amount."""
    def fire(self, reaction: _Int, time: _Float, strength: _Float) -> bool: ...
    def clear_fired(self) -> None: ...
    def evaluate(
        self, time: _Float, base: npt.ArrayLike | None = None, out: _F32 | None = None
    ) -> _F32: ...
    def evaluate_batch(self, times: npt.ArrayLike, base: npt.ArrayLike | None = None) -> _F32: ...
