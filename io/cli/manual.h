// SPDX-License-Identifier: Apache-2.0
// manual.h - the man page and the completions of shells, from the definitions of the command line.
#pragma once
#include <string>

namespace CLI {
class App;
}

namespace h6::cli {

// `what` is "man" (troff for man 1), "bash", "zsh" or "fish"; else the text is empty.
std::string manual(const CLI::App& app, const std::string& what);

}  // namespace h6::cli
