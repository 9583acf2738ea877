# SPDX-License-Identifier: MIT
"""A face's joints on the bones of a body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from ..body.reading import Body
from ..errors import GameFaceError
from .skeleton import Skeleton

Doubles = npt.NDArray[np.float64]

_EYES = ("leftEye", "rightEye")
_DEEP = 0.03  # metres


def hung(skeleton: Skeleton, body: Body) -> tuple[Skeleton, Doubles]:
    """The joints of a face where the body has them, and float64[3] metres that the face moves.

    The middle of the eyes meets the middle of the body's eye bones, else the head meets the head
    bone. The heads also meet in depth if the eye bones lie deeper in the head, or less deep, by
    more than 3 cm. The root of the face becomes the node below the body's neck.

    Args:
        skeleton: of the face alone.
        body: with its bones.

    Raises:
        GameFaceError: the face has no joint of a head.
    """
    own = skeleton.bones
    if "head" not in own:
        raise GameFaceError("a joint called head was expected, which a body's head bone takes")
    meet = _EYES if all(n in own and n in body.bones for n in _EYES) else ("head",)
    move = _apart(skeleton, body, meet)
    heads = _apart(skeleton, body, ("head",))
    if abs(move[2] - heads[2]) > _DEEP:  # eyes of drawn characters turn about points far inside
        move[2] = heads[2]
    places, turns, parents = skeleton.places + move, skeleton.turns.copy(), list(skeleton.parents)
    trunk = body.above("neck")
    hooks = {0: trunk, own["head"]: body.bones["head"]}
    if "neck" in own:
        hooks[own["neck"]] = body.bones.get("neck", trunk)
    places[0], turns[0] = body.places[trunk], body.turns[trunk]
    for name, joint in own.items():
        if name not in ("neck", "head") and parents[joint] == 0:
            parents[joint] = own["head"]
    return replace(skeleton, places=places, turns=turns, parents=parents, hooks=hooks), move


def _apart(skeleton: Skeleton, body: Body, names: Sequence[str]) -> Doubles:
    """float64[3], from the middle of some joints of the face to the middle of the body's bones."""
    here = skeleton.places[[skeleton.bones[n] for n in names]].mean(axis=0)
    return np.asarray(body.places[[body.bones[n] for n in names]].mean(axis=0) - here)
