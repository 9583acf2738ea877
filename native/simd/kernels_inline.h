// SPDX-License-Identifier: MIT
// RISORIUS_INLINE: a function of the file's target, always inlined. After RISORIUS_TARGET.
#pragma once

#if defined(_MSC_VER) && !defined(__clang__)
#define RISORIUS_INLINE RISORIUS_TARGET __forceinline
#else
#define RISORIUS_INLINE RISORIUS_TARGET __attribute__((always_inline)) inline
#endif
