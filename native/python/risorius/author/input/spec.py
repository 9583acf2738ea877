# SPDX-License-Identifier: MIT
"""SPEC.toml: what a joint rig is made from and what it is to be."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from ... import Dna, load
from ...base import toml
from ...base.given import GivenError, finite, flag, several, shown, text, whole
from ...base.reading import require_regular
from ..correctives import CorrectiveOptions, add_correctives
from ..fitting import FitOptions
from ..geometry.skeleton import Doubles
from ..levels import LodOptions
from ..work import TOLERANCE, RigOptions
from . import fbx, gltf
from .matching import Assignment, assign
from .obj import ShapeFileError, read_obj, read_positions
from .shape_face import ShapeSet, check_shapes, combined_rows, make_shape_face, take_combined

_READERS = {suffix: gltf.read_gltf for suffix in gltf.SUFFIXES} | {fbx.SUFFIX: fbx.read_fbx}
_BY_BLENDER = (".usd", ".usdc", ".usda", ".usdz", ".abc", ".blend", ".dae")
_MOST_JOINTS = 4096
_MOST_VERTICES = 1 << 26


_names = partial(several, of=text)
_Checks = Mapping[str, Callable[[object], Any]]
_TABLES: dict[str, _Checks] = {
    "source": dict.fromkeys(("dna", "neutral", "expressions", "mesh", "left", "unit"), text),
    "joints": {
        "count": partial(whole, low=0, high=_MOST_JOINTS),
        "influences": partial(whole, low=1, high=16),
        "smoothness": partial(finite, low=0.0, high=1e6),
        "emphasis": partial(finite, low=0.0, high=100.0),
        "rounds": partial(whole, low=0, high=10_000),
        "symmetric": flag,
        "bound": flag,
        "least_effect_mm": partial(finite, low=0.0, high=1e6),
    },
    "shapes": {
        "tolerance_mm": partial(finite, low=0.0, high=1e6),
        "tolerance_percent": partial(finite, low=0.0, high=100.0),
        "keep": flag,
    },
    "correctives": {
        "most": partial(whole, low=0, high=65_535),
        "again": partial(whole, low=0, high=1_000_000),
        "solids": _names,
        "triples": partial(whole, low=0, high=1_000_000),
        "together": partial(several, of=_names),
    },
    "lods": {
        "count": partial(whole, low=1, high=32),
        "joints": partial(several, of=partial(whole, low=0, high=_MOST_JOINTS)),
        "vertices": partial(several, of=partial(whole, low=0, high=_MOST_VERTICES)),
    },
}


@dataclass
class Spec:
    """A spec that was read: where the face is, and the options."""

    path: Path
    name: str
    source: dict[str, Any]
    options: RigOptions
    correctives: CorrectiveOptions = field(default_factory=lambda: CorrectiveOptions(most=0))
    controls: dict[str, str | list[str]] = field(default_factory=dict)


def read_spec(path: Path) -> Spec:
    """The content of a SPEC.toml.

    Raises:
        ShapeFileError: no TOML, or a table, a name or a kind of value that is not known.
        OSError: the file cannot be read.
    """
    table = _read_tables(path)
    source = table.get("source", {})
    if ("dna" in source) == ("neutral" in source):
        raise ShapeFileError(f"{path}: source: either dna or neutral was expected")
    suffix = Path(source.get("neutral", "")).suffix.lower()
    if suffix in _BY_BLENDER:
        raise ShapeFileError(
            f"{path}: source.neutral: OBJ, glTF, GLB or FBX was expected, found {suffix}: import "
            "it into Blender and choose Object > Make Rig from Shape Keys, or save it there as glTF"
        )
    if "neutral" in source and suffix not in _READERS and "expressions" not in source:
        raise ShapeFileError(f"{path}: source.expressions: a folder of OBJ files was expected")
    return Spec(
        path,
        table.get("name", path.stem),
        source,
        _options(path, table),
        _correctives(table.get("correctives", {})),
        table.get("controls", {}),
    )


def read_options(path: Path) -> tuple[RigOptions, CorrectiveOptions]:
    """What a rig is to be, of a SPEC.toml that leaves out whose: without [source] and [controls].

    Raises:
        ShapeFileError: as read_spec, or it names a source or controls.
        OSError: the file cannot be read.
    """
    table = _read_tables(path)
    for name in ("source", "controls", "name"):
        if name in table:
            raise ShapeFileError(f"{path}: {name}: a person of the sample has its own")
    return _options(path, table), _correctives(table.get("correctives", {}))


def _read_tables(path: Path) -> dict[str, Any]:
    try:
        table = toml.parse(toml.text_of(path))
    except toml.TomlError as error:
        raise ShapeFileError(f"{path}: {error}") from None
    return {name: _checked(path, name, found) for name, found in table.items()}


def _one_or_several(value: object) -> str | list[str]:
    return list(_names(value)) if isinstance(value, list) else text(value)


def _checked(path: Path, name: str, found: object) -> Any:
    """The value of a key of the file's top. Raises: ShapeFileError: none that is known."""
    place = name
    try:
        if name == "name":
            return text(found)
        if name not in (*_TABLES, "controls"):
            raise GivenError(f"one of {', '.join(['name', *_TABLES, 'controls'])} was expected")
        if not isinstance(found, dict):
            raise GivenError(f"a table [{name}] was expected, found {shown(found)}")
        out = {}
        for key, value in found.items():
            place = f"{name}.{key}"
            check = _one_or_several if name == "controls" else _TABLES[name].get(key)
            if check is None:
                raise GivenError(f"one of {', '.join(_TABLES[name])} was expected")
            out[key] = check(value)
        return out
    except GivenError as error:
        raise ShapeFileError(f"{path}: {place}: {error}") from None


