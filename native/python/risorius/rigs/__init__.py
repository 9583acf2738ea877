# SPDX-License-Identifier: MIT
"""DNA files and compiled rigs: load, check, edit, the cache of compiled faces."""
