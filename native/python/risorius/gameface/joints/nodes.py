# SPDX-License-Identifier: MIT
"""Makes glTF nodes with translation and rotation, without scale."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

Doubles = npt.NDArray[np.float64]


def node_of(name: str, away: Doubles, turn: Doubles, above: Doubles) -> dict[str, Any]:
    """The JSON table of a node.

    Args:
        name: name of the node.
        away: float64[3], metres from the parent to the node, in the scene's axes.
        turn: float64[3, 3], rotation from the node's axes to the scene's.
        above: float64[3, 3], rotation from the parent's axes to the scene's.
    """
    node: dict[str, Any] = {"name": name, "translation": (above.T @ away).tolist()}
    quaternion = _quaternion(above.T @ turn)
    if quaternion != [0, 0, 0, 1]:
        node["rotation"] = quaternion
    return node


def add_nodes(
    nodes: list[dict[str, Any]], names: Sequence[str], parents: Sequence[int], places: Doubles,
    turns: Doubles,
) -> None:  # fmt: skip
    """Add the nodes of a tree to an empty list.

    Args:
        nodes: empty list that receives the tables of the nodes.
        names: names of the nodes.
        parents: index of each node's parent, which comes before the node; -1 for a root.
        places: float64[n, 3], positions in the scene in metres.
        turns: float64[n, 3, 3], rotation from each node's axes to the scene's.
    """
    for i, name in enumerate(names):
        above = parents[i]
        place = places[above] if above >= 0 else np.zeros(3)
        turn = turns[above] if above >= 0 else np.eye(3)
        nodes.append(node_of(name, places[i] - place, turns[i], turn))
        if above >= 0:
            nodes[above].setdefault("children", []).append(i)


def _quaternion(turn: Doubles) -> list[float]:
    """The quaternion (x, y, z, w) of a rotation matrix."""
    x, y, z = np.diag(turn)
    squares = np.array([1 + x - y - z, 1 - x + y - z, 1 - x - y + z, 1 + x + y + z])
    largest = int(squares.argmax())  # the others are divided by it
    m = turn
    rows = (
        (squares[0], m[0, 1] + m[1, 0], m[2, 0] + m[0, 2], m[2, 1] - m[1, 2]),
        (m[0, 1] + m[1, 0], squares[1], m[1, 2] + m[2, 1], m[0, 2] - m[2, 0]),
        (m[2, 0] + m[0, 2], m[1, 2] + m[2, 1], squares[2], m[1, 0] - m[0, 1]),
        (m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], squares[3]),
    )
    row = np.array(rows[largest]) / (2 * np.sqrt(squares[largest]))
    return [float(v) + 0.0 for v in row / np.linalg.norm(row)]
