# SPDX-License-Identifier: MIT
"""SPEC.toml: what a joint rig is made from and what it is to be."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ... import Dna, load
from ...base import toml
from ..correctives import CorrectiveOptions, add_correctives
from ..fitting import FitOptions
from ..geometry.skeleton import Doubles
from ..levels import LodOptions
from ..work import RigOptions
from . import fbx, gltf
from .matching import assign
from .obj import ShapeFileError, read_obj, read_positions
from .shape_face import ShapeSet, check_shapes, combined_rows, make_shape_face, take_combined

_READERS = {suffix: gltf.read_gltf for suffix in gltf.SUFFIXES} | {fbx.SUFFIX: fbx.read_fbx}
_BY_BLENDER = (".usd", ".usdc", ".usda", ".usdz", ".abc", ".blend", ".dae")
_TABLES: dict[str, dict[str, tuple[type, ...]]] = {
    "source": {
        "dna": (str,),
        "neutral": (str,),
        "expressions": (str,),
        "mesh": (str,),
        "left": (str,),
        "unit": (str,),
    },
    "joints": {
        "count": (int,),
        "influences": (int,),
        "smoothness": (int, float),
        "emphasis": (int, float),
        "rounds": (int,),
        "symmetric": (bool,),
        "bound": (bool,),
        "least_effect_mm": (int, float),
    },
    "shapes": {"tolerance_mm": (int, float), "keep": (bool,)},
    "correctives": {
        "most": (int,),
        "again": (int,),
        "solids": (list,),
        "triples": (int,),
        "together": (list,),
    },
    "lods": {"count": (int,), "joints": (list,), "vertices": (list,)},
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
        str(table.get("name", path.stem)),
        source,
        _options(path, table),
        _correctives(path, table.get("correctives", {})),
        dict(table.get("controls", {})),
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
    return _options(path, table), _correctives(path, table.get("correctives", {}))


def _read_tables(path: Path) -> dict[str, Any]:
    try:
        table = toml.parse(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise ShapeFileError(f"{path}: {error}") from None
    for name, rows in table.items():
        if name in ("name", "controls"):
            continue
        if name not in _TABLES or not isinstance(rows, dict):
            known = ", ".join(["name", *_TABLES, "controls"])
            raise ShapeFileError(f"{path}: {name}: one of {known} was expected")
        for key, value in rows.items():
            kinds = _TABLES[name].get(key)
            if kinds is None:
                known = ", ".join(_TABLES[name])
                raise ShapeFileError(f"{path}: {name}.{key}: one of {known} was expected")
            if not isinstance(value, kinds) or (isinstance(value, bool) and bool not in kinds):
                raise ShapeFileError(f"{path}: {name}.{key}: {value!r} is of another kind")
    return table


def _options(path: Path, table: dict[str, Any]) -> RigOptions:
    named = {"joints" if k == "count" else k: v for k, v in table.get("joints", {}).items()}
    least = float(named.pop("least_effect_mm", RigOptions.least_effect_mm))
    shapes = table.get("shapes", {})
    tolerance = float(shapes.get("tolerance_mm", 0.05)) if shapes.get("keep", True) else None
    levels = dict(table.get("lods", {}))
    for name in ("joints", "vertices"):
        budgets = levels.get(name, [])
        if not all(isinstance(n, int) and not isinstance(n, bool) for n in budgets):
            raise ShapeFileError(f"{path}: lods.{name}: whole numbers were expected")
        levels[name] = tuple(budgets)
    longest = max(len(levels["joints"]), len(levels["vertices"]))
    if longest and "count" not in levels:
        levels["count"] = longest
    try:
        lods = LodOptions(**levels)
        lods.check()
    except ValueError as error:
        raise ShapeFileError(f"{path}: {error}") from None
    return RigOptions(FitOptions(**named), tolerance, least, lods)


def _correctives(path: Path, table: dict[str, Any]) -> CorrectiveOptions:
    def names(key: str, rows: object) -> tuple[str, ...]:
        if not isinstance(rows, list) or not all(isinstance(name, str) for name in rows):
            raise ShapeFileError(f"{path}: correctives.{key}: names were expected, found {rows!r}")
        return tuple(rows)

    asked = dict(table)
    for key in ("most", "again", "triples"):
        if int(asked.get(key, 0)) < 0:
            raise ShapeFileError(f"{path}: correctives.{key}: 0 or more was expected")
    asked.setdefault("most", CorrectiveOptions.most if asked else 0)
    if "solids" in asked:
        asked["solids"] = names("solids", asked["solids"])
    asked["together"] = tuple(names("together", row) for row in asked.get("together", []))
    return CorrectiveOptions(**asked)


def read_face(spec: Spec) -> tuple[Dna, dict[str, list[str]], list[str]]:
    """The face of blend shapes that a spec names.

    Returns:
        The face; the raw controls of each expression (empty where the source is a DNA); what is
        odd about the expressions, a sentence each.

    Raises:
        DnaError: the DNA file cannot be used.
        ShapeFileError: a mesh or an expression cannot be used.
        OSError: a file cannot be read.
    """
    folder = spec.path.parent
    if "dna" in spec.source:
        return load(folder / spec.source["dna"]), {}, []
    shapes = _read_shapes(spec, folder)
    together = take_combined(shapes)
    odd = check_shapes(shapes)
    controls = assign(shapes.expressions, spec.controls)
    dna = make_shape_face(shapes, controls)
    rows = combined_rows(str(spec.path), shapes, together, controls, dna.raw_control_names)
    return add_correctives(dna, 0, rows) if rows else dna, controls, odd


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
        if path.resolve() == neutral.resolve():
            continue
        out.expressions[path.stem] = read_positions(path, len(mesh.positions)) - mesh.positions
    if not out.expressions:
        raise ShapeFileError(
            f"{folder / spec.source['expressions']}: a folder of OBJ files was expected, one for "
            "each expression"
        )
    return out
