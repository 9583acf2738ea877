# SPDX-License-Identifier: GPL-3.0-or-later
"""Shares equal data between characters of a .blend: Texts of DNA files, packed images.

An image is shared until any tool edits it. Then the other characters get a copy of the unedited
image. A marked image is an image on which `mark` stored the digest of its packed bytes. Meshes and
shape keys are never shared, because the values of shape keys belong to one face.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import bpy

from . import parts, session, storage
from .blender_types import ArmatureObject, Node, NodeTree, current_context

DIGEST = "risorius_sha256"  # on an image: hash of the packed file
STATE = "risorius_state"  # on an image: colour space, alpha mode and size of the packed file

# SHA-256 digest -> packed bytes of an image that the materials of several characters use.
_kept: dict[str, bytes] = session.table("sharing.kept", ("unregister",))


def mark(image: bpy.types.Image, digest: str = "") -> None:
    """Store the hash of an image's packed bytes, so that the image can be shared.

    Args:
        image: images without packed bytes are ignored.
        digest: storage.hash_of the packed bytes, if known.
    """
    content = _packed(image)
    if content is not None:
        image[DIGEST], image[STATE] = digest or storage.hash_of(content), _state(image)


def find(content: bytes, digest: str, data: bool) -> bpy.types.Image | None:
    """An unedited image of this .blend with these bytes, or None.

    Args:
        content: bytes of an image file.
        digest: storage.hash_of the content.
        data: True: find an image of non-colour data; False: an image of colours.
    """
    for image in bpy.data.images:
        if image.get(DIGEST) != digest or image.library is not None or _edited(image):
            continue
        if _space(image).is_data == data and _packed(image) == content:
            return image
    return None


def nodes_of(rig: ArmatureObject) -> Iterator[Node]:
    """The image nodes in the materials of a character's meshes."""
    used = {m for item in parts.meshes_pointing_at(rig) for m in item.data.materials if m}
    for material in sorted(used, key=lambda m: m.name):
        tree: NodeTree = material.node_tree
        for node in tree.nodes if tree else ():
            if node.type == "TEX_IMAGE" and node.image is not None:
                yield node


def keep() -> None:
    """Keep the bytes of shared images in memory, because an edit would lose them."""
    owned = _owners(parts.rigs()).items()
    shown = {_noted(image)[0]: image for image, owners in owned if len(owners) > 1}
    for digest in [d for d in _kept if d not in shown]:
        del _kept[digest]
    for digest, image in shown.items():
        content = _packed(image)
        if digest not in _kept and content is not None and _is_whole(image, digest):
            _kept[digest] = content


def separate(exact: bool = False, spaces: bool = True) -> list[str]:
    """Give characters a copy of the unedited image, if a shared image was edited.

    The edited image stays with the active character, or with the first character that shows it. If
    the bytes of the unedited image are not known, all characters keep the edited image.

    Args:
        exact: compare packed bytes too, which is slow; used before a save.
        spaces: compare colour spaces too, which takes 9 us per image; all other checks take 2 us.

    Returns:
        Sentences about changes.
    """
    ours = [i for i in bpy.data.images if DIGEST in i and i.library is None]
    edited = [i for i in ours if _edited(i, spaces) or (exact and i.users > 1 and not _is_whole(i))]
    if not edited:
        return []
    owners = _owners(parts.rigs())
    return [sentence for image in edited for sentence in _separate(image, owners.get(image, []))]


def share() -> list[str]:
    """Before a save: share equal data of characters, and separate edited images.

    Returns:
        Sentences about changes.
    """
    rigs = parts.rigs()
    done = separate(exact=True)
    if len(rigs) < 2:
        return done
    _share_texts(rigs)
    first = {}
    for image in _images(rigs):
        if image.library is None and image.source == "FILE" and image.packed_file:
            if DIGEST not in image and not image.is_dirty:
                mark(image)
            if DIGEST in image:
                first.setdefault(_noted(image), []).append(image)
    for equal in first.values():
        _merge(equal, rigs)
    keep()
    return done


def _share_texts(rigs: Sequence[ArmatureObject]) -> None:
    texts = []
    for rig in rigs:
        own = rig.get(parts.DNA)
        if not storage.content_hash(own) or own.library or rig.override_library:
            continue
        keeper = next((t for t in texts if storage.same(t, own)), None)
        if keeper is None:
            texts.append(own)
        elif keeper != own:
            parts.point(rig, parts.DNA, keeper)
            if own.users == 0:
                bpy.data.texts.remove(own)


