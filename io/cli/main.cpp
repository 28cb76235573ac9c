// SPDX-License-Identifier: Apache-2.0
// main.cpp - the program hapsix: parses and dispatches; exits with 0 (done), 1 (failed) or 2 (wrong
// usage).
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "hapsix/base.h"
#include "io/cli/commands.h"
#include "io/console/checks.h"
#include "kernels/targets.h"

using namespace h6::cli;

namespace {

// Returns the chosen subcommand and writes its full name.
const CLI::App* reached(const CLI::App& app, std::string& name) {
  const CLI::App* at = &app;
  name = at->get_name();
  while (!at->get_subcommands().empty()) {
    at = at->get_subcommands().front();
    name += " " + at->get_name();
  }
  return at;
}

// Returns a sentence that explains the mistake in the command line and names the --help to read.
std::string mistake(const CLI::App& app, const CLI::ParseError& error) {
  std::string command, what = error.what();
  const CLI::App* at = reached(app, command);
  std::vector<std::string> next;  // commands that may follow here
  for (const CLI::App* sub : at->get_subcommands({})) next.push_back(sub->get_name());
  const bool missing = dynamic_cast<const CLI::RequiredError*>(&error) != nullptr;
  const bool extra = dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr;
  const std::vector<std::string> unknown = app.remaining(true);
  if ((missing || extra) && !unknown.empty()) {  // an unknown word explains the other errors
    const std::string word = unknown.front().substr(0, unknown.front().find('='));
    std::vector<std::string> known = next;
    const bool option = word.rfind('-', 0) == 0;
    if (option) {
      known.clear();
      for (const CLI::Option* o : at->get_options())
        for (const std::string& l : o->get_lnames()) known.push_back("--" + l);
    }
    what = option         ? "there is no option '" + word + "'"
           : next.empty() ? "'" + word + "' is one argument too many"
                          : "there is no command '" + word + "'";
    const std::string like = nearest(word, known);
    if (like == word)
      what = "'" + word + "' belongs behind '" + command + "'";
    else if (!like.empty())
      what += ", did you mean '" + like + "'?";
  } else if (missing && !next.empty()) {
    what = command + " needs a command: ";
    for (std::size_t i = 0; i < next.size(); ++i)
      what += (i == 0 ? "" : i + 1 == next.size() ? " or " : ", ") + next[i];
  } else if (missing) {
    what = "missing: " + what;
    if (const auto end = what.find(" is required"); end != std::string::npos) what.erase(end);
  }
  return what + (what.back() == '?' ? " '" : "; '") + command + " --help' tells more";
}

std::string version() {
  std::string text = "hapsix " + std::to_string(H6_VERSION_MAJOR) + "." +
                     std::to_string(H6_VERSION_MINOR) + "." + std::to_string(H6_VERSION_PATCH) +
                     "\nSIMD targets of this machine, best first:";
  const char* names[32];
  const std::size_t count = h6::kernels::supported_targets(names, 32);
  for (std::size_t i = 0; i < count; ++i) text += std::string(" ") + names[i];
  return text;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"hapsix - 6-DoF haptic rendering of contact between complex parts", "hapsix"};
  app.require_subcommand(1);
  app.fallthrough();
  app.option_defaults()->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
  app.get_formatter()->column_width(26);
  // Subcommands inherit these settings.
  app.footer("Every command takes --json. Exit code: 0 done, 1 failed, 2 wrong usage.");
  Program program;
  app.add_flag("--json", program.console.json, "One JSON object on stdout, messages on stderr");
  app.set_version_flag("--version", version);
  add_bake(app, program);
  add_check(app, program);
  add_run(app, program);
  add_report(app, program);
  add_replay(app, program);
  add_info(app, program);
  add_devices(app, program);
  add_scene(app, program);
  add_demo(app, program);
  add_experiments(app, program);
  add_map(app, program);
  app.footer(
      "COMMAND --help explains each. To begin with:\n"
      "  hapsix demo                                  two methods side by side\n"
      "  hapsix run peg-in-hole --virtual-time        a generated scene\n"
      "  hapsix bake field bay.stl -o bay.vdb --units mm --voxels 512\n" +
      app.get_footer());
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& e) {  // --help, --version
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    for (int i = 1; i < argc; ++i)
      program.console.json = program.console.json || std::string(argv[i]) == "--json";
    return program.console.fail(mistake(app, e), kUsage);
  }
  if (const char* why = h6::kernels::force_target_from_environment())
    return program.console.fail(why, kUsage);
  install_signal_handlers();
  try {
    return program.console.finish(program.work());
  } catch (const std::bad_alloc&) {
    return program.console.fail(
        "out of memory: use a larger voxel, fewer points or a smaller file");
  } catch (const std::exception& e) {
    return program.console.fail(std::string("unexpected: ") + e.what());
  }
}
