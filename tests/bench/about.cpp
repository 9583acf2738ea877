// SPDX-License-Identifier: MIT
// A file of its own, because every commit recompiles it.
#include "bench/machine.h"

namespace risorius::bench {

const char* compiler() { return RISORIUS_COMPILER; }
const char* commit() { return RISORIUS_COMMIT; }

}  // namespace risorius::bench
