# SPDX-License-Identifier: MIT
"""Finds the kind of a mesh, such as skin or hair, by its name."""

from __future__ import annotations

# (kind, parts of names). The first kind whose part matches counts, so that a mesh of eyelashes is
# not of the kind eyes.
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
