# SPDX-License-Identifier: MIT
"""A face with a body's bones: humanoids, and the tables of VRM 1.0 and 0.x."""
