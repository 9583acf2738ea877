# SPDX-License-Identifier: MIT
"""Controls Debian's chromium in headless mode through its DevTools protocol."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import json
import shutil
import tempfile
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

from tornado.websocket import WebSocketClientConnection, websocket_connect

SECONDS = 240


class Browser:
    """One page of the browser. `said` contains the texts of the page's uncaught exceptions."""

    def __init__(self, socket: WebSocketClientConnection) -> None:
        self._socket = socket
        self._number = 0
        self.said: list[str] = []
        self.asked: list[str] = []  # addresses that the page requested

    async def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        self._number += 1
        wanted = self._number
        message = {"id": wanted, "method": method, "params": parameters}
        await self._socket.write_message(json.dumps(message))
        while True:
            text = await asyncio.wait_for(self._socket.read_message(), SECONDS)
            answer = json.loads(text)
            if answer.get("method") == "Runtime.exceptionThrown":
                self.said.append(answer["params"]["exceptionDetails"]["text"])
            if answer.get("method") == "Network.requestWillBeSent":
                self.asked.append(answer["params"]["request"]["url"])
            if answer.get("id") == wanted:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                return dict(answer["result"])

    async def evaluate(self, script: str) -> Any:
        """The value of a JavaScript expression. Waits if the value is a promise."""
        result = await self.call(
            "Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True
        )
        if "exceptionDetails" in result:
            raise RuntimeError(str(result["exceptionDetails"]))
        return result["result"].get("value")

    async def open(self, page: Path, width: int, height: int, phone: bool = False) -> str:
        """Open a file and wait until it is ready or reports an error.

        Args:
            page: path of the HTML file.
            width, height: size of the window in CSS pixels.
            phone: emulate a phone with a touch screen.

        Returns: the page's state, body.dataset.state.
        """
        return await self.open_address(page.resolve().as_uri(), width, height, phone)

    async def open_address(self, address: str, width: int, height: int, phone: bool = False) -> str:
        """Open a URL and wait until the page is ready or reports an error.

        Args:
            address: the URL.
            width, height: size of the window in CSS pixels.
            phone: emulate a phone with a touch screen.

        Returns: the page's state, body.dataset.state.

        Raises:
            RuntimeError: the page is still loading after SECONDS.
        """
        await self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width, height=height, deviceScaleFactor=2 if phone else 1, mobile=phone,
        )  # fmt: skip
        await self.call("Emulation.setTouchEmulationEnabled", enabled=phone)
        await self.call("Page.navigate", url=address)
        for _ in range(SECONDS * 4):
            await asyncio.sleep(0.25)
            state = await self.evaluate("document.body?.dataset.state ?? 'loading'")
            if state != "loading":
                return str(state)
        raise RuntimeError("the page never became ready")

    async def picture(self, file: Path) -> None:
        # Wait until the browser has drawn the requested frame.
        await self.evaluate("new Promise(f => requestAnimationFrame(() => setTimeout(f, 300)))")
        result = await self.call("Page.captureScreenshot", format="png")
        file.write_bytes(base64.b64decode(result["data"]))


@contextlib.asynccontextmanager
async def browser() -> AsyncIterator[Browser]:
    program = shutil.which("chromium")
    if program is None:
        raise RuntimeError("there is no chromium: apt-get install chromium")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as home:
        process = await asyncio.create_subprocess_exec(
            program, "--headless=new", "--no-sandbox", "--use-angle=swiftshader",
            "--enable-unsafe-swiftshader", "--no-first-run", "--hide-scrollbars",
            "--autoplay-policy=no-user-gesture-required", "--mute-audio",
            "--disable-background-networking", f"--user-data-dir={home}",
            "--remote-debugging-port=0", "about:blank",
            stdout=asyncio.subprocess.DEVNULL, stderr=asyncio.subprocess.DEVNULL,
        )  # fmt: skip
        try:
            yield Browser(await _connect(Path(home)))
        finally:
            process.kill()
            await process.wait()


async def _connect(home: Path) -> WebSocketClientConnection:
    place = home / "DevToolsActivePort"
    for _ in range(SECONDS * 4):
        await asyncio.sleep(0.25)
        if place.exists() and len(lines := place.read_text().splitlines()) == 2:
            break
    else:
        raise RuntimeError("chromium does not start")
    whole = await websocket_connect(f"ws://127.0.0.1:{lines[0]}{lines[1]}")
    socket = Browser(whole)
    target = await socket.call("Target.createTarget", url="about:blank")
    page = await websocket_connect(
        f"ws://127.0.0.1:{lines[0]}/devtools/page/{target['targetId']}", max_message_size=1 << 28
    )
    one = Browser(page)
    await one.call("Page.enable")
    await one.call("Runtime.enable")
    await one.call("Network.enable")
    return page
