# SPDX-License-Identifier: MIT
"""All hair of a person, and its meshes at the levels that show them."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from risorius import Dna
from risorius.expressions import load, pose_vector
from risorius.files.png import png

from ..body import Body
from ..paint.images import shrunk
from ..paint.regions import DIVIDED, inner_rings, lips_of
from ..paint.strands import paint_strands
from ..part import Part
from ..people import Person
from ..polygons import Floats
from ..source import BaseMesh
from .binding import append_mesh, bind, card_mesh, head_of, holds, whereabouts
from .clearance import cut_clear, narrow_edges
from .controls import add_lash_controls, add_lid_turns
from .face_hair import beard, brows, lash_curves, lashes
from .scalp import STYLES
from .strips import Strips
from .surface import Surface

PICTURE = "hair_color.png"
NO_HAIR = 4  # the level from which on there are no cards
_SHARES = (1.0, 0.42, 0.2, 0.1)  # of the strips, by level
_BROWS = (1.0, 0.75, 0.3, 0.1)  # wider, a brow's hairs would be dashes where faces are still large
_MOST_VERTICES = 12_000  # of all cards at LOD 0
_OWN = ("hair", "beard")
_ROWS = (99, 4, 3, 3)
_LEAST_MM = {"hair": 1.0, "brows": 0.15, "beard": 0.15, "eyelashes": 0.1}
_MM = 10.0  # of a centimetre
_OVERDONE = np.float32(1.4)  # times an expression, each control at most 1
_WIDEST, _OVER = "smile_open", np.float32(0.5)  # what brings most of a beard to where skin folds
_COIL = 1.6  # mm: radius of the coils of an afro of four centimetres
_PITCH = 2.4  # of a coil's radius, from turn to turn, where hair winds most tightly


@dataclass
class Grown:
    """The hair of a person by mesh: hair, brows, beard, eyelashes; what there is none of is not
    in it."""

    strips: dict[str, Strips]
    unit: float  # of the Dna's meshes, in decimetres


def grow_hair(
    person: Person, body: Body, even: Floats, base: BaseMesh, parts: list[Part], unit: float
) -> Grown:
    """Grow all hair of a person.

    Args:
        person: has the styles.
        body: the person's.
        even: float64[V, 3], the man's positions with both sides alike, decimetres.
        base: the base mesh.
        parts: the meshes; the head of LOD 0 is grown on.
        unit: of the Dna's meshes, in decimetres.
    """
    head = next(p for p in parts if p.name == "head_lod0_mesh")
    eye = even[body.groups["helper-l-eye"]].mean(axis=0)
    at = head.carry(body.positions)
    surface = Surface(head.polygons, at, head.carry(even), eye)
    lines = {}
    for letter in "lr":
        for number, lid in ((1, "D"), (2, "U")):
            faces = base.faces[f"helper-{letter}-eyelashes-{number}"]
            table = np.array([[corner[0] for corner in face] for face in faces])
            lines[letter.upper() + lid] = lash_curves(body.positions, table)
    found: dict[str, Strips | None] = {
        "hair": STYLES[person.hair_style](surface, person) if person.hair_style in STYLES else None,
        "brows": brows(surface, person),
        "beard": None if person.beard_style == "none" else _beard(surface, head, person),
        "eyelashes": lashes(surface, lines, person),
    }
    grown = {name: strips for name, strips in found.items() if strips is not None}
    for strips in grown.values():
        narrow_edges(strips, surface)
    return Grown(_within_budget(grown), unit)


def _beard(surface: Surface, head: Part, person: Person) -> Strips:
    mouth, _ = inner_rings(head.polygons, surface.man)
    return beard(surface, lips_of(mouth / DIVIDED), person)


def _within_budget(strips: dict[str, Strips]) -> dict[str, Strips]:
    """Fewer and wider cards on the scalp where all together have too many vertices."""
    counts = {name: 2 * len(s) * s.rows for name, s in strips.items()}
    over = sum(counts.values()) - _MOST_VERTICES
    if over > 0 and "hair" in strips:
        over += 2 * strips["hair"].rows  # the count of strips is rounded
        share = max(0.2, 1 - over / counts["hair"])
        strips = strips | {"hair": strips["hair"].coarser(share, strips["hair"].rows)}
    return strips


def add_hair(dna: Dna, grown: Grown) -> None:
    """Add the cards of all levels to a finished face.

    Args:
        dna: the face; gets the meshes.
        grown: the hair; of a beard goes what skin would come through.
    """
    # What each person has otherwise comes last, so that all others keep their numbers in a mix.
    names = sorted(grown.strips, key=lambda name: name in _OWN)
    heads = {lod: head_of(dna, lod) for lod in range(min(dna.lod_count, NO_HAIR))}
    there = {lod: whereabouts(dna, head) for lod, head in heads.items() if head is not None}
    if "beard" in grown.strips and heads[0] is not None:
        clear = cut_clear(
            grown.strips["beard"], dna, heads[0], grown.unit, _played(dna.raw_control_names)
        )
        grown.strips["beard"] = clear
    for name, lod in itertools.product(names, there):
        head, strips = heads[lod], grown.strips[name]
        assert head is not None
        share = (_BROWS if name == "brows" else _SHARES)[lod]
        shown = strips if lod == 0 else strips.coarser(share, _ROWS[lod])
        mesh = card_mesh(shown, grown.unit)
        own = None if lod == 0 else shown.roots.of(there[0])
        places = holds(head, shown, grown.unit, own, there[lod])
        lashes = name == "eyelashes"
        bind(dna, mesh, head, places, _LEAST_MM[name] / _MM, name == "hair", lashes)
        if lashes:
            add_lid_turns(dna, mesh, shown.rows, lod)
            add_lash_controls(dna, mesh, shown.rows, lod)
        append_mesh(dna, f"{name}_lod{lod}_mesh", mesh, [lod])


def _played(names: list[str]) -> list[NDArray[np.float32]]:
    """What raw controls do in each expression, alone and with another over it, which is more.

    Args:
        names: of the raw controls.
    """
    alone = [pose_vector(face, names) for face in load().values()]
    smile = _OVER * pose_vector(_WIDEST, names)
    out = [*alone, *(_OVERDONE * face for face in alone), *(face + smile for face in alone)]
    return [np.minimum(face, 1) for face in out]


def hair_picture(person: Person, largest: int) -> dict[str, bytes]:
    """The picture of the hairs by its file name, as PNG.

    Args:
        person: has the colours.
        largest: it has no more texels than a square of this side.
    """
    return {PICTURE: png(shrunk(paint_strands(person), largest))}


def hair_metadata(dna: Dna, grown: Grown, person: Person) -> dict[str, str]:
    """Which meshes show the picture of the hairs, and how.

    `texture:<mesh>:color` -> file name; `hair:<mesh>` -> "rows=R" of its cards, which stand one
    after the other, two vertices in a row, from root to tip: renderers of strands follow them;
    `coil:<mesh>` -> "radius=R pitch=P", millimetres, where strands wind about their way.

    Args:
        dna: has the meshes.
        grown: the hair.
        person: has the curls.
    """
    metadata = {}
    for name in dna.mesh_names:
        kind = name.partition("_lod")[0]
        if kind not in grown.strips:
            continue
        metadata[f"texture:{name}:color"] = PICTURE
        lod = int(name.partition("_lod")[2].partition("_")[0])
        rows = grown.strips[kind].rows
        metadata[f"hair:{name}"] = f"rows={min(rows, _ROWS[lod])}"
        if kind in _OWN and person.hair_style == "afro" and person.hair_curl > 0:
            long = person.hair_length if kind == "hair" else 0.0
            radius = _COIL * (0.4 + 0.6 * min(long, 1.0))
            pitch = _PITCH * radius / person.hair_curl
            metadata[f"coil:{name}"] = f"radius={radius:.2f} pitch={pitch:.2f}"
    return metadata
