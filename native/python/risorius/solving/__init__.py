# SPDX-License-Identifier: MIT
"""Finds the controls for target positions: of points dragged on the skin, or of a moving mesh.

Surface: raw controls -> positions of vertices; solve_drag: dragged vertices -> raw controls.
"""
