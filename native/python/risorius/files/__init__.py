# SPDX-License-Identifier: MIT
"""Files that are whole or not there, locks between processes, the folder of caches."""
