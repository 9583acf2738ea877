# SPDX-License-Identifier: MIT
"""Named places of a face: found without clicks, refused where there is no face, saved as JSON."""
