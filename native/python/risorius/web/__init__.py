# SPDX-License-Identifier: MIT
"""A face as one web page that needs nothing but a browser."""

from .looks import find_looks
from .page import WebError, render, render_script

__all__ = ["WebError", "find_looks", "render", "render_script"]
