// SPDX-License-Identifier: MIT
// A separate file, because it contains the commit and is recompiled after every commit.
#include "bench/machine.h"

namespace risorius::bench {

const char* compiler() { return RISORIUS_COMPILER; }
const char* commit() { return RISORIUS_COMMIT; }

}  // namespace risorius::bench
