# SPDX-License-Identifier: GPL-3.0-or-later
"""When characters are brought up to their controls: Blender's handlers."""
