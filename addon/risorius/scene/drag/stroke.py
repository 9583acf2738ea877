# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs one drag of a face from mouse press to release: solves sliders for a target position.

Each target is solved from the pose at the mouse press, so the result depends on the position of the
pointer and not on its path. A point is a vertex of a face: (index of the mesh in the DNA file,
index of the vertex). File space has the axes and the unit of the DNA file.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ... import native
from ...logic.base.errors import FaceError
from ...logic.base.sentences import told
from ..animation import keying
from ..base import last_written, parts
from ..base.blender_types import ArmatureObject, Context
from ..character import runtime
from ..frame import inputs
from ..live import sessions
from . import kept_points, sliders
from .head_turns import HeadTurns
from .skin import Point, Skin

Float = NDArray[np.float64]

_STILL = 1e-6  # least motion of a point by a control at value 1 / size of the face
_SMALL = 0.02  # least change of a control that is kept / largest change of a control


@dataclass(frozen=True)
class Options:
    """Options of a drag.

    Attributes:
        symmetric: move the mirrored point too.
        method: "near": few sliders that mainly move the dragged area; "least_squares": all sliders;
            or "transpose": all sliders, in proportion to their effect on the points.
        single: move only the best control; with `symmetric` also its partner on the other side.
        choice: with `single`: 0: the best control, 1: the second best, and so on.
        region: use only controls of one region: the region of the control that moves the dragged
            point most.
        others: points that move together with the dragged point.
    """

    symmetric: bool = False
    method: str = "near"
    single: bool = False
    choice: int = 0
    region: bool = False
    others: tuple[Point, ...] = ()


@dataclass
class _Anchors:
    """The points of a drag at the press.

    Attributes:
        points: the dragged point, points that move with it, their mirrored points, then pins.
        mirrored: for each point except pins: whether it is a mirrored point.
        rest: float64[P, 3], positions at the press in file space.
        world: float64[P, 3], positions at the press in world space.
        maps: float64[P, 3, 3], transforms of directions from file space to world space.
    """

    points: list[Point]
    mirrored: list[bool]
    rest: Float
    world: Float
    maps: Float


