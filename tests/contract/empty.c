// SPDX-License-Identifier: Apache-2.0
/* The contract needs nothing but a C99 compiler. */
#include "hapsix/device_plugin.h"
#include "hapsix/hapsix.h"

int main(void) { return 0; }
