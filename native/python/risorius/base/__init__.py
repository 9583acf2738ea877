# SPDX-License-Identifier: MIT
"""Tools that all packages of risorius use: errors, budgets, filters, TOML. Imports none of them."""
