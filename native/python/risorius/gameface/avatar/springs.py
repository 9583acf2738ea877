# SPDX-License-Identifier: MIT
"""Writes swinging chains of nodes, such as strands of hair, as tables of VRM 1.0 and 0.x."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

EXTENSION = "VRMC_springBone"


@dataclass(frozen=True)
class Collider:
    """A sphere or capsule that chains do not enter.

    Attributes:
        node: number of the node that moves the collider.
        offset: metres from the node to the centre of the sphere, or to one end of the capsule, in
            the node's axes.
        radius: radius in metres.
        tail: metres from the node to the other end of a capsule; None for a sphere.
    """

    node: int
    offset: Sequence[float]
    radius: float
    tail: Sequence[float] | None = None


@dataclass(frozen=True)
class Spring:
    """A chain of nodes that swings.

    Attributes:
        name: name of the chain.
        nodes: numbers of its nodes, from the root to the tip, which only ends the chain.
        colliders: indices of the colliders that the chain does not enter.
        hit: radius in metres of the sphere around each node that collides with the colliders.
        stiffness: how strongly the chain returns to its rest pose, 0 to 4.
        drag: fraction of the swing's velocity that is lost in a step of the simulation, 0 to 1.
        gravity: strength of gravity, 0 to 2.
        down: direction of gravity in the scene's axes.
        center: number of a node whose motion does not swing the chain; -1 for none.
        is_branch: whether the chain begins at a node of another chain; VRM 0.x lists only the
            chain that it branches from.
    """

    name: str
    nodes: Sequence[int]
    colliders: Sequence[int] = ()
    hit: float = 0.01
    stiffness: float = 0.9
    drag: float = 0.4
    gravity: float = 0.05
    down: Sequence[float] = (0.0, -1.0, 0.0)
    center: int = -1
    is_branch: bool = False


@dataclass(frozen=True)
class Springs:
    """All chains of a file.

    Attributes:
        springs: the chains.
        colliders: the colliders to which the indices of the chains refer.
    """

    springs: Sequence[Spring] = field(default_factory=list)
    colliders: Sequence[Collider] = field(default_factory=list)

    def joined(self, other: Springs) -> Springs:
        """These chains and others in one object. Args: other: chains and colliders to append."""
        more = len(self.colliders)
        moved = [
            Spring(**{**vars(s), "colliders": [c + more for c in s.colliders]})
            for s in other.springs
        ]
        return Springs([*self.springs, *moved], [*self.colliders, *other.colliders])


def table_1(all_: Springs) -> dict[str, Any]:
    """The table of VRM 1.0's extension VRMC_springBone. Args: all_: chains of the file."""
    shapes = list[dict[str, Any]]()
    for one in all_.colliders:
        ball: dict[str, Any] = {"offset": list(one.offset), "radius": one.radius}
        shape = {"capsule": {**ball, "tail": list(one.tail)}} if one.tail else {"sphere": ball}
        shapes.append({"node": one.node, "shape": shape})
    groups = _groups(all_)
    out: dict[str, Any] = {"specVersion": "1.0", "colliders": shapes}
    out["colliderGroups"] = [
        {"name": f"Group{i}", "colliders": list(g)} for i, g in enumerate(groups)
    ]
    out["springs"] = [_chain_1(one, groups) for one in all_.springs]
    return {key: value for key, value in out.items() if value != []}


def _chain_1(one: Spring, groups: list[tuple[int, ...]]) -> dict[str, Any]:
    said = {
        "hitRadius": one.hit, "stiffness": one.stiffness, "gravityPower": one.gravity,
        "gravityDir": list(one.down), "dragForce": one.drag,
    }  # fmt: skip
    out: dict[str, Any] = {"name": one.name, "joints": [{"node": n, **said} for n in one.nodes]}
    if one.colliders:
        out["colliderGroups"] = [groups.index(tuple(one.colliders))]
    if one.center >= 0:
        out["center"] = one.center
    return out


def table_0(all_: Springs) -> dict[str, Any]:
    """The table secondaryAnimation of VRM 0.x. Args: all_: chains of the file."""
    groups, rows = list[dict[str, Any]](), list[dict[str, Any]]()
    of_collider = dict[int, int]()
    for number, one in enumerate(all_.colliders):
        of_collider[number] = len(groups)
        groups.append({"node": one.node, "colliders": list(_balls(one))})
    alike = dict[tuple[Any, ...], dict[str, Any]]()
    for spring in all_.springs:
        if spring.is_branch:
            continue
        said = {k: v for k, v in vars(spring).items() if k not in ("name", "nodes")}
        key = tuple(map(str, said.values()))
        if key not in alike:
            x, y, z = spring.down
            alike[key] = {
                "comment": spring.name, "stiffiness": spring.stiffness,
                "gravityPower": spring.gravity, "gravityDir": {"x": x, "y": y, "z": z},
                "dragForce": spring.drag, "center": spring.center, "hitRadius": spring.hit,
                "bones": [], "colliderGroups": [of_collider[c] for c in spring.colliders],
            }  # fmt: skip
            rows.append(alike[key])
        if spring.nodes[0] not in alike[key]["bones"]:
            alike[key]["bones"].append(spring.nodes[0])
    return {"boneGroups": rows, "colliderGroups": groups}


def _balls(one: Collider) -> list[dict[str, Any]]:
    """A collider as spheres, because VRM 0.x has no capsules.

    The z axis of VRM 0.x is opposite to the z axis of glTF.
    """
    ends = [one.offset]
    if one.tail:
        middle = [(a + b) / 2 for a, b in zip(one.offset, one.tail, strict=True)]
        ends = [one.offset, middle, one.tail]
    return [{"offset": {"x": x, "y": y, "z": -z}, "radius": one.radius} for x, y, z in ends]


def _groups(all_: Springs) -> list[tuple[int, ...]]:
    """The sets of collider indices that chains use; each set is listed once."""
    return list(dict.fromkeys(tuple(s.colliders) for s in all_.springs if s.colliders))
