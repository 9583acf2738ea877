# SPDX-License-Identifier: MIT
"""Lips that rest on each other, teeth and gums; what keeps the tongue on the lip."""
