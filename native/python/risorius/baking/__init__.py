# SPDX-License-Identifier: MIT
"""Plays a clip on a face and writes the poses as .npz or .csv."""
