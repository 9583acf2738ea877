# SPDX-License-Identifier: MIT
"""One module per sub-command of the command line."""
