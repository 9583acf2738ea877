# SPDX-License-Identifier: MIT
"""Commands that make faces."""
