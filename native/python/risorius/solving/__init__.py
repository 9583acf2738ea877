# SPDX-License-Identifier: MIT
"""From where a face shall be to its controls: a drag on the skin, or a mesh that moves.

Raw controls --Surface--> vertices; dragged vertices --solve_drag--> raw controls.
"""
