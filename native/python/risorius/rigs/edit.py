# SPDX-License-Identifier: MIT
"""Dna -> Dna operations.

regroup: the joint groups made anew, dense and without outliers.
"""

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
    """The same face with joint groups that are dense, whatever they were before.

    Joints that the same controls drive come into one region, each region is one dense group with
    the rows of coarser LODs first, and small coefficients that a control has in a region foreign
    to it are taken out.

    Args:
        dna: stays as it is.
        regions: joints of each region, by name or index, in a mapping from the regions' names or
            in a list; a name stands for all joints that have it. Joints that no region lists,
            and all for None, come together by what drives them.
        threshold: (mm, degrees, scale): coefficients whose effect at control value 1 is below
            it are small; x is (x mm, x degrees, x per cent of scale). 0 takes out nothing:
            the result is the same function, on the scalar path to the last bit.
        foreign_share: a control is foreign to a region where it moves no more than this share
            of the region's joints.
        combinations: random poses that the report compares, beside each raw control at 1.
        seed: of those poses.
        timed: evaluations to time on either side, 0 for none.

    Returns:
        The new Dna and a report: sizes before and after, the regions' joint indices, the largest
        change of any joint at any LOD, the median time of an evaluation. Coefficients of joints
        that are turned by quaternions are never taken out.

    Raises:
        DnaError: a Dna that does not fit together, a joint that is not there or in two
            regions, a region without joints, a threshold that is no number from 0.
        ValueError: an unknown joint name; a threshold of other than one or three numbers.
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
    """Joint indices of each region.

    Raises:
        ValueError: no joint has that name.
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
