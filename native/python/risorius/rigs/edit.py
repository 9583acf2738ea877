# SPDX-License-Identifier: MIT
"""Rebuilds the joint groups of a face as dense groups, optionally without small coefficients."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import cast

from .._native import Dna, GroupSizes, LargestChange, RegroupReport
from .._native import regroup as _regroup
from ..base.errors import ArgumentError

__all__ = ["GroupSizes", "LargestChange", "RegroupReport", "regroup"]

Joint = str | int
Regions = Mapping[str, Iterable[Joint]] | Iterable[Iterable[Joint]]


def regroup(
    dna: Dna,
    *,
    regions: Regions | None = None,
    threshold: float | Sequence[float] = 0.0,
    foreign_share: float = 0.25,
    combinations: int = 200,
    seed: int = 0,
    timed: int = 1000,
) -> tuple[Dna, RegroupReport]:
    """A copy of the face with dense joint groups.

    Joints that the same controls drive form a region. Each region becomes one dense group, with the
    rows of coarser LODs first. Small coefficients of controls that are foreign to a region are
    removed.

    Args:
        dna: the face; not changed.
        regions: joints of each region, by name or index, as a mapping by region name or a list; a
            name means all joints with that name. Joints that no region lists are grouped by the
            controls that drive them; None: all joints are grouped in this way.
        threshold: (mm, degrees, scale): a coefficient is small if its effect at control value 1 is
            below this; a number x means (x mm, x degrees, x per cent of scale). 0 removes nothing,
            and results stay equal, on the scalar path bitwise.
        foreign_share: a control is foreign to a region if it moves at most this share of the
            region's joints.
        combinations: number of random poses, besides each raw control at 1, in which the report
            compares the faces.
        seed: seed of the random poses.
        timed: number of timed evaluations before and after; 0 for none.

    Returns:
        The new Dna and a report: sizes before and after, joint indices of the regions, largest
        change of a joint at any LOD, median duration of an evaluation. Coefficients of joints with
        quaternion rotation are never removed.

    Raises:
        DnaError: an inconsistent Dna; a joint in two regions; a region without joints; a threshold
            that is not a number of at least 0.
        ValueError: an unknown joint name or index; a region that is a text; a threshold that is not
            one or three numbers.
    """
    mm, degrees, scale = _three(threshold)
    return _regroup(
        dna,
        regions=[] if regions is None else _indices(dna, regions),
        translation_mm=mm,
        rotation_degrees=degrees,
        scale=scale,
        foreign_share=foreign_share,
        combinations=combinations,
        seed=seed,
        timed=timed,
    )


def _three(threshold: float | Sequence[float]) -> tuple[float, float, float]:
    if isinstance(threshold, int | float):
        return float(threshold), float(threshold), threshold / 100
    if len(threshold) != 3:
        raise ArgumentError(
            f"threshold: one number or (mm, degrees, scale) was expected, found {threshold!r}"
        )
    mm, degrees, scale = threshold
    return mm, degrees, scale


def _indices(dna: Dna, regions: Regions) -> list[list[int]]:
    """Converts regions to lists of joint indices.

    Raises:
        ValueError: no joint has the name or index.
    """
    known: dict[str, list[int]] = {}
    for index, name in enumerate(dna.joint_names):
        known.setdefault(name, []).append(index)
    named = cast(
        "list[tuple[str, Iterable[Joint]]]",
        list(regions.items())
        if isinstance(regions, Mapping)
        else [(f"regions[{i}]", joints) for i, joints in enumerate(regions)],
    )
    out = []
    for region, joints in named:
        if isinstance(joints, str):
            raise ArgumentError(f"{region}: a list of joints was expected, found {joints!r}")
        found: list[int] = []
        for joint in joints:
            if isinstance(joint, str) and joint not in known:
                raise ArgumentError(f"{region}: there is no joint {joint!r}")
            if not isinstance(joint, str) and not 0 <= joint < len(dna.joint_names):
                raise ArgumentError(f"{region}: there is no joint {joint!r}")
            found += known[joint] if isinstance(joint, str) else [joint]
        out.append(found)
    return out
