# SPDX-License-Identifier: MIT
"""What every room uses: errors, whole files, locks, budgets, TOML. Knows no other room."""
