// SPDX-License-Identifier: MIT
// A broken promise ends a fuzz target as a crash does.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <string>

#include "support/promises.h"

namespace risorius::fuzz {

inline void demand(const std::string& broken_promise) {
  if (broken_promise.empty()) return;
  std::fprintf(stderr, "broken promise: %s\n", broken_promise.c_str());
  std::abort();
}

}  // namespace risorius::fuzz
