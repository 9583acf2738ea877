// SPDX-License-Identifier: MIT
#pragma once

namespace risorius::simd {

/// True when CPU and operating system both support AVX2 and FMA.
bool cpu_has_avx2_fma();

}  // namespace risorius::simd
