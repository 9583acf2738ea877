# SPDX-License-Identifier: MIT
"""Combines style, script and WebAssembly into one page: assemble.py SOURCES BUILT."""

import base64
import gzip
import sys
from pathlib import Path

sources, built = Path(sys.argv[1]), Path(sys.argv[2])


def packed(name: str, data: bytes) -> str:
    """A script element that contains a file, compressed with gzip and encoded as base64."""
    text = base64.b64encode(gzip.compress(data, 9, mtime=0)).decode()
    return f'<script type="application/octet-stream" id="{name}">{text}</script>'


library = packed("library", (built / "risorius.wasm").read_bytes())
viewer = packed("viewer", (built / "viewer.js").read_bytes())
boot = (sources / "boot.js").read_text(encoding="utf-8")
if "</script" in boot.lower():
    raise SystemExit("the script would end its own element")
page = (sources / "page.html").read_text(encoding="utf-8")
for mark, text in (
    ("/*STYLE*/", (sources / "style.css").read_text(encoding="utf-8")),
    ("<!--CONTENT-->", f"<!--FACE-->\n{library}\n{viewer}"),
    ("/*BOOT*/", f"/*BOOT*/\n{boot}"),
):
    if page.count(mark) != 1:
        raise SystemExit(f"{mark} stands {page.count(mark)} times in page.html")
    page = page.replace(mark, text)
(built / "page.html").write_text(page, encoding="utf-8")
