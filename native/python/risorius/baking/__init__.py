# SPDX-License-Identifier: MIT
"""Evaluates a clip on a face, and writes the poses as .npz or .csv."""