def _options(path: Path, table: dict[str, Any]) -> RigOptions:
    named = {"joints" if k == "count" else k: v for k, v in table.get("joints", {}).items()}
    least = named.pop("least_effect_mm", RigOptions.least_effect_mm)
    shapes = table.get("shapes", {})
    if "tolerance_mm" in shapes and "tolerance_percent" in shapes:
        raise ShapeFileError(f"{path}: shapes: tolerance_mm or tolerance_percent was expected")
    share = shapes["tolerance_percent"] / 100 if "tolerance_percent" in shapes else TOLERANCE
    levels = dict(table.get("lods", {}))
    longest = max(len(levels.get(name, ())) for name in ("joints", "vertices"))
    if longest and "count" not in levels:
        levels["count"] = longest
    try:
        lods = LodOptions(**levels)
        lods.check()
    except ValueError as error:
        raise ShapeFileError(f"{path}: {error}") from None
    return RigOptions(
        FitOptions(**named),
        shapes.get("tolerance_mm"),
        share,
        shapes=shapes.get("keep", True),
        least_effect_mm=least,
        lods=lods,
    )


def _correctives(table: dict[str, Any]) -> CorrectiveOptions:
    return CorrectiveOptions(**{"most": CorrectiveOptions.most if table else 0, **table})


def read_face(spec: Spec) -> tuple[Dna, Assignment, list[str]]:
    """The face of blend shapes that a spec names.

    Returns:
        The face; what each shape became (nothing where the source is a DNA); what is odd about the
        shapes and their names, a sentence each.

    Raises:
        DnaError: the DNA file cannot be used.
        ShapeFileError: a mesh or an expression cannot be used.
        OSError: a file cannot be read.
    """
    folder = spec.path.parent
    if "dna" in spec.source:
        require_regular(folder / spec.source["dna"])
        return load(folder / spec.source["dna"]), Assignment({}, {}, {}, []), []
    shapes = _read_shapes(spec, folder)
    together = take_combined(shapes)
    odd = check_shapes(shapes)
    became = assign(shapes.expressions, spec.controls)
    dna = make_shape_face(shapes, became.controls)
    rows = combined_rows(str(spec.path), shapes, together, became.controls, dna.raw_control_names)
    return add_correctives(dna, 0, rows) if rows else dna, became, odd + became.notes


def _read_shapes(spec: Spec, folder: Path) -> ShapeSet:
    neutral = folder / spec.source["neutral"]
    morphs: dict[str, Doubles] = {}
    read = _READERS.get(neutral.suffix.lower())
    if read is not None:
        mesh, morphs = read(neutral, spec.source.get("mesh", ""))
        unit = "m"
    else:
        mesh, unit = read_obj(neutral), "cm"
    left = spec.source.get("left", "+x")
    if left not in ("+x", "-x"):
        raise ShapeFileError(f"{spec.path}: source.left: +x or -x was expected, found {left!r}")
    out = ShapeSet(spec.name, mesh, {}, 1 if left == "+x" else -1, spec.source.get("unit", unit))
    if out.unit not in ("cm", "m"):
        raise ShapeFileError(f"{spec.path}: source.unit: cm or m was expected, found {out.unit!r}")
    out.expressions.update(morphs)
    if morphs:
        return out
    files = sorted((folder / spec.source["expressions"]).glob("*.obj"))
    for path in files:
        if os.path.realpath(path) == os.path.realpath(neutral):  # a loop of links is none
            continue
        out.expressions[path.stem] = read_positions(path, len(mesh.positions)) - mesh.positions
    if not out.expressions:
        raise ShapeFileError(
            f"{folder / spec.source['expressions']}: a folder of OBJ files was expected, one for "
            "each expression"
        )
    return out
