# SPDX-License-Identifier: MIT
"""Commands that write pages for people who look."""
