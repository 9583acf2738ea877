# SPDX-License-Identifier: MIT
"""Closed lips, teeth and gums, and correctives that keep the tongue on the lip."""
