// SPDX-License-Identifier: Apache-2.0
// manual.cpp - one walk over the commands, four ways to write them down.
#include "io/cli/manual.h"

#include <CLI/CLI.hpp>
#include <vector>

#include "hapsix/base.h"

namespace h6::cli {
namespace {

struct Switch {
  std::string short_name, long_name;  // with their hyphens; one may be empty
  std::string value;                  // what follows it; empty for a flag
  std::string about;
};
struct Command {
  std::string path;  // "bake field"; empty for the program itself
  std::string about, positionals, footer;
  std::vector<Switch> switches;
  std::vector<std::pair<std::string, std::string>> positional_about;
  std::vector<std::pair<std::string, std::string>> next;  // commands that may follow, and their use
};

void collect(const CLI::App& app, const std::string& path, std::vector<Command>& all) {
  Command command{path, app.get_description(), "", path.empty() ? app.get_footer() : "", {}, {},
                  {}};
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_group().empty()) continue;  // hidden
    if (option->get_positional()) {
      const std::string name = option->get_single_name();
      command.positionals += option->get_required() ? " " + name : " [" + name + "]";
      command.positional_about.push_back({name, option->get_description()});
      continue;
    }
    Switch s;
    if (!option->get_snames().empty()) s.short_name = "-" + option->get_snames().front();
    if (!option->get_lnames().empty()) s.long_name = "--" + option->get_lnames().front();
    if (option->get_items_expected_max() > 0)
      s.value = option->get_option_text().empty() ? "VALUE" : option->get_option_text();
    s.about = option->get_description();
    command.switches.push_back(std::move(s));
  }
  const std::vector<const CLI::App*> subs =
      app.get_subcommands([](const CLI::App*) { return true; });
  for (const CLI::App* sub : subs)
    command.next.push_back({sub->get_name(), sub->get_description()});
  all.push_back(std::move(command));
  for (const CLI::App* sub : subs)
    collect(*sub, path.empty() ? sub->get_name() : path + " " + sub->get_name(), all);
}

// ---- man ---------------------------------------------------------------------------------------

// Text as troff takes it: hyphens that can be copied, no line that begins with a request.
std::string troff(const std::string& text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    const bool begins = i == 0 || text[i - 1] == '\n';
    if (begins && (c == '.' || c == '\'')) out += "\\&";
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else
      out += c;
  }
  return out;
}

std::string man_command(const Command& command) {
  std::string out = ".SS hapsix" + (command.path.empty() ? "" : " " + troff(command.path)) +
                    troff(command.positionals) + "\n" + troff(command.about) + ".\n";
  for (const auto& [name, about] : command.positional_about)
    out += ".TP\n.I " + troff(name) + "\n" + troff(about) + "\n";
  for (const Switch& s : command.switches) {
    out += ".TP\n\\fB" + troff(s.short_name);
    if (!s.short_name.empty() && !s.long_name.empty()) out += "\\fR, \\fB";
    out += troff(s.long_name) + "\\fR";
    if (!s.value.empty()) out += " \\fI" + troff(s.value) + "\\fR";
    out += "\n" + troff(s.about) + "\n";
  }
  return out;
}

std::string man(const std::vector<Command>& all) {
  const std::string version = std::to_string(H6_VERSION_MAJOR) + "." +
                              std::to_string(H6_VERSION_MINOR) + "." +
                              std::to_string(H6_VERSION_PATCH);
  std::string out =
      ".TH HAPSIX 1 \"\" \"hapsix " + version +
      "\" \"User Commands\"\n.SH NAME\nhapsix \\- 6\\-DoF haptic rendering of contact "
      "between complex parts\n.SH SYNOPSIS\n";
  for (const Command& command : all)
    if (command.next.empty())
      out += ".B hapsix " + troff(command.path) + "\n[\\fIOPTIONS\\fR]" +
             troff(command.positionals) + "\n.br\n";
  out += ".SH COMMANDS\n";
  for (const Command& command : all) out += man_command(command);
  out += ".SH EXAMPLES\n.nf\n" + troff(all.front().footer) +
         "\n.fi\n.SH ENVIRONMENT\n.TP\n.B HAPSIX_CACHE\nThe folder of baked assets; default "
         "~/.cache/hapsix.\n.TP\n.B HAPSIX_SIMD\nA lesser SIMD target to run on.\n.SH EXIT "
         "STATUS\n0: done; 1: failed; 2: wrong usage.\n";
  return out;
}

