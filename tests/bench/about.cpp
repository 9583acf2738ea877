// SPDX-License-Identifier: MIT
// The build's facts for benchmarks, in a separate file because every commit recompiles it.
#include "bench/machine.h"

namespace risorius::bench {

const char* compiler() { return RISORIUS_COMPILER; }
const char* commit() { return RISORIUS_COMMIT; }

}  // namespace risorius::bench
