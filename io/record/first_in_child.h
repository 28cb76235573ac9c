// SPDX-License-Identifier: Apache-2.0
// first_in_child.h - lets a child process read a file first, so that a file that brings HDF5 down
// ends the child and not the program.
//
// HDF5 1.10 follows addresses and sizes that a damaged or hostile file states, and crashes or loops
// on some of them (tests/fuzz/findings/deformable). No check before it can know them all.
#pragma once
#include <filesystem>
#include <functional>

#include "hapsix/result.h"

namespace h6::io::recording {

// Runs `read` in a child process. Fails with a sentence when the child crashes, or does not end
// within a minute and a second for each 10 MB. A file that survived last time as `what` is not
// tried again while it stays as it is. The caller holds the LibraryLock, so no other thread is
// inside HDF5 at the fork.
Outcome first_in_child(const std::filesystem::path& file, const char* what,
                       const std::function<void()>& read);

}  // namespace h6::io::recording
