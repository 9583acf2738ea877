# SPDX-License-Identifier: MIT
"""The checks of the self-test: load, evaluate with every instruction set, write and read files,
time an evaluation.

The faces and their reference values (golden/) are synthetic. The values come from OpenRigLogic, an
independent implementation (tests/data/golden/README.md); tests/python/support/make_selftest.py
selects them.
"""

from __future__ import annotations

import hashlib
import os
import platform
import sys
import sysconfig
import tempfile
from collections.abc import Callable, Iterator
from functools import partial
from importlib import resources
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .. import Clip, DnaError, Rig, __version__, available_simd, load
from ..base.errors import RisoriusError
from ..files import fileio

FACES = ("core", "units", "solvers")
# largest error relative to max(1, |value|); float32 sums in another order may differ by this
TOLERANCE = 2e-4
TIMED = 0.2  # duration of the timing in seconds
_NAME = "Prüfung 面.dna"  # a file name that fails in code with narrow file names


class Row(NamedTuple):
    """The result of one check: its name, whether it passed, and a text."""

    name: str
    passed: bool
    text: str


class _Failed(RisoriusError):  # noqa: N818  never leaves this file
    """A failed check; its message is the reason."""


def run(face: str | os.PathLike[str] | None = None) -> list[Row]:
    """Runs every check; an exception gives a failed row.

    Args:
        face: path of a DNA file to time; None: a face of the wheel.
    """
    rows = [_guarded("machine", _machine)]
    rows += [_guarded(f"load {name}", partial(_load, name)) for name in FACES]
    for simd in available_simd().split(", "):
        rows.append(_guarded(f"evaluate, {simd}", partial(_evaluate, simd)))
    rows.append(_guarded("scalar bits", _scalar_bits))
    rows.append(_guarded("damaged file", _damaged))
    rows.append(_guarded("write and read", _files))
    rows.append(_guarded("time of a frame", partial(_time, face)))
    return rows


def _guarded(name: str, check: Callable[[], str]) -> Row:
    try:
        return Row(name, True, check())
    except _Failed as error:
        return Row(name, False, str(error))
    except OSError as error:  # without the path, because users send reports to strangers
        return Row(name, False, f"{type(error).__name__}: {error.strerror or 'no reason given'}")
    except Exception as error:  # noqa: BLE001  unexpected errors belong in the report
        return Row(name, False, f"{type(error).__name__}: {error}")


def content(name: str) -> bytes:
    """The bytes of a file in the folder golden/."""
    return resources.files(__package__).joinpath("golden", name).read_bytes()


class _Case(NamedTuple):
    """A pose at a LOD, and the results of the reference implementation."""

    lod: int
    raw: npt.NDArray[np.float32]
    joints: npt.NDArray[np.float32]
    shapes: npt.NDArray[np.float32]
    maps: npt.NDArray[np.float32]


def _cases(name: str) -> Iterator[_Case]:
    """The cases of a face from golden/NAME.f32: little-endian float32, one row per case.

    A row contains LOD, raw controls, joints (9 values each), blend shapes, animated maps.
    """
    dna = load(content(f"{name}.dna"))
    sizes = [1, len(dna.raw_control_names), 9 * len(dna.joint_names)]
    sizes += [len(dna.blend_shape_channel_names), len(dna.animated_map_names)]
    table = np.frombuffer(content(f"{name}.f32"), "<f4").reshape(-1, sum(sizes))
    for row in table:
        lod, raw, joints, shapes, maps = np.split(row, np.cumsum(sizes)[:-1])
        yield _Case(int(lod[0]), raw, joints, shapes, maps)


def _system() -> str:
    """Name and version of the operating system. On Windows, `platform` would need a WMI query."""
    if sys.platform == "win32":
        version = sys.getwindowsversion()
        return f"Windows {version.major}.{version.minor}.{version.build}"
    return f"{platform.system()} {platform.release()}"


def _machine() -> str:
    libc = " ".join(platform.libc_ver()) if sys.platform == "linux" else ""
    return ", ".join(
        word
        for word in (
            f"Risorius {__version__}",
            f"Python {sys.version.split()[0]}",
            f"NumPy {np.__version__}",
            _system(),
            sysconfig.get_platform(),
            libc,
        )
        if word
    )


