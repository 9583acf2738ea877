# SPDX-License-Identifier: MIT
"""Adds swinging joints to long hair.

Hanging hair cards are grouped into bundles by their direction from the head's centre, and each
bundle gets one chain of joints.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from ...base.easing import smooth_step
from .skeleton import Skeleton
from .weights import INFLUENCES, strongest

Doubles = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

HANGS = 0.04  # metres between the root and the tip of a card that swings
_BUNDLES = 12
_SEGMENT = 0.05  # metres between joints
_JOINTS = (2, 4)  # fewest and most joints of a chain
_WIDEST = 0.15  # metres: a wider piece is hair in one piece, which no chain can follow
# metres: vertices this far above or below a joint have weight 1/e in the mean that places the joint
_BAND = 0.015
# fraction of a card's height, from its root, in which the weight passes from the head to the chain
_FIRM = 0.3
_FEWEST = 12  # smallest number of hair roots to which a sphere is fitted
_SKULL = (0.05, 0.11)  # metres: smallest and largest radius of the skull's sphere
_HIT = 0.01  # metres: radius of the sphere around a joint that collides with the skull


@dataclass(frozen=True)
class Hair:
    """A mesh of hair cards.

    Attributes:
        points: float64[V, 3], metres, y up.
        rows: int64[V], a number per vertex; vertices at one point of the face have equal numbers.
        triangles: int64[T, 3], vertices of each triangle.
        joints, weights: int64[V, 4], float64[V, 4], the skin weights of each vertex.
    """

    points: Doubles
    rows: Ints
    triangles: Ints
    joints: Ints
    weights: Doubles


@dataclass(frozen=True)
class Chains:
    """Chains of joints that swing, and a sphere in the head that they do not enter.

    Attributes:
        joints: per chain, the indices of its joints from the root to the tip; the tip moves no
            vertex.
        centre: float64[3], centre of the sphere in metres.
        radius: radius of the sphere in metres.
        hit: radius in metres of the sphere around each joint that collides with the head's sphere.
    """

    joints: list[list[int]] = field(default_factory=list)
    centre: Doubles = field(default_factory=lambda: np.zeros(3))
    radius: float = 0.0
    hit: float = _HIT


@dataclass(frozen=True)
class Cards:
    """The hair cards of a mesh.

    Attributes:
        of_vertex: int64[V], the card of each vertex.
        root, tip: float64[cards], heights of each card's highest and lowest vertex in metres.
        middle: float64[cards, 3], mean of each card's vertices in metres.
        roots: float64[cards, 3], the highest vertex of each card in metres.
        hangs: bool[cards], whether the card is long and narrow enough to swing.
    """

    of_vertex: Ints
    root: Doubles
    tip: Doubles
    middle: Doubles
    roots: Doubles
    hangs: npt.NDArray[np.bool_]


def is_long(points: Doubles, triangles: Ints) -> bool:
    """Whether a mesh of hair has a card less than 15 cm wide whose tip is more than HANGS (4 cm)
    below its root.

    Args:
        points: float64[V, 3], metres, y up.
        triangles: int64[T, 3], vertices of each triangle.
    """
    return len(triangles) > 0 and bool(
        find_cards(points, np.arange(len(points)), triangles).hangs.any()
    )


def add_chains(skeleton: Skeleton, hairs: Sequence[Hair]) -> tuple[Skeleton, Chains, list[Hair]]:
    """Add chains of joints for long hair below the head's joint.

    The root of a card keeps the head's weight; towards the tip the weight passes to the chain. No
    vertex moves until a joint does.

    Args:
        skeleton: joints of the face.
        hairs: the face's meshes of long hair.

    Returns:
        The extended skeleton, its chains, and the meshes with changed skin weights.
    """
    cards = [find_cards(hair.points, hair.rows, hair.triangles) for hair in hairs]
    chains = Chains(centre=skeleton.places[skeleton.head])
    if not any(one.hangs.any() for one in cards):
        return skeleton, chains, list(hairs)
    roots = np.concatenate([one.roots for one in cards])
    centre, radius = _skull(roots, skeleton.places[skeleton.head])
    names, parents, places = list(skeleton.names), list(skeleton.parents), list(skeleton.places)
    made = list(hairs)
    bundles = [_bundle(one.middle - centre) for one in cards]
    for bundle in range(_BUNDLES):
        members = [one.hangs & (of == bundle) for one, of in zip(cards, bundles, strict=True)]
        if not any(member.any() for member in members):
            continue
        line = _line(hairs, cards, members)
        chain = list(range(len(names), len(names) + len(line)))
        names += [f"Hair{len(chains.joints) + 1}_{i + 1}" for i in range(len(line))]
        parents += [skeleton.head, *chain[:-1]]
        places += list(line)
        chains.joints.append(chain)
        for i, one in enumerate(cards):
            made[i] = _woven(made[i], one, members[i], chain, line[:, 1])
    tails = np.array([places[joint] for chain in chains.joints for joint in chain[1:]])
    free = float(np.linalg.norm(tails - centre, axis=1).min()) - _HIT
    straight = np.tile(np.eye(3), (len(names) - len(skeleton.names), 1, 1))
    turns = np.concatenate([skeleton.turns, straight])
    out = replace(skeleton, names=names, parents=parents, places=np.array(places), turns=turns)
    return out, replace(chains, centre=centre, radius=max(0.01, min(radius, free))), made


def find_cards(points: Doubles, rows: Ints, triangles: Ints) -> Cards:
    """Split a mesh into cards: pieces that are not connected to each other.

    Args:
        points: float64[V, 3], metres, y up.
        rows: int64[V], a number per vertex; equal numbers connect vertices at one point.
        triangles: int64[T, 3], vertices of each triangle.
    """
    _, place = np.unique(rows, return_inverse=True)
    corners = place[triangles]
    label = np.arange(int(place.max(initial=-1)) + 1)
    while True:  # each piece takes its lowest number
        low = label[corners].min(axis=1)
        new = label.copy()
        np.minimum.at(new, corners.ravel(), np.repeat(low, 3))
        new = new[new]
        if np.array_equal(new, label):
            break
        label = new
    _, card = np.unique(label[place], return_inverse=True)
    count = int(card.max(initial=-1)) + 1
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, card, points)
    np.maximum.at(high, card, points)
    sums = np.stack([np.bincount(card, points[:, k], count) for k in range(3)], axis=1)
    middle = sums / np.maximum(np.bincount(card, minlength=count), 1)[:, None]
    order = np.lexsort((-points[:, 1], card))  # the highest vertex of each card is its root
    first = order[np.searchsorted(card[order], np.arange(count))]
    wide = np.maximum(high[:, 0] - low[:, 0], high[:, 2] - low[:, 2])
    hangs = (high[:, 1] - low[:, 1] > HANGS) & (wide < _WIDEST)
    return Cards(card, high[:, 1], low[:, 1], middle, points[first], hangs)


def _bundle(away: Doubles) -> Ints:
    """int64[n], the bundle of each card: the sector about the y axis of its direction `away`.

    Args:
        away: float64[n, 3], from the head's centre to the middle of each card.
    """
    angle = np.arctan2(away[:, 0], away[:, 2])
    return np.rint(angle / (2 * np.pi) * _BUNDLES).astype(np.int64) % _BUNDLES


def _skull(roots: Doubles, head: Doubles) -> tuple[Doubles, float]:
    """Centre and radius in metres of a sphere for the skull, fitted to the hair roots.

    Args:
        roots: float64[n, 3], the root of each hair card in metres.
        head: float64[3], position of the head's joint in metres.
    """
    guess = head + np.array([0.0, 0.07, 0.0])
    if len(roots) < _FEWEST:
        return guess, 0.08
    middle = roots.mean(axis=0)
    rows = np.c_[2 * (roots - middle), np.ones(len(roots))]
    found, _, rank, _ = np.linalg.lstsq(rows, ((roots - middle) ** 2).sum(axis=1), rcond=1e-6)
    square = float(found[3] + found[:3] @ found[:3])
    if rank < 4 or square <= 0 or not _SKULL[0] <= square**0.5 <= 2 * _SKULL[1]:
        return guess, 0.08
    return middle + found[:3], min(_SKULL[1], 0.95 * square**0.5)


def _line(
    hairs: Sequence[Hair], cards: Sequence[Cards], members: Sequence[npt.NDArray[np.bool_]]
) -> Doubles:
    """float64[n, 3], joints of a bundle at evenly spaced heights.

    Each joint is at the mean position of the bundle's hair near its height.

    Args:
        hairs: the meshes.
        cards: the hair cards of each mesh.
        members: for each mesh, bool[cards], whether a card belongs to the bundle.
    """
    picked = list(zip(hairs, cards, members, strict=True))
    top = float(np.mean(np.concatenate([one.root[member] for _, one, member in picked])))
    low = float(np.percentile(np.concatenate([one.tip[member] for _, one, member in picked]), 25))
    low = min(low, top - HANGS / 2)
    points = np.concatenate([hair.points[m[one.of_vertex]] for hair, one, m in picked])
    heights = np.linspace(top, low, int(np.clip(np.rint((top - low) / _SEGMENT) + 1, *_JOINTS)))
    away = np.abs(points[:, 1] - heights[:, None])
    near = np.exp(-((away / _BAND) ** 2)) + 1e-9 * (away == away.min(axis=1, keepdims=True))
    line = near @ points / near.sum(axis=1, keepdims=True)
    line[:, 1] = heights
    return line


def _woven(
    hair: Hair, cards: Cards, member: npt.NDArray[np.bool_], chain: list[int], heights: Doubles
) -> Hair:
    """Hair in which the cards of one bundle have skin weights of the bundle's chain.

    Args:
        hair: the mesh.
        cards: the hair cards of the mesh.
        member: bool[cards], whether a card belongs to the bundle.
        chain: indices of the bundle's joints, from the root to the tip.
        heights: float64[joints], heights of these joints in metres.
    """
    vertices = np.flatnonzero(member[cards.of_vertex])
    if not len(vertices):
        return hair
    card, height = cards.of_vertex[vertices], hair.points[vertices, 1]
    own = (cards.root[card] - height) / (cards.root[card] - cards.tip[card])
    share = smooth_step(own / _FIRM)
    moving = len(chain) - 1
    along = np.interp(-height, -heights, np.arange(len(heights))) - 0.5
    upper = np.clip(np.floor(along).astype(np.int64), -1, moving - 1)
    lower = np.minimum(upper + 1, moving - 1)
    part = np.clip(along - upper, 0, 1)
    every = np.arange(len(vertices))
    dense = np.zeros((len(vertices), max(INFLUENCES, chain[-1] + 1)))
    pulled = np.zeros_like(dense)
    for number, weight in ((upper, (1 - part) * share), (lower, part * share)):
        # Above the middle between the first two joints there is no upper joint (number -1): the
        # upper part of the weight stays with the head, and the first joint gets the lower part.
        np.add.at(pulled, (every, np.array(chain)[number]), np.where(number < 0, 0.0, weight))
    for k in range(hair.joints.shape[1]):
        np.add.at(dense, (every, hair.joints[vertices, k]), hair.weights[vertices, k])
    dense = dense * (1 - pulled.sum(axis=1, keepdims=True)) + pulled
    joints, weights = hair.joints.copy(), hair.weights.copy()
    joints[vertices], weights[vertices] = strongest(dense)
    return replace(hair, joints=joints, weights=weights)
