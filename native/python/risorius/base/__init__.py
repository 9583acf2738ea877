# SPDX-License-Identifier: MIT
"""Tools that all packages use: errors, budgets, filters, TOML. Imports no other package."""
