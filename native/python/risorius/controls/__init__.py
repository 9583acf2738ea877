# SPDX-License-Identifier: MIT
"""Names of a face's controls: regions, sides, ARKit units, names of other programs."""
