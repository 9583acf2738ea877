# SPDX-License-Identifier: MIT
"""The HTML report of `risorius author --report`."""

from __future__ import annotations

import statistics
import time
from typing import TYPE_CHECKING

import numpy as np

import risorius

from ...author.joint_rig import JointRig
from ...author.measure import expression_errors
from ..files import InputError

if TYPE_CHECKING:  # both modules need Matplotlib
    from ...plot.drawing.draw_errors import Expression
    from ...plot.report import ExpressionRow

_NEEDS = "--report draws with Matplotlib, which is not installed: pip install risorius[plot]"
_DRAWN = 12
_TIMED = 2000
_DPI = 150


def need_plot() -> None:
    """Check that Matplotlib is installed. Raises: InputError: it is not installed."""
    try:
        from ...plot import report  # noqa: F401
    except ImportError as error:
        if (error.name or "").partition(".")[0] != "matplotlib":
            raise
        raise InputError(_NEEDS) from error


def report_page(source: risorius.Dna, rig: JointRig, data: bytes, name: str) -> bytes:
    """Make a page that compares the joint face with its source.

    Args:
        source: the face with blend shapes.
        rig: the joint face with its errors.
        data: the bytes of the joint face's DNA file.
        name: name of the DNA file.

    Returns:
        The page as HTML, in UTF-8.
    """
    from ...plot.content.facts import gather
    from ...plot.report import LevelRow, render

    dna = risorius.load(data)
    levels = [
        LevelRow(
            joints=level.joints,
            vertices=level.vertices,
            deltas=level.deltas,
            size=len(dna.filter_lods([lod]).to_bytes()),
            microseconds=_microseconds(dna, lod),
            rms=level.rms,
            largest=level.largest,
            with_shapes=level.largest_with_shapes,
        )
        for lod, level in enumerate(rig.levels)
    ]
    return render(gather(dna, data, name), levels, _rows(rig), _worst(source, rig), _DPI)


def _microseconds(dna: risorius.Dna, lod: int) -> float:
    """Median time of evaluating a pose with about 20 active controls, in microseconds."""
    rig = risorius.Rig(dna)
    raw = np.zeros(len(rig.raw_control_names), np.float32)
    raw[:: max(1, len(raw) // 20)] = 0.5
    times = []
    for _ in range(_TIMED):
        begin = time.perf_counter()
        rig.evaluate(raw, lod=lod)
        times.append(time.perf_counter() - begin)
    return 1e6 * statistics.median(times)


def _rows(rig: JointRig) -> list[ExpressionRow]:
    from ...plot.report import ExpressionRow as Row

    fine = [errors for errors in rig.errors if errors.lod == 0]
    count = sum(errors.vertices for errors in fine)
    out = []
    for e, name in enumerate(fine[0].expressions):
        worst = max(fine, key=lambda errors: errors.joints_largest[e])

        def mean(values: list[float]) -> float:
            pairs = zip(values, fine, strict=True)
            return float(np.sqrt(sum(x**2 * errors.vertices for x, errors in pairs) / count))

        out.append(
            Row(
                name=name.replace("CTRL_expressions.", ""),
                motion=mean([x.motion[e] for x in fine]),
                rms=mean([x.joints_rms[e] for x in fine]),
                largest=float(worst.joints_largest[e]),
                between=max(float(x.between_largest[e]) for x in fine),
                with_shapes=max(float(x.largest[e]) for x in fine),
                worst=f"{worst.name} {int(worst.worst_vertex[e])}",
            )
        )
    return out


def _worst(source: risorius.Dna, rig: JointRig) -> list[Expression]:
    from ...plot.drawing.draw_errors import Expression as Drawn

    fine = [errors for errors in rig.errors if errors.lod == 0]
    largest = np.max([errors.joints_largest for errors in fine], axis=0)
    out = []
    for e in np.argsort(-largest, kind="stable")[:_DRAWN].tolist():
        meshes, errors = expression_errors(
            source, rig.dna, rig.columns[e], [errors.name for errors in fine]
        )
        every = np.concatenate(errors)
        out.append(
            Drawn(
                name=fine[0].expressions[e].replace("CTRL_expressions.", ""),
                meshes=meshes,
                errors=errors,
                largest=float(every.max()),
                rms=float(np.sqrt((every**2).mean())),
            )
        )
    return out