@dataclass
class Stroke:
    """A running drag. `begin` makes it; `finish` or `restore` ends it.

    A Stroke refers to Blender objects, so it must not outlive the operator that creates it.

    Attributes:
        rig, live: the character and its Runtime.
        point: dragged (mesh, vertex).
        options: options; they may change during the drag.
        skin: the meshes in the scene.
        state: sliders at the mouse press.
        turns: transforms from file space to world space.
        reach: float32[3, R], motion of the point in file units if a control grows by 1.
        raw: float32[R], current raw controls of the face.
        best: single controls for this drag, best first: (index, value, remaining distance).
    """

    rig: ArmatureObject
    live: runtime.Runtime
    point: Point
    options: Options
    skin: Skin
    state: sliders.Sliders
    turns: HeadTurns
    reach: NDArray[np.float32]
    raw: NDArray[np.float32]
    best: list[tuple[int, float, float]] = field(default_factory=list)
    _anchors: dict[bool, _Anchors] = field(default_factory=dict)
    _was: NDArray[np.float32] | None = None  # [V, 3], dragged mesh at press, file space
    _eases: dict[tuple[Point, ...], Float] = field(default_factory=dict)
    # float64[3]: evaluated position of the dragged point minus the position that the solver
    # predicts, in world space.
    _apart: Float = field(default_factory=lambda: np.zeros(3))

    @property
    def start(self) -> Float:
        """float64[3]: position of the dragged point at the mouse press, in world space."""
        return self._of().world[0]

    @property
    def dragged_region(self) -> str:
        """The region of the control that moves the dragged point most.

        Only controls that the drag may move are compared.
        """
        strongest = int(np.argmax(np.linalg.norm(self.reach, axis=0) * self.state.free))
        return native.regions().of_slider(self.live.labels[strongest])

    def to(self, context: Context, target: Float, view: Float | None = None) -> Float:
        """Move the dragged point to a target as near as possible, and show the face.

        Args:
            context: its view layer is evaluated.
            target: float64[3], wanted position of the point in world space.
            view: float64[3], a direction along which the position is free; None: no free direction.

        Returns:
            float64[3]: the reached position of the point in world space.

        Raises:
            FaceError: the face is a library override that Blender does not allow to change; the
                sliders are then restored.
        """
        self.raw, predicted = self._solve(target - self._apart, view, self._free(target, view))
        sliders.write(self.rig, self.live, self.state, self.raw)
        at = self._seen(context)
        self._apart = np.clip(at - predicted, -self.skin.size, self.skin.size)
        return at

    def finish(self, context: Context, target: Float, view: Float | None = None) -> list[str]:
        """Move the point to its target, and insert keys if auto-key or a tweak is on.

        Controls that changed very little during the drag are reset to their values before the drag.

        Args:
            context: has the settings for keys.
            target: float64[3], wanted position in world space.
            view: float64[3], a direction along which the position is free; None: no free direction.

        Returns:
            The names of the moved sliders.

        Raises:
            FaceError: as by `to`, or an active tweak does not include the current frame. The
                controls then have their values from before the drag.
        """
        self.to(context, target, view)
        change = np.abs(self.raw - self.state.seen)
        held = self._free(target, view) & (change >= _SMALL * change.max(initial=0.0))
        for _ in range(4):  # repeat, because bones of the head may move with the controls
            self.raw, predicted = self._solve(target - self._apart, view, held)
            sliders.write(self.rig, self.live, self.state, self.raw)
            at = self._seen(context)
            was, self._apart = self._apart, at - predicted
            if np.linalg.norm(self._apart - was) < 1e-5 * self.skin.size:
                break
        sliders.restore(self.rig, self.state)
        moved: list[str] = []

        def move() -> Collection[str]:
            moved.extend(sliders.write(self.rig, self.live, self.state, self.raw))
            return moved

        keying.by_hand(context, self.rig, move)
        self.skin.show(context)
        return moved

    def restore(self, context: Context) -> None:
        """Restore the slider values of the mouse press.

        Args:
            context: its view layer is evaluated with the restored sliders.
        """
        sliders.restore(self.rig, self.state)
        self.raw = self.state.seen
        self.skin.show(context)

    def moved(self, count: int = 3) -> list[tuple[str, float]]:
        """(name, change since the press) of the `count` controls that changed most.

        Controls that changed by 0.001 or less are left out.
        """
        change = (self.raw - self.state.seen).astype(np.float64)
        order = np.argsort(-np.abs(change), kind="stable")[:count]
        return [(self.live.labels[i], float(change[i])) for i in order if abs(change[i]) > 1e-3]

    def heat(self) -> tuple[Float, Float]:
        """Data for a heat map of the dragged mesh.

        Returns:
            float64[V, 3], the vertices in world space; float64[V], distance of each vertex from its
            position at the mouse press, in Blender units.
        """
        mesh = self.point[0]
        if self._was is None:
            self._was = self.skin.surface.positions(self.state.seen, mesh)
        now = self.skin.surface.positions(self.raw, mesh)
        far = np.linalg.norm(now.astype(np.float64) - self._was, axis=1) * self.live.space.scale
        seen = self.skin.seen(mesh)
        return (self.turns.positions(mesh, now) if seen is None else seen), far

    def _free(self, target: Float, view: Float | None) -> NDArray[np.bool_]:
        free = self.state.free.copy()
        for _, follower in self.state.linked:
            free[follower] = True
        if self.options.region:
            free &= sliders.of_region(self.live, self.dragged_region)
        if self._is_symmetric:
            # A symmetric pose cannot use opposite controls that are partners, such as jaw left and
            # right.
            pairs = [p for p in self._opposites if self._partners[p[0]] == p[1]]
            free[[control for pair in pairs for control in pair]] = False
        if not self.options.single:
            self.best = []
            return free
        anchors = self._of()
        goal, axes = self._goal(anchors, target - self._apart, view)
        self.best = native.module().best_controls(
            self.skin.surface, self.state.seen, self.point, goal[0], axes=axes[0],
            limits=self._limits(free),
        )  # fmt: skip
        only = np.zeros(len(free), bool)
        if self.best:
            chosen = self.best[self.options.choice % len(self.best)][0]
            only[chosen] = True
            if self.options.symmetric:
                only[self._partners[chosen]] = True
        return only & free

    def _solve(
        self, target: Float, view: Float | None, free: NDArray[np.bool_]
    ) -> tuple[NDArray[np.float32], Float]:
        """Solve the raw controls for a target of the dragged point.

        Args:
            target: float64[3], wanted position of the point in world space.
            view: float64[3], a direction along which the position is free; None: no free direction.
            free: bool[R], raw controls that may change.

        Returns:
            float32[R], the solved raw controls; float64[3], the position of the point that the
            solver predicts, in world space.
        """
        anchors = self._of()
        goal, axes = self._goal(anchors, target, view)
        near = self.options.method == "near"
        method = "sparse" if near else self.options.method
        sharing = native.module().ControlSharing(
            ease=self._ease() if near else None,
            partners=self._partners if self._is_symmetric else None,
            opposites=self._opposites,
        )
        solved = native.module().solve_drag(
            self.skin.surface, self.state.seen, anchors.points, goal, axes=axes,
            limits=self._limits(free), sharing=sharing, method=method,
        )  # fmt: skip
        moved = solved.positions[0].astype(np.float64) - anchors.rest[0]
        return solved.raw, anchors.world[0] + anchors.maps[0] @ moved

    def _limits(self, free: NDArray[np.bool_]) -> native.ControlLimits:
        return native.module().ControlLimits(free, self.state.low, self.state.high)

    def _goal(self, anchors: _Anchors, target: Float, view: Float | None) -> tuple[Float, Float]:
        """Targets float64[P, 3] of the points in file space, and axes float64[P, 3, 3].

        The solver measures the error of a point along its three axes; the length of an axis is the
        weight of the error along this axis.

        Args:
            anchors: the points of the drag.
            target: float64[3], wanted position of the dragged point in world space.
            view: float64[3], a direction along which the position is free; None: no free direction.
        """
        goal, axes = anchors.rest.copy(), np.tile(np.eye(3), (len(anchors.points), 1, 1))
        shift = np.linalg.solve(anchors.maps[0], target - anchors.world[0])
        along = np.eye(3)
        if view is not None:
            # The solver measures errors along two axes in the screen plane. The third axis has
            # length 0, so that the depth is free.
            rows = _across(view) @ anchors.maps[0]
            along[:2] = rows / np.linalg.norm(rows, axis=1, keepdims=True)
            along[2] = 0.0
        flip = _flip(self.live)
        for number, mirrored in enumerate(anchors.mirrored):
            goal[number] += flip @ shift if mirrored else shift
            axes[number] = along @ flip if mirrored else along
        return goal, axes

    @property
    def _is_symmetric(self) -> bool:
        return self.options.symmetric or bool(self.state.linked)

    @cached_property
    def _partners(self) -> NDArray[np.int64]:
        return sliders.mirrored_indices(self.live)

    @cached_property
    def _opposites(self) -> list[tuple[int, int]]:
        index = {name: i for i, name in enumerate(self.live.dna.raw_control_names)}
        known = native.part("anim.reactions").load_exclusives()
        return list(known.rules_of(index)[1])

    def _ease(self) -> Float:
        """float64[R]: weights of the controls, up to 1, larger for controls that move mainly the
        dragged points."""
        surface, key = self.skin.surface, self.options.others
        if key not in self._eases:
            low, high = self.state.low, self.state.high
            reach = [self.reach]
            for mesh, vertex in self.options.others:
                if mesh in surface.mesh_indices:
                    reach += [*surface.jacobian(self.state.seen, mesh, [vertex], low, high)]
            self._eases[key] = native.module().local_ease(surface, np.stack(reach))
        return self._eases[key]

    def _of(self) -> _Anchors:
        symmetric = self._is_symmetric
        if symmetric not in self._anchors:
            self._anchors[symmetric] = self._make_anchors(symmetric)
        return self._anchors[symmetric]

    def _make_anchors(self, symmetric: bool) -> _Anchors:
        shown = set(self.skin.surface.mesh_indices)
        others = [p for p in self.options.others if p != self.point and p[0] in shown]
        points = [self.point, *others]
        mirrored = [False] * len(points)
        for point in (self.point, *others) if symmetric else ():
            other = self.skin.mirrored(point)  # the point itself if it is on the middle line
            if other is not None and (other == point or other not in points):
                points.append(other)
                mirrored.append(True)
        held = kept_points.of(self.rig, kept_points.PINS, self.skin.surface.vertex_counts)
        points += [p for p in held if p not in points and p[0] in shown]
        maps = np.stack([self.turns.at(m, np.array([v], np.int64))[0] for m, v in points])
        raw = self.state.seen
        rest = np.stack([self.skin.surface.positions(raw, m, [v])[0] for m, v in points])
        world = np.einsum("pij,pj->pi", maps[:, :3, :3], rest) + maps[:, :3, 3]
        if not self._anchors and self.skin.pressed is not None:
            world[0] = self.skin.pressed
        elif self._anchors:
            world[0] = next(iter(self._anchors.values())).world[0]
        return _Anchors(points, mirrored, rest.astype(np.float64), world, maps[:, :3, :3])

    def _seen(self, context: Context) -> Float:
        """Evaluate the face.

        Returns:
            float64[3], the position of the dragged point in world space.

        Raises:
            FaceError: the face is a library override that Blender does not allow to change.
        """
        self.skin.show(context)
        if last_written.is_refused(self.rig):
            self.restore(context)
            raise FaceError(_REFUSED)
        at = self.skin.seen_at(self.point)
        if at is None:
            mesh, vertex = self.point
            rest = self.skin.surface.positions(self.raw, mesh, [vertex])[0]
            matrix = self.turns.at(mesh, np.array([vertex], np.int64))[0]
            at = matrix[:3, :3] @ rest + matrix[:3, 3]
        return at


