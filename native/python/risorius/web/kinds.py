# SPDX-License-Identifier: MIT
"""Finds the kind of a mesh, such as skin or hair, by its name."""

from __future__ import annotations

# (kind, texts that the names of its meshes contain). The first kind with a matching text counts: a
# mesh of eyelashes has the kind lashes and not eyes.
_KINDS = (
    ("lashes", ("lash", "eyebrow")),
    ("hair", ("hair", "brow", "beard", "moustache", "mustache", "sideburn", "ponytail", "stubble")),
    ("wet", ("eyeshell", "eyeedge", "eye_edge", "saliva", "tear", "fluid", "cornea", "occlusion")),
    ("gum", ("cartilage", "caruncle", "gum")),
    ("eyes", ("eye", "iris", "sclera")),
    ("teeth", ("teeth", "tooth", "denture")),
    ("tongue", ("tongue",)),
    (
        "cloth",
        ("shirt", "cloth", "garment", "outfit", "jacket", "dress", "collar", "scarf", "sweater"),
    ),
)


def kind_of(name: str) -> str:
    """The kind of a mesh: skin, eyes, teeth, tongue, lashes, hair, wet, gum or cloth.

    Args:
        name: name of the mesh.
    """
    word = name.lower()
    return next((kind for kind, parts in _KINDS if any(p in word for p in parts)), "skin")
