// SPDX-License-Identifier: MIT
// The compiler and the commit of the benchmarks' build. They have a separate file, because it must
// be recompiled after every commit.
#include "bench/machine.h"

namespace risorius::bench {

const char* compiler() { return RISORIUS_COMPILER; }
const char* commit() { return RISORIUS_COMMIT; }

}  // namespace risorius::bench
