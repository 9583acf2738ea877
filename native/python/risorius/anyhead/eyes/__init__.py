# SPDX-License-Identifier: MIT
"""Finds the opening between the lids of an eye, and fits lid expressions to the eyeball."""
