# SPDX-License-Identifier: MIT
"""What every room uses: errors, budgets, filters, TOML. Knows no other room."""