_REFUSED = told("This library override cannot be edited: make it fully editable first.")


def begin(context: Context, rig: ArmatureObject, point: Point, options: Options) -> Stroke:
    """Begin to drag a point of a face.

    Args:
        context: has the visible scene.
        rig: the character.
        point: (mesh, vertex) in the DNA.
        options: options of the drag.

    Raises:
        FaceError: the face cannot be dragged now, or nothing moves the point.
    """
    live = _usable(context, rig)
    depsgraph = context.evaluated_depsgraph_get()
    skin = Skin.of(context, rig, live)
    mesh, vertex = point
    if mesh not in skin.surface.mesh_indices:
        raise FaceError(told("Mesh {mesh} is not shown at this level of detail.", mesh=mesh))
    if not 0 <= vertex < skin.surface.vertex_counts[mesh]:
        found, count = vertex, skin.surface.vertex_counts[mesh]
        raise FaceError(
            told(
                "A vertex number below {count} was expected, found {found}.",
                count=count,
                found=found,
            )
        )
    state = sliders.read(rig, live, depsgraph)
    reach = skin.surface.jacobian(state.seen, mesh, [vertex], lowest=state.low, highest=state.high)
    strongest = np.linalg.norm(reach[0], axis=0)
    if not (strongest[state.free] * live.space.scale > _STILL * skin.size).any():
        led = (strongest * live.space.scale > _STILL * skin.size).any()
        raise FaceError(_LED if led else _NOTHING)
    controls = parts.controls_there(rig).evaluated_get(depsgraph)
    maximum = parts.maximum_of(parts.controls_there(rig))
    turns = HeadTurns(
        rig, live, inputs.read_inputs(controls, live, depsgraph, maximum)[1], depsgraph
    )
    skin.pressed = skin.seen_at(point)
    return Stroke(rig, live, point, options, skin, state, turns, reach[0], state.seen)