// ---- shells ------------------------------------------------------------------------------------

std::string options_of(const Command& command) {
  std::string out;
  for (const Switch& s : command.switches)
    for (const std::string& name : {s.long_name, s.short_name})
      if (!name.empty()) out += (out.empty() ? "" : " ") + name;
  return command.path.empty() ? out : out + " --json";  // every command takes it
}
std::string next_of(const Command& command) {
  std::string out;
  for (const auto& [name, about] : command.next) out += (out.empty() ? "" : " ") + name;
  return out;
}

// The words that lead from a command to the next, "|bake" and "bake|field", as patterns of a case.
std::string steps(const std::vector<Command>& all) {
  std::string out;
  for (const Command& command : all)
    for (const auto& [name, about] : command.next)
      out += (out.empty() ? "\"" : " | \"") + command.path + "|" + name + "\"";
  return out;
}

// bash and zsh differ in where the words stand and in who takes the answer.
std::string walk_words(const std::vector<Command>& all, const std::string& words) {
  std::string out = "  local at= word options= commands=\n  for word in " + words +
                    "; do\n    case \"$at|$word\" in\n      " + steps(all) +
                    ") at=\"${at:+$at }$word\" ;;\n    esac\n  done\n  case \"$at\" in\n";
  for (const Command& command : all)
    out += "    \"" + command.path + "\") options=\"" + options_of(command) + "\" commands=\"" +
           next_of(command) + "\" ;;\n";
  return out + "  esac\n";
}

std::string bash(const std::vector<Command>& all) {
  return "# bash completion of hapsix\n_hapsix() {\n" +
         walk_words(all, "\"${COMP_WORDS[@]:1:COMP_CWORD-1}\"") +
         "  local current=\"${COMP_WORDS[COMP_CWORD]}\"\n"
         "  [ \"${current#-}\" = \"$current\" ] || commands=\"$options\"\n"
         "  COMPREPLY=($(compgen -W \"$commands\" -- \"$current\"))\n"
         "}\n"
         "complete -o default -F _hapsix hapsix\n";
}

std::string zsh(const std::vector<Command>& all) {
  return "#compdef hapsix\n" + walk_words(all, "\"${(@)words[2,CURRENT-1]}\"") +
         "  if [[ \"$PREFIX\" == -* ]]; then compadd -- ${=options}\n"
         "  elif [[ -n \"$commands\" ]]; then compadd -- ${=commands}\n"
         "  else _files\n  fi\n";
}

std::string quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? "\\'" : std::string(1, c);
  return out + "'";
}

std::string fish(const std::vector<Command>& all) {
  std::string out =
      "# fish completion of hapsix\nfunction __hapsix_at\n  set -l at ''\n"
      "  for word in (commandline -opc)[2..-1]\n    switch \"$at|$word\"\n      case";
  for (const Command& command : all)
    for (const auto& [name, about] : command.next) out += " '" + command.path + "|" + name + "'";
  out +=
      "\n        set at (string trim \"$at $word\")\n    end\n  end\n"
      "  test \"$at\" = \"$argv[1]\"\nend\n";
  for (const Command& command : all) {
    const std::string where = "complete -c hapsix -n \"__hapsix_at '" + command.path + "'\"";
    for (const auto& [name, about] : command.next)
      out += where + " -f -a " + name + " -d " + quoted(about) + "\n";
    for (const Switch& s : command.switches) {
      out += where;
      if (!s.short_name.empty()) out += " -s " + s.short_name.substr(1);
      if (!s.long_name.empty()) out += " -l " + s.long_name.substr(2);
      out += (s.value.empty() ? " -d " : " -r -d ") + quoted(s.about) + "\n";
    }
  }
  return out;
}

}  // namespace

std::string manual(const CLI::App& app, const std::string& what) {
  std::vector<Command> all;
  collect(app, "", all);
  if (what == "man") return man(all);
  if (what == "bash") return bash(all);
  if (what == "zsh") return zsh(all);
  if (what == "fish") return fish(all);
  return "";
}

}  // namespace h6::cli
