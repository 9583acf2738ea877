# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the inputs of a face (sliders, rotations, other animation) at the frames of a range.

Blender evaluates actions, NLA, drivers and constraints in a separate scene. The scene has only the
two armatures of the face, the meshes whose shape keys the user animates, and the objects on which
these depend, such as the armature of the body. The result
of every frame equals frame stepping in the user's scene. Other objects of the user's scene are not
evaluated, and its current frame does not change. A few features need the user's
scene itself (`_needs_whole_scene`); its frame is restored afterwards.
"""

from __future__ import annotations

from collections.abc import Generator, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, cast

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from ..animation import layer_mixing, layers
from ..base import compat, drivers, parts
from ..base.blender_types import ArmatureObject, Context, Depsgraph, MeshObject
from ..character import rig_placement, runtime
from ..frame import evaluate, inputs, joint_readings
from ..skinning import bone_writer

_CHANNELS = {"location": 3, "rotation_quaternion": 4, "rotation_euler": 3, "scale": 3}
_BONES = ("neck", "head", "eyes", "eye_L", "eye_R")


@dataclass
class Samples:
    """The inputs of one face.

    Attributes:
        frames: float64[N], frames of the scene.
        times: float64[N], frames at which Blender reads actions; they differ from `frames` if the
            scene uses Time Stretching.
        raw: float32[N, R], the raw controls for the rig, with layers.
        sliders: float32[N, R], like raw, but before the eye bones add to the look controls.
        turns: for each frame, "neck" and "head" -> Quaternion in the axes of the control armature,
            including the rotation of a body; unrotated bones are left out.
        basis: control bone -> float64[N, 4, 4], matrices relative to its rest pose, after
            constraints and layers.
        places: float64[N, 4, 4], world matrices of the control armature.
        bones: property such as "location" -> float32[N, bones, width], values of the deforming
            armature's bones from the user's own animation; None if there is no such animation.
        others: datablock -> {data path: components at each frame} of other animated properties.
    """

    frames: NDArray[np.float64]
    times: NDArray[np.float64]
    raw: NDArray[np.float32]
    sliders: NDArray[np.float32]
    places: NDArray[np.float64]
    basis: dict[str, NDArray[np.float64]]
    turns: list[inputs.Turns] = field(default_factory=list)
    bones: dict[str, NDArray[np.float32]] | None = None
    others: dict[bpy.types.ID, dict[str, list[list[float]]]] = field(default_factory=dict)


def sample(
    context: Context,
    rigs: Sequence[ArmatureObject],
    frames: NDArray[np.float64],
    keys: Sequence[tuple[MeshObject, list[str]]] = (),
) -> Generator[float, None, list[Samples]]:
    """Read the inputs of faces over a range; a generator that yields progress and can be cancelled.

    Args:
        context: its scene gives the frame rate; the scene itself is stepped only if necessary.
        rigs: deforming armatures.
        frames: float64[N], frames of the scene.
        keys: (mesh object, data paths) of shape keys with animation by the user.

    Yields:
        The progress, 0 to 1.

    Returns:
        The Samples of each rig, in order.
    """
    readers = [
        _Reader(rig, frames, [k for k in keys if k[0].get(parts.RIG) == rig]) for rig in rigs
    ]
    for reader in readers:
        reader.samples.times = _times(context.scene, frames)
    items = [o for r in readers for o in r.objects]
    with _stage(context, rigs, items) as scene:
        depsgraph: Any = None
        for number, frame in enumerate(frames):
            whole = int(np.floor(frame))
            with evaluate.paused():
                scene.frame_set(whole, subframe=float(frame) - whole)
            depsgraph = scene.view_layers[0].depsgraph if scene != context.scene else None
            depsgraph = depsgraph or context.evaluated_depsgraph_get()
            for reader in readers:
                reader.read(number, depsgraph)
            yield (number + 1) / len(frames)
    return [reader.samples for reader in readers]


def _times(scene: bpy.types.Scene, frames: NDArray[np.float64]) -> NDArray[np.float64]:
    """float64[N]: the frames at which Blender reads actions under Time Stretching, rounded to
    float32 as Blender rounds them."""
    length = np.float32(scene.render.frame_map_old / scene.render.frame_map_new)
    return (frames.astype(np.float32) * length).astype(np.float64)


@contextmanager
def _stage(
    context: Context, rigs: Sequence[ArmatureObject], items: Iterable[bpy.types.Object]
) -> Iterator[bpy.types.Scene]:
    """Context manager: the scene in which frames are evaluated.

    This is a new scene with the given objects, or the user's scene if necessary.

    Args:
        context: its scene is the user's scene.
        rigs: deforming armatures of the sampled faces.
        items: objects for the new scene.
    """
    if _needs_whole_scene(context.scene, rigs):
        with _whole_scene(context.scene) as scene:
            yield scene
        return
    own, user = bpy.data.scenes.new("Risorius"), context.scene
    own.render.fps, own.render.fps_base = user.render.fps, user.render.fps_base
    own.render.frame_map_old = user.render.frame_map_old
    own.render.frame_map_new = user.render.frame_map_new
    own.frame_start, own.frame_end = user.frame_start, user.frame_end
    try:
        for item in dict.fromkeys(items):
            own.collection.objects.link(item)
        yield own
    finally:
        if _is_there(own):
            bpy.data.scenes.remove(own)


@contextmanager
def _whole_scene(scene: bpy.types.Scene) -> Iterator[bpy.types.Scene]:
    before = scene.frame_current, scene.frame_subframe
    try:
        yield scene
    finally:
        if _is_there(scene):
            scene.frame_set(before[0], subframe=before[1])


def _is_there(scene: bpy.types.Scene) -> bool:
    """Whether a scene is still in the open .blend; the user may have opened another .blend."""
    try:
        return scene in bpy.data.scenes[:]
    except ReferenceError:
        return False


def _needs_whole_scene(scene: bpy.types.Scene, rigs: Iterable[ArmatureObject]) -> bool:
    """Whether the user's scene must be stepped, because a separate scene would lack something.

    It would lack rigid bodies, context properties that drivers read, and the visible objects
    because of which Blender evaluates a hidden armature.
    """
    if scene.rigidbody_world is not None:
        return True
    for rig in rigs:
        controls = parts.controls_there(rig)
        hold = rig_placement.body_of(controls)
        for item in (rig, controls, hold.target if hold else None):
            if item is not None and item.hide_viewport:
                return True
            data = item.animation_data if item else None
            for curve in data.drivers if data else ():
                if curve.driver and any(v.type == "CONTEXT_PROP" for v in curve.driver.variables):
                    return True
    return False


class _Reader:
    """Reads one face at each frame."""

    def __init__(
        self,
        rig: ArmatureObject,
        frames: NDArray[np.float64],
        keys: Sequence[tuple[MeshObject, list[str]]],
    ) -> None:
        self.rig, self.controls, self.live = rig, parts.controls_there(rig), runtime.there(rig)
        count, width = len(frames), len(self.live.labels)
        bones = [n for n in _BONES if n in self.controls.pose.bones]
        self.samples = Samples(
            frames=frames,
            times=frames,
            raw=np.empty((count, width), np.float32),
            sliders=np.empty((count, width), np.float32),
            basis={n: np.empty((count, 4, 4)) for n in bones},
            places=np.empty((count, 4, 4)),
        )
        self.layered = layers.has_any(self.controls)
        self.maximum = parts.maximum_of(self.controls)
        self.objects = [self.controls, rig, *(item for item, _paths in keys)]
        hold = rig_placement.body_of(self.controls)
        if hold is not None:
            # If the body's armature were not in the scene, Blender would not evaluate bones of the
            # body on which no visible object depends.
            self.objects.append(hold.target)
        if drivers.moves(rig):
            size = len(rig.pose.bones)
            self.samples.bones = {
                n: np.empty((count, size, w), np.float32) for n, w in _CHANNELS.items()
            }
        own = {parts.property_path(label) for label in self.live.labels}
        self.paths = {
            self.controls: [p for p in animated_paths(self.controls) if p not in own],
            rig: [p for p in animated_paths(rig) if p != f'["{parts.PULL}"]'],
            **{item.data.shape_keys: paths for item, paths in keys},
        }
        self.samples.others = {owner: {} for owner in self.paths}

    def read(self, number: int, depsgraph: Depsgraph) -> None:
        got, seen = self.samples, self.controls.evaluated_get(depsgraph)
        raw, own = inputs.read_mixed(seen, self.live, depsgraph, self.maximum)
        got.sliders[number] = raw
        with self._turned(depsgraph, raw, own):
            seen = self.controls.evaluated_get(depsgraph)
            got.raw[number], turns = inputs.complete(
                seen, self.live, depsgraph, self.maximum, raw, own
            )
        got.turns.append(turns)
        got.places[number] = seen.matrix_world
        self._read_control_bones(number, seen, own)
        if got.bones is not None:
            moved = self.rig.evaluated_get(depsgraph).pose.bones
            for name, values in got.bones.items():
                moved.foreach_get(name, values[number].ravel())
        for owner, paths in self.paths.items():
            evaluated = owner.evaluated_get(depsgraph) if paths else owner
            for path in paths:
                value = _value(evaluated, path)
                if value is not None:
                    got.others[owner].setdefault(path, []).append(value)

    @contextmanager
    def _turned(
        self,
        depsgraph: Depsgraph,
        raw: NDArray[np.float32],
        own: layer_mixing.Bones,
    ) -> Iterator[None]:
        """Context manager: pose the rig at this frame, so that constraints that read its joints see
        the pose. The earlier pose is restored at the end.

        Args:
            depsgraph: dependency graph at this frame; it is evaluated again with the posed rig.
            raw: float32[R], the raw controls with layers, before the eye bones add to them.
            own: rotations and gaze target of the control bones, with layers.
        """
        if not joint_readings.of(self.rig, self.live).places:
            yield
            return
        seen = self.controls.evaluated_get(depsgraph)
        first, turns = inputs.complete(seen, self.live, depsgraph, self.maximum, raw.copy(), own)
        bones = self.rig.pose.bones
        before = {n: np.empty(len(bones) * w, np.float32) for n, w in _CHANNELS.items()}
        for name, flat in before.items():
            bones.foreach_get(name, flat)
        keyed = joint_readings.of(self.rig, self.live).keyed
        joints = self.live.rig.evaluate(first).joints
        try:
            bone_writer.write(self.rig, self.live, joints, turns, depsgraph, keyed)
            self.rig.update_tag(refresh={"OBJECT"})
            with evaluate.paused():
                cast("bpy.types.ViewLayer", depsgraph.view_layer).update()
            yield
        finally:
            for name, flat in before.items():
                bones.foreach_set(name, flat)
            self.rig.update_tag(refresh={"OBJECT"})

    def _read_control_bones(
        self, number: int, seen: ArmatureObject, own: layer_mixing.Bones
    ) -> None:
        """Store the matrices of the control bones, relative to their rest pose, for one frame.

        Args:
            number: index of the frame.
            seen: the evaluated control armature.
            own: rotations and gaze target after the layers are mixed.
        """
        basis = self.samples.basis
        for name, matrices in basis.items():
            bone = seen.pose.bones[name]
            matrices[number] = (
                seen.convert_space(
                    pose_bone=bone, matrix=bone.matrix, from_space="POSE", to_space="LOCAL"
                )
                if bone.constraints
                else bone.matrix_basis
            )
        for name in basis if self.layered else ():
            matrix = Matrix(basis[name][number].tolist())
            place, turn, scale = matrix.decompose()
            if name in own.turns:
                rest = self.controls.data.bones[name].matrix_local.to_quaternion()
                turn = rest.inverted() @ own.turns[name] @ rest
            elif name == "eyes" and own.target is not None:
                place = own.target
            else:
                continue
            basis[name][number] = Matrix.LocRotScale(place, turn, scale)


def _value(owner: bpy.types.ID, path: str) -> list[float] | None:
    """The numbers at a data path; None if the path is invalid or its value is not numeric."""
    try:
        value = owner.path_resolve(path)
    except ValueError:
        return None
    if isinstance(value, (bool, int, float)):
        return [float(value)]
    try:
        return [float(v) for v in value]
    except (TypeError, ValueError):
        return None


def animated_paths(owner: bpy.types.Object | bpy.types.Key, drivers: bool = True) -> list[str]:
    """The data paths of a datablock that an action, an NLA strip or a driver animates.

    Args:
        owner: the object or the shape keys.
        drivers: True: include driven paths.
    """
    data = owner.animation_data
    if data is None:
        return []
    curves = [c for action in compat.played_actions(owner) for c in compat.curves_of(action)]
    curves += list(data.drivers) if drivers else []
    return list(dict.fromkeys(c.data_path for c in curves))
