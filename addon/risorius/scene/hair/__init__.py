# SPDX-License-Identifier: GPL-3.0-or-later
"""Cards of hair as strands."""
