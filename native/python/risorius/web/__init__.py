# SPDX-License-Identifier: MIT
"""A face as one web page that needs nothing but a browser."""

from .page import WebError, render
from .pictures import find_pictures

__all__ = ["WebError", "find_pictures", "render"]
