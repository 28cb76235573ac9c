// SPDX-License-Identifier: Apache-2.0
// fuzzer.cpp - libFuzzer's door to the target that HAPSIX_FUZZ names.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <new>

#include "tests/fuzz/targets.h"

// The sanitizer's own `new` ends the program where the standard's throws: for a size that no machine
// has, which packages catch.
void* operator new(std::size_t bytes) {
  if (void* memory = std::malloc(bytes ? bytes : 1)) return memory;
  throw std::bad_alloc();
}
void* operator new[](std::size_t bytes) { return operator new(bytes); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }

namespace {
const h6::fuzz::Target* target = nullptr;
}

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  const char* name = std::getenv("HAPSIX_FUZZ");
  target = h6::fuzz::find_target(name ? name : "");
  if (target) return 0;
  std::fprintf(stderr, "HAPSIX_FUZZ names none of:");
  for (const h6::fuzz::Target& t : h6::fuzz::targets()) std::fprintf(stderr, " %s", t.name);
  std::fprintf(stderr, "\n");
  std::exit(2);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  target->take({reinterpret_cast<const char*>(bytes), size});
  return 0;
}
