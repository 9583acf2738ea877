# SPDX-License-Identifier: MIT
"""Attaches the joints of a face to the bones of a body."""

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
_DEEP = 0.03  # metres: if eyes and head joint differ more in depth, the head joint decides


def hung(skeleton: Skeleton, body: Body) -> tuple[Skeleton, Doubles]:
    """Move the joints of a face onto a body; also returns float64[3], the face's motion in metres.

    The midpoint of the face's eyes is moved to the midpoint of the body's eye bones. If the face or
    the body has no eye bones, the head joint is moved to the head bone. Only the depth (z) of the
    motion is also taken from the head joint and the head bone if it differs by more than 3 cm from
    the depth by the eyes. The face's root is replaced by the node above the body's neck. Other
    bones below the root, except neck and head, become children of the head.

    Args:
        skeleton: joints of the face alone.
        body: the body with its bones.

    Raises:
        GameFaceError: the face has no joint of a head.
    """
    own = skeleton.bones
    if "head" not in own:
        raise GameFaceError(
            "a joint called head was expected, because it is attached to the head bone of the body"
        )
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
    """float64[3], from the mean of the face's joints `names` to the mean of the body's
    bones of the same names."""
    here = skeleton.places[[skeleton.bones[n] for n in names]].mean(axis=0)
    return np.asarray(body.places[[body.bones[n] for n in names]].mean(axis=0) - here)
