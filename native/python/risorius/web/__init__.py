# SPDX-License-Identifier: MIT
"""Writes a face as a web page that needs only a browser."""

from .looks import find_looks
from .page import WebError, render, render_script

__all__ = ["WebError", "find_looks", "render", "render_script"]
