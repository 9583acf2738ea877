# SPDX-License-Identifier: MIT
"""Puts style, script and WebAssembly into one page: assemble.py SOURCES BUILT."""

import base64
import gzip
import sys
from pathlib import Path

sources, built = Path(sys.argv[1]), Path(sys.argv[2])
script = (built / "viewer.js").read_text(encoding="utf-8")
if "</script" in script.lower():
    raise SystemExit("the script would end its own element")
library = gzip.compress((built / "risorius.wasm").read_bytes(), 9, mtime=0)
element = (
    '<script type="application/octet-stream" id="library" data-packed="gzip">'
    f"{base64.b64encode(library).decode()}</script>"
)
page = (sources / "page.html").read_text(encoding="utf-8")
for mark, text in (
    ("/*STYLE*/", (sources / "style.css").read_text(encoding="utf-8")),
    ("<!--CONTENT-->", f"<!--FACE-->\n{element}"),
    ("/*SCRIPT*/", script),
):
    if page.count(mark) != 1:
        raise SystemExit(f"{mark} stands {page.count(mark)} times in page.html")
    page = page.replace(mark, text)
(built / "page.html").write_text(page, encoding="utf-8")
