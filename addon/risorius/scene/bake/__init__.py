# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes the animation of a face, or only of its controls, to actions; bakes simulations.

Only the actions of a whole face play without the add-on.
"""
