# SPDX-License-Identifier: MIT
"""What a template's skin does in each expression, on the skin of another head."""
