# SPDX-License-Identifier: MIT
"""Converts the swinging chains of a VRM body, such as a skirt's, to the exported file's nodes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from ...base.given import GivenError, finite, shown
from ..avatar.springs import Collider, Spring, Springs
from .reading import Body

Doubles = npt.NDArray[np.float64]


def springs_of(body: Body, places: Doubles, turns: Doubles, flip: Doubles) -> Springs:
    """The chains and colliders of a body; none if the body is no VRM.

    Args:
        body: the body, with its file.
        places, turns: float64[n, 3] and float64[n, 3, 3], positions of its nodes in the exported
            scene in metres, and rotations from the nodes' axes to the scene's.
        flip: float64[3], 1 or -1 per axis; -1 where the exported file's axis is opposite.

    Raises:
        AnimationFileError: a spring refers to a node or collider that does not exist.
    """
    extensions = body.document.json.get("extensions")
    tables = extensions if isinstance(extensions, dict) else {}
    new, old = tables.get("VRMC_springBone"), tables.get("VRM")
    reader = _Reader(body, places, turns, flip)
    if isinstance(new, dict):
        return reader.new(new)
    second = old.get("secondaryAnimation") if isinstance(old, dict) else None
    return reader.old(second) if isinstance(second, dict) else Springs()


class _Reader:
    def __init__(self, body: Body, places: Doubles, turns: Doubles, flip: Doubles) -> None:
        self._body, self._places, self._turns, self._flip = body, places, turns, flip
        self._down = np.diag(body.to_scene)[:3] / body.scale * flip

    def new(self, table: Mapping[str, Any]) -> Springs:
        """Read the chains from VRM 1.0's table VRMC_springBone. A chain takes its numbers,
        such as the stiffness, from its first joint, although VRM lets each joint have its own."""
        at = "VRMC_springBone"
        colliders = [
            self._collider(row, f"{at}.colliders[{i}]")
            for i, row in enumerate(_rows(table, "colliders"))
        ]
        groups = [_numbers(row, "colliders") for row in _rows(table, "colliderGroups")]
        out = list[Spring]()
        for i, row in enumerate(_rows(table, "springs")):
            place = f"{at}.springs[{i}]"
            joints = _rows(row, "joints")
            nodes = [self._node(joint.get("node"), place) for joint in joints]
            if not nodes:
                continue
            first = joints[0]
            radius = self._size(joints[0]["node"])
            out.append(Spring(
                str(row.get("name") or f"Spring{i}"), nodes,
                self._named(row, groups, len(colliders), place),
                self._number(first, "hitRadius", 0.0, place) * radius,
                self._number(first, "stiffness", 1.0, place),
                self._number(first, "dragForce", 0.5, place),
                self._number(first, "gravityPower", 0.0, place),
                self._direction(first.get("gravityDir", [0.0, -1.0, 0.0]), place),
                self._node(row["center"], place) if "center" in row else -1,
            ))  # fmt: skip
        return Springs(out, colliders)

    def old(self, table: Mapping[str, Any]) -> Springs:
        """Read VRM 0.x's table secondaryAnimation: listed bones swing with all nodes below them."""
        at, colliders, groups = "VRM.secondaryAnimation", list[Collider](), list[list[int]]()
        for i, row in enumerate(_rows(table, "colliderGroups")):
            place, group = f"{at}.colliderGroups[{i}]", list[int]()
            for ball in _rows(row, "colliders"):
                group.append(len(colliders))
                x, y, z = self._vector(ball.get("offset"), place)
                radius = self._number(ball, "radius", 0.0, place)
                colliders.append(self._ball(row.get("node"), [x, y, -z], radius, place))
            groups.append(group)
        out = list[Spring]()
        for i, row in enumerate(_rows(table, "boneGroups")):
            place, bones = f"{at}.boneGroups[{i}]", row.get("bones")
            for bone in bones if isinstance(bones, list) else []:
                down = self._vector(row.get("gravityDir"), place) if "gravityDir" in row else None
                center = row.get("center", -1)
                made = Spring(
                    str(row.get("comment") or f"Spring{i}"), [self._node(bone, place)],
                    self._named(row, groups, len(colliders), place),
                    self._number(row, "hitRadius", 0.0, place) * self._size(bone),
                    self._number(row, "stiffiness", 1.0, place),
                    self._number(row, "dragForce", 0.5, place),
                    self._number(row, "gravityPower", 0.0, place),
                    self._direction(down or [0.0, -1.0, 0.0], place),
                    self._node(center, place) if isinstance(center, int) and center >= 0 else -1,
                )  # fmt: skip
                out += self._branches(made)
        return Springs(out, colliders)

    def _branches(self, spring: Spring) -> Iterator[Spring]:
        """A chain along the first child of each node, and a branch from every other child.

        VRM 0.x lists only the first node of a tree that swings.
        """
        below = dict[int, list[int]]()
        for node, parent in enumerate(self._body.parents):
            below.setdefault(parent, []).append(node)
        waiting = [(spring.nodes[0], False)]
        while waiting:
            node, is_branch = waiting.pop()
            chain = [node]
            while chain[-1] in below:
                first, *others = below[chain[-1]]
                waiting += [(other, True) for other in others]
                chain.append(first)
            if len(chain) > 1 or not is_branch:
                yield Spring(**{**vars(spring), "nodes": chain, "is_branch": is_branch})

    def _collider(self, row: Mapping[str, Any], place: str) -> Collider:
        shape = row.get("shape")
        shapes: Mapping[str, Any] = shape if isinstance(shape, dict) else {}
        own: Mapping[str, Any] = next(
            (shapes[k] for k in ("sphere", "capsule") if isinstance(shapes.get(k), dict)), {}
        )
        offset = self._vector(own.get("offset", [0.0] * 3), place)
        tail = self._vector(own["tail"], place) if "tail" in own else None
        radius = self._number(own, "radius", 0.0, place)
        return self._ball(row.get("node"), offset, radius, place, tail)

    def _ball(
        self, node: object, offset: list[float], radius: float, place: str,
        tail: list[float] | None = None,
    ) -> Collider:  # fmt: skip
        own = self._node(node, place)
        ends = [self._moved(node, end, own) for end in ([offset, tail] if tail else [offset])]
        return Collider(own, ends[0], radius * self._size(node), ends[1] if tail else None)

    def _moved(self, node: Any, offset: list[float], own: int) -> list[float]:
        """An offset in metres, in the axes of the exported node `own`.

        Args:
            node: number of a node in the body's file.
            offset: a point in the axes of this node.
            own: index of the exported node from which the result is measured.
        """
        at = (self._body.world[node] @ [*offset, 1.0])[:3] - self._body.places[own]
        return list(map(float, self._turns[own].T @ (at * self._flip)))

    def _size(self, node: Any) -> float:
        """The length in metres of one unit in the axes of a node."""
        return float(np.cbrt(abs(np.linalg.det(self._body.world[node][:3, :3]))))

    def _node(self, node: object, place: str) -> int:
        self._body.document.item("nodes", node, place)
        if node not in self._body.of_node:
            raise self._body.document.fail(
                place, f"a node of the skeleton was expected, found node {node}"
            )
        return self._body.of_node[node]

    def _named(
        self, row: Mapping[str, Any], groups: list[list[int]], count: int, place: str
    ) -> list[int]:
        """Indices of the colliders in the groups to which a chain's row refers.

        Args:
            row: table of the chain.
            groups: for each collider group, the indices of its colliders.
            count: number of colliders.
            place: name of the row for errors.
        """
        found = row.get("colliderGroups")
        out = list[int]()
        for group in found if isinstance(found, list) else []:
            if not isinstance(group, int) or not 0 <= group < len(groups):
                raise self._body.document.fail(
                    f"{place}.colliderGroups",
                    f"collider group numbers below {len(groups)} were expected, "
                    f"found {shown(group)}",
                )
            out += groups[group]
        if any(not isinstance(c, int) or not 0 <= c < count for c in out):
            raise self._body.document.fail(place, f"collider numbers below {count} were expected")
        return list(dict.fromkeys(out))

    def _number(self, row: Mapping[str, Any], key: str, default: float, place: str) -> float:
        try:
            return finite(row.get(key, default))
        except GivenError as error:
            raise self._body.document.fail(f"{place}.{key}", str(error)) from None

    def _vector(self, value: object, place: str) -> list[float]:
        """Three numbers, from a list or from a table with the keys x, y and z."""
        if isinstance(value, dict):
            value = [value.get(axis, 0.0) for axis in "xyz"]
        table = {"offset": value} if value is not None else {}
        return self._body.document.finite(table, "offset", [0.0] * 3, place).tolist()

    def _direction(self, value: object, place: str) -> list[float]:
        return [float(v) for v in np.array(self._vector(value, place)) * self._down]


def _rows(table: Mapping[str, Any], key: str) -> list[dict[str, Any]]:
    """The tables in the list `table[key]`; other items of the list become empty tables."""
    found = table.get(key)
    return (
        [row if isinstance(row, dict) else {} for row in found] if isinstance(found, list) else []
    )


def _numbers(table: Mapping[str, Any], key: str) -> list[Any]:
    found = table.get(key)
    return found if isinstance(found, list) else []
