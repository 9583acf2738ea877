# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes the animation of a face to actions that play without the add-on."""