def _merge(equal: Sequence[bpy.types.Image], rigs: Sequence[ArmatureObject]) -> None:
    keeper, content = equal[0], _packed(equal[0])
    for image in equal[1:]:
        if _packed(image) != content:
            continue
        _show_instead(rigs, image, keeper)
        if image.users == 0:
            bpy.data.images.remove(image)


def _show_instead(
    rigs: Iterable[ArmatureObject], image: bpy.types.Image, other: bpy.types.Image
) -> None:
    """Replace `image` by the image `other` in the materials of characters."""
    for rig in rigs:
        for node in nodes_of(rig):
            if node.image == image and node.id_data.library is None:
                node.image = other


def _separate(image: bpy.types.Image, owners: Sequence[ArmatureObject]) -> list[str]:
    digest, state = _noted(image)
    for key in {DIGEST, STATE} & set(image.keys()):
        del image[key]
    active = parts.rig_of(current_context().view_layer.objects.active)
    keeper = active if active in owners else next(iter(owners), None)
    others = [rig for rig in owners if rig != keeper]
    if not others:
        return []
    content = _kept.get(digest) or (_packed(image) if _is_whole(image, digest) else None)
    if content is None:
        return [f"The image {image.name} was changed for all faces that show it."]
    fresh = _image_of(content, image, state)
    _show_instead(others, image, fresh)
    return [f"The image {image.name} was edited: the other faces keep it as it was."]


def _image_of(content: bytes, image: bpy.types.Image, state: str) -> bpy.types.Image:
    """Make a new image from packed bytes.

    Args:
        content: bytes of an image file.
        image: the edited image; the new image gets its name and path.
        state: colour space and alpha mode of the new image, in two lines. If they are invalid, the
            settings of `image` are used.
    """
    space, alpha = (*state.split("\n"), "")[:2]
    fresh = bpy.data.images.new(image.name, 1, 1)
    fresh.pack(data=content, data_len=len(content))
    fresh.source = "FILE"
    fresh.filepath_raw = image.filepath_raw
    for found in (space, _space(image).name):
        if _takes(_space(fresh), "name", found):
            break
    for found in (alpha, image.alpha_mode):
        if _takes(fresh, "alpha_mode", found):
            break
    mark(fresh)
    return fresh


def _takes(owner: bpy.types.bpy_struct, name: str, choice: str) -> bool:
    """Set an enum property, and return whether the property accepts the given choice."""
    try:
        setattr(owner, name, choice)
    except TypeError:
        return False
    return True


def _noted(image: bpy.types.Image) -> tuple[str, str]:
    """The digest and the state that `mark` stored on an image, converted to text.

    The conversion is needed because users can change the types of these custom properties.
    """
    return str(image.get(DIGEST)), str(image.get(STATE))


def _images(rigs: Iterable[ArmatureObject]) -> list[bpy.types.Image]:
    """The images in the materials of these characters, without repetition."""
    return list(dict.fromkeys(node.image for rig in rigs for node in nodes_of(rig)))


def _owners(rigs: Iterable[ArmatureObject]) -> dict[bpy.types.Image, list[ArmatureObject]]:
    """Marked local image -> the characters whose materials show it."""
    found = {}
    for rig in rigs:
        for image in _images([rig]):
            if DIGEST in image and image.library is None:
                found.setdefault(image, []).append(rig)
    return found


def _packed(image: bpy.types.Image) -> bytes | None:
    """The bytes that are packed in an image, or None."""
    return bytes(image.packed_file.data) if image.packed_file is not None else None


def _is_whole(image: bpy.types.Image, digest: str | None = None) -> bool:
    """Whether an image's packed bytes have the given digest; None: the digest stored by `mark`."""
    content = _packed(image)
    wanted = _noted(image)[0] if digest is None else digest
    return content is not None and storage.hash_of(content) == wanted


def _space(image: bpy.types.Image) -> Any:  # noqa: ANN401  its names are those of the configuration
    return image.colorspace_settings


def _state(image: bpy.types.Image, space: str = "") -> str:
    size = image.packed_file.size if image.packed_file is not None else 0
    return f"{space or _space(image).name}\n{image.alpha_mode}\n{size}"


def _edited(image: bpy.types.Image, spaces: bool = True) -> bool:
    noted = _noted(image)[1]
    space = "" if spaces else noted.partition("\n")[0]
    return image.is_dirty or noted != _state(image, space)
