// SPDX-License-Identifier: Apache-2.0
// write_aside.h - writes a file beside its place and renames it, so that it is whole or absent.
#pragma once
#include <filesystem>
#include <functional>
#include <string_view>

#include "hapsix/result.h"

namespace h6::io {

// Calls `write` with the path of a new, empty file in the same folder and with the same ending
// (NAME.unfinished-PID-N.EXT), which it fills or replaces; then syncs it and renames it over
// `file`. The temporary file is removed when `write` fails, throws (std::exception becomes the
// sentence, any other exception passes through) or leaves it empty. An existing `file` keeps its
// permissions, and a symbolic link stays one: its target is replaced. Missing parent folders, a
// folder or a device in place of the file, and a write-protected file are errors with a sentence.
// Any number of threads may write aside at once; for the same `file` the last to finish wins.
Outcome write_aside(const std::filesystem::path& file,
                    const std::function<Outcome(const std::filesystem::path&)>& write);

// Writes `text` aside.
Outcome write_text_aside(const std::filesystem::path& file, std::string_view text);

// Removes the temporary files of every write_aside in flight in this process. Async-signal-safe: it
// reads a fixed table and calls getpid and unlink only, so a program may call it from its handler
// of SIGINT and SIGTERM just before it ends:
//     extern "C" void on_signal(int signal) { h6::io::remove_unfinished(); _exit(128 + signal); }
// A write_aside that is still running afterwards fails with a sentence; nothing else is harmed.
// The table has 32 places; further writes work but are not cleaned up. SIGKILL leaves
// NAME.unfinished-PID-N.EXT behind, but never a half-written `file`.
void remove_unfinished() noexcept;

}  // namespace h6::io
