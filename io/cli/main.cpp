// SPDX-License-Identifier: Apache-2.0
// main.cpp - the program hapsix: parses and dispatches; exits with 0 (done), 1 (failed) or 2 (wrong
// usage).
#include <signal.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstring>
#include <exception>
#include <nlohmann/json.hpp>
#include <system_error>

#include "hapsix/base.h"
#include "io/cli/commands.h"
#include "io/cli/manual.h"
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

// The parser's own words behind an option ("Excludes: --jobs", a name given twice) explain nothing.
class Help : public CLI::Formatter {
 public:
  std::string make_option_opts(const CLI::Option* option) const override {
    if (option->get_positional()) return "";
    std::string words = CLI::Formatter::make_option_opts(option);
    for (const char* end : {" Needs:", " Excludes:"})
      words.erase(std::min(words.find(end), words.size()));
    return words;
  }
};

// Whether --json was given, wherever the parser stopped.
bool has_json_flag(int argc, char** argv) {
  return std::any_of(argv + 1, argv + argc,
                     [](const char* a) { return std::string(a) == "--json"; });
}

std::string version_number() {
  return std::to_string(H6_VERSION_MAJOR) + "." + std::to_string(H6_VERSION_MINOR) + "." +
         std::to_string(H6_VERSION_PATCH);
}

std::vector<std::string> simd_targets() {
  const char* names[32];
  const std::size_t count = h6::kernels::supported_targets(names, 32);
  return {names, names + count};
}

// Packages make threads before main begins, and one that gets none ends the process without a word
// for the user. So this runs before them all and says what is wrong; main takes it away again.
std::terminate_handler former_handler = nullptr;
bool json_wanted = false;

[[noreturn]] void no_start() {
  static const char said[] =
      "the program cannot start: the system gives it no thread or no memory; raise 'ulimit -u' and "
      "'ulimit -v', or end other programs";
  const auto put = [](int to, const char* text) { (void)!write(to, text, std::strlen(text)); };
  put(STDERR_FILENO, "hapsix: "), put(STDERR_FILENO, said), put(STDERR_FILENO, "\n");
  if (json_wanted)
    put(STDOUT_FILENO, "{\n  \"error\": \""), put(STDOUT_FILENO, said),
        put(STDOUT_FILENO, "\"\n}\n");
  _exit(h6::cli::kFailed);
}

#if defined(__linux__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
void before_packages(int argc, char** argv, char**) {
  for (int i = 1; i < argc; ++i) json_wanted = json_wanted || std::strcmp(argv[i], "--json") == 0;
  former_handler = std::set_terminate(no_start);
}
__attribute__((section(".preinit_array"), used)) void (*const first)(int, char**,
                                                                     char**) = before_packages;
#endif

// Does the work of the command line. Returns the exit code.
int work(const Program& program) {
  try {
    return program.console.finish(program.work());
  } catch (const std::system_error& e) {
    if (e.code() != std::errc::resource_unavailable_try_again)
      return program.console.fail(std::string("unexpected: ") + e.what());
    return program.console.fail(
        "the system gives no thread: raise 'ulimit -u', or end other programs");
  } catch (const std::bad_alloc&) {
    return program.console.fail(
        "out of memory: use a larger voxel, fewer points or a smaller file");
  } catch (const std::exception& e) {
    return program.console.fail(std::string("unexpected: ") + e.what());
  }
}

// Returns `code`, for the end of main. The destructor of a plug-in's library may hang, so the
// process ends after 5 s without it.
int leave(int code) {
  static int kept;
  kept = code;
  signal(SIGALRM, [](int) { _exit(kept); });
  alarm(5);
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  if (former_handler) std::set_terminate(former_handler);
  CLI::App app{"hapsix - 6-DoF haptic rendering of contact between complex parts", "hapsix"};
  app.require_subcommand(1);
  app.fallthrough();
  app.option_defaults()->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
  app.formatter(std::make_shared<Help>());
  app.get_formatter()->column_width(26);
  // Subcommands inherit these settings.
  app.footer("Every command takes --json. Exit code: 0 done, 1 failed, 2 wrong usage.");
  Program program;
  app.add_flag("--json", program.console.json, "One JSON object on stdout, messages on stderr");
  app.add_flag("--allow-outside", program.allow_outside,
               "Scene files may name files outside their folder");
  app.set_version_flag("--version", [] { return std::string(h6BuildInfo()); });
  std::string generated;
  app.add_option_function<std::string>(
         "--generate",
         [&](const std::string& what) {
           generated = manual(app, what);
           throw CLI::Success();
         },
         "The man page, or the completion of a shell: man, bash, zsh or fish")
      ->check(one_of({"man", "bash", "zsh", "fish"}))
      ->trigger_on_parse()
      ->group("");  // for the build, not for people
  add_new(app, program);
  add_bake(app, program);
  add_check(app, program);
  add_run(app, program);
  add_report(app, program);
  add_export(app, program);
  add_replay(app, program);
  add_info(app, program);
  add_devices(app, program);
  add_scene(app, program);
  add_demo(app, program);
  add_experiments(app, program);
  add_map(app, program);
  add_study(app, program);
  app.footer(
      "COMMAND --help explains each. To begin with:\n"
      "  hapsix demo                                  two methods side by side\n"
      "  hapsix run peg-in-hole --virtual-time        a generated scene\n"
      "  hapsix new starter.stl bay.stl               your own parts, from meshes to touch\n"
      "  hapsix bake field bay.stl -o bay.vdb --units mm --voxels 512\n" +
      app.get_footer());
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForVersion& e) {
    program.console.json = has_json_flag(argc, argv);
    if (!program.console.json) return app.exit(e);
    program.console.result({{"hapsix", version_number()}, {"simd_targets", simd_targets()}});
    return kOk;
  } catch (const CLI::Success& e) {  // --help, --generate
    std::fputs(generated.c_str(), stdout);
    return program.console.finish(app.exit(e));
  } catch (const CLI::ParseError& e) {
    program.console.json = has_json_flag(argc, argv);
    return program.console.fail(mistake(app, e), kUsage);
  }
  if (const char* why = h6::kernels::force_target_from_environment())
    return program.console.fail(why, kUsage);
  install_signal_handlers();
  return leave(work(program));
}
