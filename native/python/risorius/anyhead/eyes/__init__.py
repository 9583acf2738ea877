# SPDX-License-Identifier: MIT
"""Eyes as lids meet them: where they are seen, and lids that close on them and stay out of them."""
