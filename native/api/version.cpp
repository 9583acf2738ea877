// SPDX-License-Identifier: MIT
#include "api/risorius.h"

uint32_t risorius_abi(void) { return RISORIUS_ABI; }

const char* risorius_version(void) { return RISORIUS_VERSION; }
