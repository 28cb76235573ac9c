// SPDX-License-Identifier: Apache-2.0
// What the user's browser gets from `--view`, and what other users of the machine can see of it.
#include "tests/io/cli/program.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <regex>

using namespace h6::test;

namespace {

// Stands for xdg-open: writes down what it was given, then stays, as a browser would.
const char* const kOpener = R"(#!/bin/sh
here=$(dirname "$0")
echo "$$" > "$here/pid"
ls -l /proc/$$/fd > "$here/open"
cp "$1" "$here/page" 2>/dev/null
stat -c '%a %u' "$1" > "$here/mode" 2>/dev/null
printf '%s\n' "$@" > "$here/argv.new" && mv "$here/argv.new" "$here/argv"
sleep 60
)";

bool can_listen(int port) {
  const int fd = socket(AF_INET, SOCK_STREAM, 0), yes = 1;
  setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_port = htons(static_cast<std::uint16_t>(port));
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const bool good = bind(fd, reinterpret_cast<sockaddr*>(&at), sizeof at) == 0;
  close(fd);
  return good;
}

// The environment of one test; what was set before comes back.
struct Setting {
  Setting(const char* name, const std::string& value) : name_(name) {
    if (const char* old = std::getenv(name)) old_ = old;
    setenv(name, value.c_str(), 1);
  }
  ~Setting() { old_.empty() ? unsetenv(name_) : setenv(name_, old_.c_str(), 1); }
  const char* name_;
  std::string old_;
};

}  // namespace

TEST_CASE("the browser gets a file of the user's own, never the token, and none of our files") {
  Sandbox box, tools;
  spill(tools.file("xdg-open"), kOpener);
  fs::permissions(tools.file("xdg-open"), fs::perms::owner_all);
  const Setting path("PATH", tools.folder().string() + ":" + std::getenv("PATH"));
  const Setting screen("DISPLAY", ":77"), run_time("XDG_RUNTIME_DIR", tools.cache());
  Process program(box, {"run", "box-on-wall", "--view"});
  if (!soon([&] { return fs::exists(tools.file("argv")) || program.ended(); }, 100) ||
      program.ended()) {
    const Ended ended = program.wait();
    REQUIRE_MESSAGE(ended.err.find("this build has no view") != ended.err.npos, ended.err);
    MESSAGE("skipped: built without node and npm");
    return;
  }
  const std::string given = slurp(tools.file("argv")), page = slurp(tools.file("page"));
  std::smatch found;
  REQUIRE_MESSAGE(std::regex_search(page, found, std::regex("127.0.0.1:([0-9]+)/.token=(\\w+)")),
                  given);
  const int port = std::stoi(found[1]);
  CHECK(given.find(found[2].str()) == given.npos);
  CHECK(given.find("http:") == given.npos);
  CHECK(slurp(tools.file("mode")) == "600 " + std::to_string(geteuid()) + "\n");
  // The standard three lead nowhere; a shell keeps its script at 10 or 255.
  const std::string open = slurp(tools.file("open"));
  CHECK_MESSAGE(open.find("socket:") == open.npos, open);
  CHECK_MESSAGE(open.find("stream-") == open.npos, open);
  program.send(SIGKILL);
  CHECK(program.wait().code == -SIGKILL);
  const pid_t browser = std::stoi(slurp(tools.file("pid")));
  CHECK(kill(browser, 0) == 0);
  CHECK_MESSAGE(can_listen(port), "the browser holds the port");
  kill(-browser, SIGKILL);
}

TEST_CASE("the file that leads to the view goes with the view") {
  Sandbox box, tools;
  spill(tools.file("xdg-open"), kOpener);
  fs::permissions(tools.file("xdg-open"), fs::perms::owner_all);
  const Setting path("PATH", tools.folder().string() + ":" + std::getenv("PATH"));
  const Setting screen("DISPLAY", ":77"), run_time("XDG_RUNTIME_DIR", tools.cache());
  Process program(box, {"run", "box-on-wall", "--view", "--duration", "1"});
  const Ended ended = program.wait();
  CHECK((ended.code == 0 || ended.err.find("this build has no view") != ended.err.npos));
  CHECK(fs::is_empty(tools.cache()));
  if (fs::exists(tools.file("pid"))) kill(-std::stoi(slurp(tools.file("pid"))), SIGKILL);
}
