# SPDX-License-Identifier: MIT
"""Tools that every room uses: errors, budgets, filters, TOML. Imports no other room."""
