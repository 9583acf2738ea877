# SPDX-License-Identifier: MIT
"""Commands that write pages to look at."""
