# SPDX-License-Identifier: GPL-3.0-or-later
"""From a pose to bones and vertices: posed by Blender's modifiers, or finished natively."""
