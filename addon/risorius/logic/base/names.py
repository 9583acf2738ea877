# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes labels of names: shortens them to Blender's limit, and numbers repeated ones."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

MAX_BYTES = 63
LISTED = 8  # most labels that a sentence lists


def cut(name: str, limit: int = MAX_BYTES) -> str:
    """Shorten a name to at most `limit` bytes of UTF-8, never inside a character.

    Args:
        name: any text; bytes that are not UTF-8 appear as lone surrogates.
        limit: largest number of bytes.

    Returns:
        Valid UTF-8 without zero bytes; "unnamed" for an empty text.
    """
    clean = name.encode("utf-8", "surrogateescape").decode("utf-8", "replace")
    clean = clean.replace("\0", "") or "unnamed"
    return clean.encode("utf-8")[:limit].decode("utf-8", "ignore")


def listed(labels: Sequence[str], most: int = LISTED) -> str:
    """A list of labels for a sentence: the first ones, and the number of others.

    Args:
        labels: at least one.
        most: largest number of listed labels.
    """
    shown = ", ".join(labels[:most])
    return f"{shown} and {len(labels) - most} more" if len(labels) > most else shown


def unique_labels(names: Iterable[str], taken: Iterable[str] = ()) -> list[str]:
    """One label for each name: at most 63 bytes, all different, also from `taken`.

    Args:
        names: names in index order; long and repeated ones are allowed.
        taken: labels that already exist and must not be used again.

    Returns:
        Labels in the order of `names`. Of several equal names, the first stays unchanged if it is
        short enough and not in `taken`.
    """
    used = set(taken)
    labels = []
    for name in names:
        label = cut(name)
        number = 0
        while label in used:
            number += 1
            suffix = f".{number:03d}"
            label = cut(name, MAX_BYTES - len(suffix)) + suffix
        used.add(label)
        labels.append(label)
    return labels


def without_lod(mesh_name: str) -> str:
    """The mesh's name without its level of detail: `head_lod0_mesh` gives `head`."""
    words = [w for w in mesh_name.split("_") if w]
    kept = [w for w in words if not (w.lower().startswith("lod") and w[3:].isdigit())]
    if len(kept) > 1 and kept[-1].lower() == "mesh":
        kept.pop()
    return "_".join(kept) or mesh_name


def printable(text: str, limit: int = 400) -> str:
    """A text from a file for display: one line, with `?` for unprintable characters.

    A zero byte would end the text where Blender shows it.

    Args:
        text: the text of the file.
        limit: largest number of letters; a longer text ends in "...".
    """
    shown = "".join(c if c.isprintable() else " " if c.isspace() else "?" for c in text)
    return shown if len(shown) <= limit else f"{shown[: limit - 3]}..."
