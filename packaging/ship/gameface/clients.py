# SPDX-License-Identifier: MIT
"""Opens pages with three.js in chromium, and compares their vertices with the exported file."""

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
    """Serve a folder and open a page of it. An error of the page raises RuntimeError.

    Args:
        folder: the folder.
        name: file name of the page.
        wide, high: size of the window, CSS pixels.
    """
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
    """Mesh name -> positions float64[V, 3], from base64 of float32."""
    return {
        name: np.frombuffer(base64.b64decode(text), "<f4").reshape(-1, 3).astype(np.float64)
        for name, text in found.items()
    }


def apart(a: Mapping[str, Any], b: Mapping[str, Any]) -> float:
    """The largest distance in mm between corresponding vertices.

    Args:
        a, b: mesh name -> positions [V, 3], metres.
    """
    assert a.keys() == b.keys(), (sorted(a), sorted(b))
    return max(1000 * float(np.linalg.norm(a[n] - b[n], axis=1).max()) for n in a)


def from_the_file(
    found: GlbFile, state: Mapping[str, Any], mixes: Mapping[str, Mapping[str, float]]
) -> float:
    """The largest distance in mm between a vertex in a client and its position by the file.

    Args:
        found: the file.
        state: the client's vertices, weights and joints, from places.js.
        mixes: morph target that the client made itself -> morph target of the file -> its factor in
            the sum that the client made.
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
    """Append a row to targets.tsv: client, morph target, largest distance from the rig in mm."""
    with (folder / "targets.tsv").open("a") as table:
        table.write(f"{client}\t{target}\t{away:.4f}\n")


def say(value: object) -> str:
    """The value as JSON, to insert it into a script."""
    return json.dumps(value)
