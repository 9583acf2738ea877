# SPDX-License-Identifier: MIT
"""The single drawings of a page."""
