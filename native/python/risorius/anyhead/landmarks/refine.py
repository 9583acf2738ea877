# SPDX-License-Identifier: MIT
"""Refines landmarks: the head model is fitted again to each region of the face alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...author.geometry.skeleton import Doubles
from ..form.fitting import Pose, Step, Target, fit
from ..form.heads import HeadForm, head_form

_ALL = 1 << 20  # a limit above any number of vertices: all vertices are paired
_PARTS = 40  # number of principal components that are fitted; a region does not determine more


@dataclass(frozen=True)
class Region:
    """A part of the face that is fitted alone.

    Attributes:
        begins: prefixes of the names of its landmarks.
        sides: whether the left and the right side are separate regions.
        width: distance from the region's centre at which the weight is 1/e, in cm of the model.
        prior: strength of the pull of the model's weights towards 0.
        least_cosine: least cosine between the normals of a pair.
        expressions: whether weights of expressions may change. They may not at the mouth, because
            an expression would be fitted in place of the shape of the lips.
    """

    begins: tuple[str, ...]
    sides: bool
    width: float
    prior: float
    least_cosine: float
    expressions: bool = True


REGIONS = (
    Region(("eye_", "lid_"), True, 2.5, 0.5, 0.5),
    Region(("mouth_", "lip_"), False, 5.0, 0.4, 0.6, expressions=False),
    Region(("nose_", "nostril_"), False, 3.5, 0.7, 0.5),
    Region(("ear_",), True, 4.5, 0.7, 0.4),
)
_STRAYED = 1.2  # cm of the model: a region whose landmarks move farther is rejected
_SEEN = 0.02  # smaller weights are set to 0


def refined(target: Target, pose: Pose) -> dict[str, Doubles]:
    """float64[3] by landmark name: refined positions in the surface's space.

    Args:
        target: the surface.
        pose: the pose of the model in the surface, from a fit of the whole head.
    """
    form = head_form()
    points = pose.points(form)
    out = {name: points[vertex] for name, vertex in form.places.items()}
    for region in REGIONS:
        for side in ("_L", "_R") if region.sides else ("",):
            names = [n for n in form.places if n.startswith(region.begins) and n.endswith(side)]
            out |= _of_region(target, pose, region, form, names)
    return out


def _of_region(
    target: Target, pose: Pose, region: Region, form: HeadForm, names: list[str]
) -> dict[str, Doubles]:
    places = [form.places[name] for name in names]
    away = np.linalg.norm(form.mean - form.mean[places].mean(axis=0), axis=1)
    weights = np.exp(-((away / region.width) ** 2))
    weights[weights < _SEEN] = 0.0
    steps = tuple(
        Step(6, reach, _ALL, _PARTS, region.prior, region.least_cosine, region.expressions)
        for reach in (0.4, 0.25)
    )
    before = pose.points(form)[places]
    points = fit(target, pose, steps, weights=weights).points(form)
    if np.linalg.norm(points[places] - before, axis=1).max() > _STRAYED * pose.scale:
        return {}
    return {name: points[vertex] for name, vertex in zip(names, places, strict=True)}
