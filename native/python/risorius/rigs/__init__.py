# SPDX-License-Identifier: MIT
"""DNA files and compiled rigs: loading, checking, editing, the cache of compiled faces."""
