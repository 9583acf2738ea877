// SPDX-License-Identifier: MIT
// Any text: from_json refuses it with a field or an offset, or gives a face that is the same after
// it was written and read again, as JSON and as a file.
#include "fuzz/promise.h"

namespace promises = risorius::promises;
using risorius::fuzz::demand;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const risorius::fuzz::HeapBound bound(size, 192, 64u << 10);
  demand(promises::json_text({reinterpret_cast<const char*>(data), size}));
  return 0;
}
