# SPDX-License-Identifier: MIT
"""Landmarks of a face: found automatically, checked, and stored as JSON."""