_NOTHING = told("No control of this face moves this point.")
_LED = told(
    "All sliders that move this point are led by drivers or layers: dragging has no effect here."
)


def _usable(context: Context, rig: ArmatureObject) -> runtime.Runtime:
    """The Runtime of a face. Raises FaceError, with the reason, if it cannot be dragged now."""
    name = rig.name.removesuffix("_rig")
    if rig.library is not None:
        raise FaceError(told("{name} is linked: make a library override of it first.", name=name))
    if parts.BAKED in rig:
        raise FaceError(told("This face is baked: choose Back to Live first."))
    if parts.controls_of(rig) is None or runtime.of(rig) is None:
        raise FaceError(told("This face has lost its controls or its DNA."))
    if context.screen is not None and context.screen.is_animation_playing:
        raise FaceError(
            told("Stop playback first: you can drag a face only while the frame stays the same.")
        )
    if sessions.of(parts.controls_of(rig)) is not None:
        raise FaceError(told("Stop live capture first: it moves this face."))
    depsgraph = context.evaluated_depsgraph_get()
    if not parts.controls_there(rig).evaluated_get(depsgraph).is_evaluated:
        raise FaceError(told("{name} is hidden: show it first.", name=name))
    if not rig.evaluated_get(depsgraph).is_evaluated:
        raise FaceError(told("{name} is hidden: show it first.", name=name))
    return runtime.there(rig)


def _across(view: Float) -> Float:
    """float64[2, 3]: two unit vectors at right angles to a direction and to each other."""
    along = view / np.linalg.norm(view)
    least = np.eye(3)[int(np.argmin(np.abs(along)))]
    one = np.cross(along, least)
    one /= np.linalg.norm(one)
    return np.stack([one, np.cross(along, one)])


def _flip(live: runtime.Runtime) -> Float:
    """float64[3, 3]: the reflection that exchanges left and right, in the file's axes."""
    return live.space.axes.T @ np.diag([-1.0, 1.0, 1.0]) @ live.space.axes
