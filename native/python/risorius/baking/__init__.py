# SPDX-License-Identifier: MIT
"""A clip played on a face, and the poses written as .npz or .csv."""
