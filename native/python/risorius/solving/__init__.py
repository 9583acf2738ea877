# SPDX-License-Identifier: MIT
"""Solves for controls from target positions: a drag on the skin, or a moving mesh.

Raw controls --Surface--> vertices; dragged vertices --solve_drag--> raw controls.
"""
