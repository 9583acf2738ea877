# SPDX-License-Identifier: MIT
"""Closes the lips, makes teeth and gums, and keeps the tongue on the lip."""
