# SPDX-License-Identifier: MIT
"""Transfers the displacements of a template's skin in each expression to another head's skin."""
