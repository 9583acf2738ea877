# SPDX-License-Identifier: MIT
"""Tools that all packages of risorius use: errors, budgets, filters, TOML.

The modules of base import no other package of risorius.
"""
