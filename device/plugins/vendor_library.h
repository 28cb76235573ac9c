// SPDX-License-Identifier: Apache-2.0
// vendor_library.h - a vendor's shared library, loaded at run time, so that a plug-in is built
// without the vendor's SDK. An adapter lists its calls once:
//
//   #define H6_X_CALLS(CALL) CALL(int, xOpen, ()) CALL(int, xClose, (int))
//   struct XCalls { H6_X_CALLS(H6_CALL_MEMBER) };
#pragma once
#include <dlfcn.h>

#include <cstring>
#include <initializer_list>
#include <string>

#define H6_CALL_MEMBER(result, name, arguments) result(*name) arguments = nullptr;
#define H6_CALL_ENTRY(result, name, arguments) {#name, &calls_.name},

namespace h6::plugin {

// A call's name, and the pointer to a function that gets its address.
struct Call {
  const char* name;
  void* to;
};

// Loads `given`, or the first of the usual names when it is empty, and looks up all calls. Returns
// one sentence, or nothing when all are there. The library stays loaded: some have threads of their
// own that outlive their last call.
inline std::string load_calls(const std::string& given, std::initializer_list<const char*> usual,
                              const char* sdk, std::initializer_list<Call> calls) {
  std::string name = given, why;
  void* library = nullptr;
  const auto attempt = [&](const char* path) {
    if (library) return;
    library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    const char* reason = library ? nullptr : dlerror();
    if (reason) why = reason;
    name = path;
  };
  if (given.empty())
    for (const char* path : usual) attempt(path);
  else
    attempt(given.c_str());
  if (!library)
    return "cannot load " + name + " of " + sdk + ": install it, or give library=PATH (" + why +
           ")";
  for (const Call& call : calls) {
    void* found = dlsym(library, call.name);
    if (!found) return name + " has no call " + call.name + ": it is not " + sdk + ", or too old";
    std::memcpy(call.to, &found, sizeof found);
  }
  return "";
}

}  // namespace h6::plugin
