// SPDX-License-Identifier: MIT
// What CPU and operating system both support.
#pragma once

namespace risorius::simd {

bool cpu_has_sse4();    // 4.1
bool cpu_has_avx2();    // with FMA and F16C
bool cpu_has_avx512();  // F, BW, DQ, VL

}  // namespace risorius::simd
