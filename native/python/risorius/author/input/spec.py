# SPDX-License-Identifier: MIT
"""Reads SPEC.toml: the source of a joint rig and its options."""

from __future__ import annotations

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
from ..heads.joining import join
from ..heads.parts import Material, Wishes
from ..levels import LodOptions
from ..work import TOLERANCE, RigOptions
from . import fbx, gltf, said
from .fbx_head import read_fbx_head
from .gltf_head import read_gltf_head
from .matching import Assignment, assign
from .obj import ShapeFileError
from .obj_head import find_neutral, read_obj_head
from .shape_face import (
    ShapeSet,
    check_shapes,
    combined_rows,
    make_shape_face,
    shape_set,
    take_combined,
)

_READERS = {suffix: read_gltf_head for suffix in gltf.SUFFIXES} | {fbx.SUFFIX: read_fbx_head}
BY_BLENDER = (".usd", ".usdc", ".usda", ".usdz", ".abc", ".blend", ".dae")
_MOST_JOINTS = 4096
_MOST_VERTICES = 1 << 26


_names = partial(several, of=text)
_Checks = Mapping[str, Callable[[object], Any]]
_TABLES: dict[str, _Checks] = {
    "source": dict.fromkeys(
        ("dna", "neutral", "expressions", "mesh", "left", "up", "front", "unit"), text
    )
    | dict.fromkeys(("scale", "height_mm"), partial(finite, low=1e-6, high=1e9)),
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
    """A spec: the source of the face, and the options of the rig."""

    path: Path
    name: str
    source: dict[str, Any]
    options: RigOptions
    correctives: CorrectiveOptions = field(default_factory=lambda: CorrectiveOptions(most=0))
    controls: dict[str, said.Said] = field(default_factory=dict)


@dataclass
class Read:
    """A face of blend shapes from the source of a spec.

    Attributes:
        dna: the face.
        became: the controls of each shape; empty if the source is a DNA file.
        odd: sentences on unusual, guessed or left-out parts.
        materials: name of a mesh -> its material.
        kept: parts of the names of meshes that keep their skin weights and blend shapes, such as
            eyeballs, which turn with their own joint.
        template: face whose animated maps the finished rig gets; None: the rig keeps its maps.
    """

    dna: Dna
    became: Assignment
    odd: list[str]
    materials: dict[str, Material] = field(default_factory=dict)
    kept: tuple[str, ...] = ()
    template: Dna | None = None


def read_spec(path: Path) -> Spec:
    """Read a SPEC.toml. For a file or folder of a head, make a spec with default options.

    Args:
        path: the spec, a file of a head, or a folder of OBJ files.

    Raises:
        ShapeFileError: the file is no TOML, or contains an unknown table, key or value.
        OSError: the file cannot be read.
    """
    if path.is_dir():
        source = {"neutral": find_neutral(path).name, "expressions": "."}
        return Spec(path / "head", path.resolve().name, source, _options(path, {}))
    if path.suffix.lower() in (*_READERS, *BY_BLENDER):
        return _spec_of(path, {"source": {"neutral": path.name}})
    return _spec_of(path, _read_tables(path))


def _spec_of(path: Path, table: dict[str, Any]) -> Spec:
    source = table.get("source", {})
    if ("dna" in source) == ("neutral" in source):
        raise ShapeFileError(f"{path}: source: either dna or neutral was expected")
    suffix = Path(source.get("neutral", "")).suffix.lower()
    if suffix in BY_BLENDER:
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
    """Read a SPEC.toml that contains only options: no [source], no [controls] and no name.

    Raises:
        ShapeFileError: as read_spec(), or the file has a source, controls or a name.
        OSError: the file cannot be read.
    """
    table = _read_tables(path)
    for name in ("source", "controls", "name"):
        if name in table:
            raise ShapeFileError(
                f"{path}: {name}: a person of the sample has its own, so this file may contain "
                "options only"
            )
    return _options(path, table), _correctives(table.get("correctives", {}))


def _read_tables(path: Path) -> dict[str, Any]:
    try:
        table = toml.parse(toml.text_of(path))
    except toml.TomlError as error:
        raise ShapeFileError(f"{path}: {error}") from None
    return {name: _checked(path, name, found) for name, found in table.items()}


def _checked(path: Path, name: str, found: object) -> Any:
    """Check a top-level entry of the file and return its value. Raises ShapeFileError."""
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
            check = said.check if name == said.TABLE else _TABLES[name].get(key)
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
        raise ShapeFileError(
            f"{path}: shapes: either tolerance_mm or tolerance_percent was expected, found both"
        )
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


def read_face(spec: Spec) -> Read:
    """Read the face of blend shapes from the source of a spec.

    Raises:
        DnaError: the DNA file is damaged.
        ShapeFileError: a mesh or an expression is unusable.
        RisoriusError: another fault of the file, for example no expression moves a vertex.
        OSError: a file cannot be read.
    """
    folder = spec.path.parent
    if "dna" in spec.source:
        require_regular(folder / spec.source["dna"])
        return Read(load(folder / spec.source["dna"]), Assignment({}, {}, {}, []), [])
    shapes, about = _read_shapes(spec, folder)
    together = take_combined(shapes)
    odd = check_shapes(shapes)
    became = assign(shapes.expressions, spec.controls)
    dna = make_shape_face(shapes, became.controls)
    looks = zip(dna.mesh_names, (part.material for part in shapes.parts), strict=True)
    materials = {name: look for name, look in looks if look is not None}
    rows = combined_rows(str(spec.path), shapes, together, became.controls, dna.raw_control_names)
    if rows:
        face = shapes.parts[0]
        own = [(controls, delta[face.start : face.stop]) for controls, delta in rows]
        dna = add_correctives(dna, 0, own)
    return Read(dna, became, about + odd + became.notes, materials, shapes.kept)


def _read_shapes(spec: Spec, folder: Path) -> tuple[ShapeSet, list[str]]:
    """Read and join the meshes of the head. Returns the shapes, and notes on guesses."""
    source, neutral = spec.source, folder / spec.source["neutral"]
    read = _READERS.get(neutral.suffix.lower())
    if read is not None:
        parts, unit = read(neutral), "m"
    else:
        expressions = folder / source["expressions"]
        parts = read_obj_head(neutral, expressions, others=source["expressions"] == ".")
        unit = "cm"
    named = {name: source[name] for name in Wishes.__dataclass_fields__ if name in source}
    where = str(spec.path if spec.path.suffix == ".toml" else neutral)
    if named.get("unit") in ("cm", "m"):
        unit = named["unit"]
    head = join(where, parts, unit, Wishes(**named), spec.controls)
    return shape_set(spec.name, head), head.notes
