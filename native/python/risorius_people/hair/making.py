# SPDX-License-Identifier: MIT
"""Makes all hair of a person, and its meshes for each LOD."""

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
NO_HAIR = 4  # number of the first LOD without hair cards
_SHARES = (1.0, 0.42, 0.2, 0.1)  # fraction of the strips that is kept at each LOD
# Fraction of the brows' strips that is kept at LODs 0 to 3. At LODs 1 and 2 it is larger than for
# other hair, because fewer cards must be wider, and wide cards of brows look like dashes while the
# face is large on the screen.
_BROWS = (1.0, 0.75, 0.3, 0.1)
_MOST_VERTICES = 12_000  # limit for all cards at LOD 0 together
_OWN = ("hair", "beard")  # meshes that not all people have
_ROWS = (99, 4, 3, 3)  # largest number of rows of a card at each LOD
# Millimetres: shapes that move no vertex of a mesh farther than this are left out.
_LEAST_MM = {"hair": 1.0, "brows": 0.15, "beard": 0.15, "eyelashes": 0.1}
_MM = 10.0  # millimetres in a centimetre
_OVERDONE = np.float32(1.4)  # factor on the controls of an expression; each control stays at most 1
# Expression that is added to all others when the beard is tested, and its weight. The expression
# folds the skin under most of the beard.
_WIDEST, _OVER = "smile_open", np.float32(0.5)
_COIL = 1.6  # mm: radius of the coils of an afro 4 cm long
_PITCH = 2.4  # distance between turns, in radii of the coil, for hair_curl 1


@dataclass
class Grown:
    """The hair of a person.

    `strips` has a key for each mesh of hair that the person has: hair, brows, beard, eyelashes.
    """

    strips: dict[str, Strips]
    unit: float  # length of a decimetre in the unit of the Dna's meshes


def grow_hair(
    person: Person, body: Body, even: Floats, base: BaseMesh, parts: list[Part], unit: float
) -> Grown:
    """Grows all hair of a person.

    Args:
        person: the person, with the hair styles.
        body: body of the person.
        even: float64[V, 3], positions of the man without asymmetry, in decimetres.
        base: the base mesh.
        parts: the meshes; hair grows on the head of LOD 0.
        unit: length of a decimetre in the unit of the Dna's meshes.
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
    """Replaces the scalp's cards by fewer and wider ones if all cards together have more than
    _MOST_VERTICES vertices.

    Args:
        strips: mesh -> its strips at LOD 0.
    """
    counts = {name: 2 * len(s) * s.rows for name, s in strips.items()}
    over = sum(counts.values()) - _MOST_VERTICES
    if over > 0 and "hair" in strips:
        over += 2 * strips["hair"].rows  # a margin, because coarser rounds the number of strips
        share = max(0.2, 1 - over / counts["hair"])
        strips = strips | {"hair": strips["hair"].coarser(share, strips["hair"].rows)}
    return strips


def add_hair(dna: Dna, grown: Grown) -> None:
    """Adds the hair cards of all LODs to a finished face.

    Args:
        dna: the face; changed.
        grown: the hair; hairs of the beard that would enter the skin are cut or dropped.
    """
    # Meshes that not all people have come last, so that all other meshes have the same index in all
    # people. Mixing people needs this.
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
    """Raw controls float32[R] of each expression: alone, exaggerated, and with a smile added.

    Args:
        names: names of the raw controls.
    """
    alone = [pose_vector(face, names) for face in load().values()]
    smile = _OVER * pose_vector(_WIDEST, names)
    out = [*alone, *(_OVERDONE * face for face in alone), *(face + smile for face in alone)]
    return [np.minimum(face, 1) for face in out]


def hair_picture(person: Person, largest: int) -> dict[str, bytes]:
    """The texture of the hair: file name -> bytes of a PNG.

    Args:
        person: the person, with the hair colours.
        largest: a texture has at most as many texels as a square with this side.
    """
    return {PICTURE: png(shrunk(paint_strands(person), largest))}


def hair_metadata(dna: Dna, grown: Grown, person: Person) -> dict[str, str]:
    """Metadata: the meshes that show the hair texture, and the layout of their cards.

    `texture:<mesh>:color` is a file name. `hair:<mesh>` is "rows=R": the cards follow one another,
    each with R rows of two vertices from root to tip, which renderers of strands need.
    `coil:<mesh>` is "radius=R pitch=P" in millimetres, if strands are coiled about their path.

    Args:
        dna: the face with its meshes.
        grown: hair of the face.
        person: the person, with the hair's curl and length.
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
