// SPDX-License-Identifier: Apache-2.0
// simd.h - which Highway targets are built; include before hwy/foreach_target.h.
//
// Kernels keep vectors in small structs and arrays. Targets whose vector length is not known at
// compile time cannot do that, so Arm runs on NEON and RISC-V on the scalar target.
#pragma once
#ifndef HWY_DISABLED_TARGETS
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#endif
