# SPDX-License-Identifier: MIT
"""Pages with clients in chromium, and the same face by the file's numbers alone."""

from __future__ import annotations

import base64
import contextlib
import functools
import http.server
import json
import sys
import threading
from collections.abc import AsyncIterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent
PROJECT = HERE.parents[2]
sys.path[:0] = [str(HERE.parent / "web"), str(PROJECT / "tests" / "python" / "support")]

from browser import Browser, browser  # noqa: E402
from gltf_oracle import GlbFile  # noqa: E402

LOD = 2
CLIENT_MM, QUANTIZED_MM = 0.05, 0.2


class _Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, format: str, *args: Any) -> None:
        del format, args


@contextlib.asynccontextmanager
async def page(folder: Path, name: str, wide: int = 700, high: int = 800) -> AsyncIterator[Browser]:
    """A page of a folder, ready; what it says of errors ends the check."""
    handler = functools.partial(_Quiet, directory=str(folder))
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        async with browser() as one:
            address = f"http://127.0.0.1:{server.server_port}/{name}"
            state = await one.open_address(address, wide, high)
            if state != "ready":
                raise RuntimeError(f"the page is {state}: {one.said}")
            yield one
            if one.said:
                raise RuntimeError(f"the page said: {one.said}")
    finally:
        server.shutdown()


def places(found: Mapping[str, str]) -> dict[str, Any]:
    """Mesh -> float64[V, 3], of what a page packed."""
    return {
        name: np.frombuffer(base64.b64decode(text), "<f4").reshape(-1, 3).astype(np.float64)
        for name, text in found.items()
    }


def apart(a: Mapping[str, Any], b: Mapping[str, Any]) -> float:
    """Millimetres of the vertex that is farthest away."""
    assert a.keys() == b.keys(), (sorted(a), sorted(b))
    return max(1000 * float(np.linalg.norm(a[n] - b[n], axis=1).max()) for n in a)


def from_the_file(
    found: GlbFile, state: Mapping[str, Any], mixes: Mapping[str, Mapping[str, float]]
) -> float:
    """Millimetres between a client and the file at the client's weights and on its joints.

    Args:
        found: the file.
        state: of places.js.
        mixes: targets that the client made itself -> those of the file that they are sums of.
    """
    numbers = {node["name"]: i for i, node in enumerate(found.json["nodes"])}
    world = {
        numbers[name]: np.array(matrix).reshape(4, 4).T for name, matrix in state["joints"].items()
    }
    own = {}
    for mesh, weights in state["weights"].items():
        names, on = found.names(mesh), dict[str, float]()
        for name, weight in weights.items():
            for target, share in mixes.get(name, {}).items() if name not in names else [(name, 1)]:
                on[target] = on.get(target, 0.0) + share * weight
        own[mesh] = found.positions(mesh, on, world=world)
    return apart(places(state["places"]), own)


def listed(folder: Path, client: str, target: str, away: float) -> None:
    """A row of targets.tsv: client, target, millimetres from the rig at that pose alone."""
    with (folder / "targets.tsv").open("a") as table:
        table.write(f"{client}\t{target}\t{away:.4f}\n")


def say(value: object) -> str:
    """As a page takes it."""
    return json.dumps(value)
