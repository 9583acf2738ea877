// SPDX-License-Identifier: MIT
// Alone in a file, since a new commit compiles it anew.
#include "bench/machine.h"

namespace risorius::bench {

const char* compiler() { return RISORIUS_COMPILER; }
const char* commit() { return RISORIUS_COMMIT; }

}  // namespace risorius::bench
