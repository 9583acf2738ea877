# SPDX-License-Identifier: MIT
"""Two rigs, with common numbers for their matched elements, and the report."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
import numpy.typing as npt

import risorius

from . import amounts
from .amounts import Floats
from .names import correctives, joint_pairs, padded
from .pairs import Bools, Ints, integers, pair_in_place, pair_names, pair_sets
from .report import Report
from .spaces import Space, chain

ATTRIBUTES = ("tx", "ty", "tz", "rx", "ry", "rz", "sx", "sy", "sz")
QUATERNION_ATTRIBUTES = ("tx", "ty", "tz", "qx", "qy", "qz", "qw", "sx", "sy", "sz")


class Comparison:
    """The rigs A and B with common numbers for their matched elements; the modules of the layers
    compare them.

    Attributes:
        a: the rig A.
        b: the rig B.
        report: receives the differences.
        exact: True: compare bit for bit; False after a conversion, which rounds.
        meshes_a: the meshes of A, read once.
        meshes_b: the meshes of B, read once.
    """

    def __init__(self, a: risorius.Dna, b: risorius.Dna, report: Report, exact: bool = True):
        self.a, self.b, self.report, self.exact = a, b, report, exact
        self.meshes_a, self.meshes_b = a.meshes, b.meshes

    # ---- amounts of changes

    def changed(self, a: Floats, b: Floats) -> Bools:
        """bool[...]: whether float32 arrays a and b of one shape differ.

        In an exact comparison numbers differ if any bit differs, otherwise if they differ by more
        than rounding.
        """
        different = amounts.differs(a, b)
        return different if self.exact else different & ~amounts.near(a, b)

    def by(self, a: Floats, b: Floats, kind: str = "number") -> str:
        """The amount of a change as text, e.g. "by up to 0.3 mm".

        Args:
            a, b: float32[...] of one shape.
            kind: "length" or "angle" in the units of A, or "number".
        """
        amount = amounts.largest(a, b)
        return amounts.by(amount, self.measure(amount, kind), a.size > 1)

    def distance(self, a: Floats, b: Floats) -> str:
        """The largest distance between a point of A and the same point of B, as text.

        Args:
            a, b: float32[n, 3], positions in the translation unit of A.

        Returns:
            The distance with its unit, e.g. "by up to 0.3 mm".
        """
        with np.errstate(invalid="ignore", over="ignore"):
            apart = np.linalg.norm(a.astype(np.float64) - b, axis=1)
        apart = float(np.max(np.where(np.isnan(apart), np.inf, apart), initial=0.0))
        return amounts.by(apart, self.measure(apart, "length"), len(a) > 1)

    def measure(self, amount: float, kind: str) -> str:
        """An amount as text with its unit.

        Args:
            amount: the amount in the units of A.
            kind: "length", "angle" or "number".
        """
        if kind == "length":
            return amounts.length(amount, self.a.translation_unit)
        if kind == "angle":
            return amounts.angle(amount, self.a.rotation_unit)
        return f"{amount:.3g}"

    # ---- common numbers of elements

    def _named(self, noun: str, a: Sequence[str], b: Sequence[str]) -> Space:
        return Space(noun, a, b, pair_in_place(pair_names(a, b), len(a), len(b)))

    @cached_property
    def gui(self) -> Space:
        return self._named("GUI control", self.a.gui_control_names, self.b.gui_control_names)

    @cached_property
    def raw(self) -> Space:
        return self._named("raw control", self.a.raw_control_names, self.b.raw_control_names)

    @cached_property
    def channels(self) -> Space:
        a, b = self.a.blend_shape_channel_names, self.b.blend_shape_channel_names
        return self._named("channel", a, b)

    @cached_property
    def maps(self) -> Space:
        return self._named("animated map", self.a.animated_map_names, self.b.animated_map_names)

    @cached_property
    def meshes(self) -> Space:
        a = padded(self.a.mesh_names, len(self.meshes_a))
        return self._named("mesh", a, padded(self.b.mesh_names, len(self.meshes_b)))

    @cached_property
    def joints(self) -> Space:
        pairs = joint_pairs(self.a, self.b)
        return Space("joint", self.a.joint_names, self.b.joint_names, pairs)

    @cached_property
    def ml(self) -> Space:
        a, b = self.a.machine_learned_behavior, self.b.machine_learned_behavior
        return self._named("network control", a.ml_control_names, b.ml_control_names)

    @cached_property
    def pose_controls(self) -> Space:
        # A file of version 2.4 lacks the layer rbfe. In it each RBF pose sets one control, which
        # has the pose's name.
        names = [
            dna.rbf_behavior_ext.pose_control_names or [p.name for p in dna.rbf_behavior.poses]
            for dna in (self.a, self.b)
        ]
        return self._named("pose control", *names)

    @cached_property
    def poses(self) -> Space:
        names = [
            padded([pose.name for pose in dna.rbf_behavior.poses], len(dna.rbf_behavior_ext.poses))
            for dna in (self.a, self.b)
        ]
        return self._named("pose", *names)

    @cached_property
    def solvers(self) -> Space:
        names = [[s.name for s in dna.rbf_behavior.solvers] for dna in (self.a, self.b)]
        return self._named("solver", *names)

    @cached_property
    def psds(self) -> Space:
        """The correctives of both rigs, matched by their factors."""
        names_a, names_b = (
            correctives(dna, which, self.raw, self.ml, self.pose_controls)
            for dna, which in ((self.a, "a"), (self.b, "b"))
        )
        return self._named("corrective", names_a, names_b)

    @cached_property
    def controls(self) -> Space:
        return chain("control", [self.raw, self.psds, self.ml, self.pose_controls])

    @cached_property
    def networks(self) -> Space:
        """The networks of both rigs, matched by the controls that they write."""
        a = self.a.machine_learned_behavior.neural_networks
        b = self.b.machine_learned_behavior.neural_networks
        pairs = pair_sets(
            [self.controls.in_a(network.output_indices) for network in a],
            [self.controls.in_b(network.output_indices) for network in b],
        )
        return Space("network", [""] * len(a), [""] * len(b), pairs)

    def rows_in_a(self, outputs: npt.ArrayLike, stride: int = 9) -> Ints:
        """Common numbers of attributes of A's joints: common number of the joint * stride +
        attribute.

        Args:
            outputs: int[n], joint index * stride + attribute, as stored in the joint groups of A.
            stride: attributes per joint; 9 with Euler angles, 10 with quaternions.
        """
        joint, attribute = np.divmod(integers(outputs), stride)
        return self.joints.in_a(joint) * stride + attribute

    def rows_in_b(self, outputs: npt.ArrayLike, stride: int = 9) -> Ints:
        """Common numbers of attributes of B's joints: common number of the joint * stride +
        attribute.

        Args:
            outputs: int[n], joint index * stride + attribute, as stored in the joint groups of B.
            stride: attributes per joint; 9 with Euler angles, 10 with quaternions.
        """
        joint, attribute = np.divmod(integers(outputs), stride)
        return self.joints.in_b(joint) * stride + attribute

    def row_labels(self, numbers: Ints, stride: int = 9) -> list[str]:
        """Attributes of joints as text, e.g. "FACIAL_C_Jaw.tx".

        Args:
            numbers: int64[n], from `rows_in_a` or `rows_in_b`.
            stride: attributes per joint that these numbers were made with, 9 or 10.
        """
        names = ATTRIBUTES if stride == 9 else QUATERNION_ATTRIBUTES
        joint, attribute = np.divmod(numbers, stride)
        return [
            f"{name}.{names[i]}"
            for name, i in zip(self.joints.labels(joint), attribute.tolist(), strict=True)
        ]
