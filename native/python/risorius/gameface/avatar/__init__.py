# SPDX-License-Identifier: MIT
"""Faces with the bones of a body: humanoids, and the tables of VRM 1.0 and 0.x."""
