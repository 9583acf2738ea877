# SPDX-License-Identifier: MIT
"""The individual drawings of a page."""