def _load(name: str) -> str:
    dna = load(content(f"{name}.dna"))
    findings = dna.validate()
    if findings:
        raise _Failed(str(findings[0]))
    return f"{len(dna.raw_control_names)} controls, {len(dna.joint_names)} joints"


def _error(case: _Case, rig: Rig) -> float:
    pose = rig.evaluate(case.raw, lod=case.lod, settle=False)
    worst = 0.0
    for wanted, given in (
        (case.joints, pose.joints.ravel()),
        (case.shapes, pose.blend_shapes),
        (case.maps, pose.animated_maps),
    ):
        if wanted.size:
            apart = np.abs(given.astype(np.float64) - wanted) / np.maximum(1, np.abs(wanted))
            worst = max(worst, float(apart.max())) if np.isfinite(apart).all() else np.inf
    return worst


def _evaluate(simd: str) -> str:
    worst, count = 0.0, 0
    for name in FACES:
        rig = Rig(load(content(f"{name}.dna")), simd=simd)
        for case in _cases(name):
            error = _error(case, rig)
            if error > TOLERANCE:
                raise _Failed(
                    f"face {name}, case {count}: {error:.2g} away from the reference values"
                )
            worst, count = max(worst, error), count + 1
    return f"{count} poses, at most {worst:.1g} from the reference"


def scalar_hash() -> str:
    """SHA-256 in hexadecimal of the scalar path's results for all cases of the face `core`."""
    rig = Rig(load(content("core.dna")), simd="scalar")
    out = hashlib.sha256()
    for case in _cases("core"):
        pose = rig.evaluate(case.raw, lod=case.lod, settle=False)
        for values in (pose.joints, pose.blend_shapes, pose.animated_maps, pose.controls):
            out.update(np.ascontiguousarray(values, "<f4").tobytes())
    return out.hexdigest()


def _scalar_bits() -> str:
    found, wanted = scalar_hash(), content("scalar.sha256").decode().strip()
    if found != wanted:
        raise _Failed(f"{found[:16]}, elsewhere {wanted[:16]}")
    return f"{found[:16]}, as everywhere"


def _damaged() -> str:
    whole = content("core.dna")
    for size in (0, 3, len(whole) // 2, len(whole) - 1):
        try:
            load(whole[:size])
        except DnaError:
            continue
        raise _Failed(
            f"a file that was cut from {len(whole)} to {size} bytes was read without an error"
        )
    return "files that are cut short are refused"


def _files() -> str:
    whole = content("solvers.dna")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / _NAME
        for _ in range(2):  # the second save replaces the first file
            load(whole).save(str(path))
            if path.read_bytes() != whole:
                raise _Failed("the saved file differs from the original file")
        if load(path).to_bytes() != whole:
            raise _Failed("the saved file, loaded and written again, differs from itself")
        names = load(whole).raw_control_names
        curves = np.linspace(0, 1, 5 * len(names), dtype=np.float32).reshape(-1, 5)
        clip = path.with_suffix(".rzc")
        Clip(names, curves, 30.0).save(clip)
        if not np.array_equal(Clip.load(clip).curves, curves):
            raise _Failed("the clip that was loaded differs from the clip that was saved")
        fileio.write_bytes(path, b"")
        if path.read_bytes() != b"":
            raise _Failed("a file could not be replaced")
        left = sorted(p.suffix for p in Path(folder).iterdir())
        if left != [".dna", ".rzc"]:
            raise _Failed(f"one .dna and one .rzc file were expected in the folder, found {left}")
    return "a face and a clip, byte for byte, under a name with umlauts and Chinese"


def _time(face: str | os.PathLike[str] | None) -> str:
    rig = Rig(load(face if face is not None else content("solvers.dna")))
    raw = np.full(len(rig.raw_control_names), 0.5, np.float32)
    rig.evaluate(raw)
    times = []
    end = perf_counter() + TIMED
    while perf_counter() < end:
        begin = perf_counter()
        rig.evaluate(raw)
        times.append(perf_counter() - begin)
    middle = sorted(times)[len(times) // 2] * 1e6
    return f"{middle:.0f} microseconds ({rig.simd}, {rig.joint_count} joints)"
