# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds a photographer's studio around a face: camera, lights and a backdrop."""
