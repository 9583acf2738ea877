# SPDX-License-Identifier: MIT
"""A head of any unit and direction, turned until it stands and is as large as heads are in cm."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ...author.geometry.skeleton import Doubles
from ..form.fitting import Pose
from ..surface import Surface
from .find import Found, Hints, find_form
from .marks import Landmarks

_UNITS = (1.0, 0.1, 100.0, 10.0, 0.01, 1e3, 0.001, 2.54, 30.48)  # cm, the likelier first
_SIZES = (0.62, 1.5)  # of the model's head that a head may have
_SNAP = 20.0  # degrees: a head turned less stands as its file says


@dataclass(frozen=True)
class Stood:
    """A head that stands: y up, the face to +z, the character's left at +x, about in cm.

    Attributes:
        surface: of the head.
        found: its landmarks and the model's form, in this surface's space.
        rotation: float64[3, 3]; standing = scale * rotation @ point of the file.
        scale: cm in a unit of the file.
        notes: a sentence for each thing that was turned.
    """

    surface: Surface
    found: Found
    rotation: Doubles
    scale: float
    notes: list[str] = field(default_factory=list)

    def here(self, points: Doubles) -> Doubles:
        """float64[n, 3] of the file's space -> standing."""
        return np.asarray(self.scale * points @ self.rotation.T)

    def there(self, points: Doubles) -> Doubles:
        """float64[n, 3], standing -> of the file's space."""
        return np.asarray(points @ self.rotation / self.scale)


def stand(surface: Surface, hints: Hints | None = None) -> Stood:
    """A head turned until it stands, from any direction and unit; inside out is turned as well.

    Args:
        surface: the head; it stays as it is.
        hints: what is known of it, in its own space.

    Raises:
        LandmarkError: there is no face in it, or one that cannot be used; says which.
    """
    hints = hints or Hints()
    notes: list[str] = []
    if inside_out(surface):
        surface = Surface(surface.points, surface.triangles[:, ::-1])
        notes.append(f"{hints.where}: the faces look inwards: they were turned")
    found = find_form(surface, hints)
    rotation = upright(found.pose.rotation)
    scale = unit_of(found.pose.scale)
    if not np.allclose(rotation, np.eye(3)):
        notes.append(f"{hints.where}: it was turned until the face looks to the front")
    stood = Stood(surface, found, rotation, scale, notes)
    landmarks = Landmarks(
        {name: stood.here(point[None])[0] for name, point in found.landmarks.points.items()},
        dict(found.landmarks.how),
        list(found.landmarks.notes),
    )
    pose = _turned(found.pose, rotation, scale)
    moved = Surface(stood.here(surface.points), surface.triangles)
    return replace(stood, surface=moved, found=replace(found, landmarks=landmarks, pose=pose))


def inside_out(surface: Surface) -> bool:
    """Whether the triangles of a surface show their backs, as those of a mirrored file do.

    Args:
        surface: closed, or open in a place that is small against the whole.
    """
    middle = surface.points[np.unique(surface.triangles)].mean(axis=0)
    a, b, c = (surface.points[surface.triangles[:, k]] - middle for k in range(3))
    return float(np.einsum("ti,ti->t", a, np.cross(b, c)).sum()) < 0


def upright(rotation: Doubles) -> Doubles:
    """float64[3, 3]: what makes a head stand; along the axes where it nearly stands along them.

    Args:
        rotation: float64[3, 3], from the standing form to the head.
    """
    axes = np.zeros((3, 3))
    for row, column in ((1, 1), (2, 2)):  # up, then front
        way = rotation[:, column] * (1 - np.abs(axes).sum(axis=0))
        at = int(np.abs(way).argmax())
        axes[row, at] = np.sign(way[at])
    axes[0] = np.cross(axes[1], axes[2])
    cosine = (np.trace(axes @ rotation) - 1) / 2
    if np.degrees(np.arccos(np.clip(cosine, -1, 1))) < _SNAP:
        return axes
    return np.asarray(rotation.T.copy())


def unit_of(scale: float) -> float:
    """How many cm a unit of a file is.

    Args:
        scale: units in a cm of the model of form, whose head is that of a grown-up.
    """
    for unit in _UNITS:
        if _SIZES[0] < unit * scale < _SIZES[1]:
            return unit
    return 1.0 / scale


def _turned(pose: Pose, rotation: Doubles, scale: float) -> Pose:
    return replace(
        pose,
        rotation=rotation @ pose.rotation,
        scale=scale * pose.scale,
        shift=scale * rotation @ pose.shift,
    )
