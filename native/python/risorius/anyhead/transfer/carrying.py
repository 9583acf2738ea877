# SPDX-License-Identifier: MIT
"""Computes the displacements of the template's vertices in each expression on another head.

Vertices that the jaw moves are rotated by the same angle as on the template, about the hinge of the
other head's jaw. The remaining motion is transformed by the deformation gradients between both
heads. Small size differences between the heads change the motions only in part, because the motions
of similar heads are more alike than the heads.
"""

from __future__ import annotations

import numpy as np

from ...author.geometry.rigid import rigid_way
from ...author.geometry.skeleton import Doubles
from ..form.teeth import JawChange
from .closing import BLINKS, closing_shares, closing_shift, lids_that_meet
from .form import changes_of_form, softened
from .template import Pose, TemplateFace, left_over

_REST = 0.05  # cm: vertices that the jaw moves less count as not moved by it
_FLESH = 0.1  # relative size difference up to which soft tissue explains it, not the bone
# Exponents for small size differences between the heads: a stretch near 1 is raised to this power
# before it scales the motion of the skin, or the translation of the jaw.
_OF_SKIN, _OF_JAW = 0.6, 0.75
_OPENS, _CLOSES = ("jawOpen",), ("mouthClose",)  # mouthClose closes the lips of an open jaw
_SPURIOUS = 0.002  # cm: a corrective fades out where the template's corrective is smaller


class Carrying:
    """Computes the displacements of a template's poses for the same vertices on another head."""

    def __init__(
        self,
        face: TemplateFace,
        points: Doubles,
        trust: Doubles,
        teeth: JawChange | None = None,
    ) -> None:
        """Compute the deformation from the template to the other head.

        Args:
            face: the template.
            points: float64[V, 3], positions of its vertices on the other head, cm.
            trust: float64[V], 0 to 1: confidence in each position.
            teeth: the change of the jaw; None or not sure: it is estimated from the skin.
        """
        self._face, self._points = face, points
        form = changes_of_form(face.surface, points, trust)
        self._form = softened(form, _OF_SKIN)
        self._jaw = self._jaw_by_form(form, trust)
        if teeth is not None and teeth.sure:
            self._jaw = JawChange(teeth.before, teeth.after, softened(teeth.linear, _OF_JAW))
        self._closing: dict[str, Doubles] = {}
        self._shifts: dict[str, Doubles] = {}
        for control in BLINKS:
            if (control,) in face.ways:
                self._close(control)

    def _close(self, control: str) -> None:
        """Compute the correction of a blink.

        Args:
            control: name of the blink's control.
        """
        face, points = self._face, self._points
        pairs = lids_that_meet(face.surface, face.ways[(control,)].astype(np.float64))
        if len(pairs[0]):
            way = self.carried((control,))
            self._closing[control] = closing_shares(face, points, control, way, pairs)
            way = self.carried((control,))
            self._shifts[control] = closing_shift(face, points, control, way, pairs)

    def _jaw_by_form(self, form: Doubles, trust: Doubles) -> JawChange | None:
        """The change of the jaw, estimated from the deformation of the skin that jawOpen moves.

        Args:
            form: float64[V, 3, 3], the deformation gradients of the skin.
            trust: float64[V], 0 to 1: confidence in the position of each vertex.
        """
        face = self._face
        if face.jaw is None:
            return None
        opening = face.ways.get(("jawOpen",))
        weight = np.ones(len(trust)) if opening is None else np.linalg.norm(opening, axis=1)
        weight = weight.astype(np.float64) * (trust + 1e-3)
        weight /= weight.sum()
        mean = np.einsum("v,vij->ij", weight, form)
        grown = float(np.log(np.cbrt(max(np.linalg.det(mean), 1e-3))))
        # Small size differences are attributed to soft tissue, so they do not change the jaw.
        size = float(np.exp(grown * grown**2 / (grown**2 + _FLESH**2)))
        middle, other = weight @ face.surface.points, weight @ self._points
        hinge = other + size * (face.jaw.hinge - middle)
        return JawChange(face.jaw.hinge, hinge, size * np.eye(3))

    def ways(self, strength: float = 1.0) -> dict[Pose, Doubles]:
        """float64[V, 3] by pose: displacements by each control, and by each corrective in addition
        to its controls.

        Args:
            strength: factor of all expressions; 1: the strength of the template.
        """
        face = self._face
        whole = {pose: self.carried(pose) for pose in face.ways}
        own, other = left_over(face.ways), left_over(whole)
        out: dict[Pose, Doubles] = {
            pose: strength * way for pose, way in whole.items() if len(pose) == 1
        }
        for pose, way in other.items():
            there = np.linalg.norm(own[pose], axis=1, keepdims=True)
            # A corrective is a product of two controls, so it scales with the squared strength.
            out[pose] = strength**2 * way * (there / (there + _SPURIOUS))
        return out

    def carried(self, pose: Pose) -> Doubles:
        """float64[V, 3]: displacements with all controls of a pose at 1.

        Args:
            pose: a pose of the template.
        """
        way = self._by_form(pose)
        for control in pose:
            way = way * self._closing.get(control, 1.0)
        for control in pose:
            way = way + self._shifts.get(control, 0.0)
        return way

    def _by_form(self, pose: Pose) -> Doubles:
        """float64[V, 3]: displacements in a pose before the lids are closed."""
        ways = self._face.ways
        way = ways[pose].astype(np.float64)
        turns = {} if self._face.jaw is None else self._face.jaw.turns
        if pose == _CLOSES and _OPENS in turns and pose not in turns:
            # The shape mouthClose is the difference between an open jaw with closed lips and
            # jawOpen alone.
            opening = ways[_OPENS].astype(np.float64)
            return self._turned(opening + way, _OPENS) - self._turned(opening, _OPENS)
        # How far the skin follows the jaw is computed without the displacements of controls that do
        # not move the jaw, such as a smile, but with the addition of the corrective.
        beside = [(c,) for c in pose if len(pose) > 1 and (c,) not in turns and (c,) in ways]
        if pose not in turns or not beside:
            return self._turned(way, pose)
        alone = sum(ways[single].astype(np.float64) for single in beside)
        return self._turned(way - alone, pose) + self._turned(np.asarray(alone), beside[0])

    def _turned(self, way: Doubles, pose: Pose) -> Doubles:
        """float64[V, 3]: a displacement on the other head.

        Args:
            way: float64[V, 3], the displacement on the template.
            pose: the pose whose motion of the jaw is in the displacement; the displacement is
                transformed by the deformation gradients alone if the pose does not move the jaw.
        """
        jaw, change = self._face.jaw, self._jaw
        if jaw is None or change is None or pose not in jaw.turns:
            return np.asarray(np.einsum("vij,vj->vi", self._form, way))
        turn, shift = jaw.turns[pose]
        own = rigid_way(self._face.surface.points, jaw.hinge, turn, shift)
        moved = change.linear @ rigid_way(change.before[None], jaw.hinge, turn, shift)[0]
        other = rigid_way(self._points, change.after, turn, moved)
        length = np.einsum("vi,vi->v", own, own) + _REST**2
        share = np.clip(np.einsum("vi,vi->v", way, own) / length, 0, 1)[:, None]
        return np.asarray(np.einsum("vij,vj->vi", self._form, way - share * own) + share * other)
