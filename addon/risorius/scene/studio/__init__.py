# SPDX-License-Identifier: GPL-3.0-or-later
"""A photographer's studio around a face."""
