// SPDX-License-Identifier: Apache-2.0
#include "io/view/browser.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>

namespace h6::io::view {
namespace {

// The user's own folder for what lives as long as the login; else the one for temporary files.
std::string folder() {
  const char* own = std::getenv("XDG_RUNTIME_DIR");
  struct stat found {};
  if (own && stat(own, &found) == 0 && S_ISDIR(found.st_mode) && found.st_uid == geteuid())
    return own;
  std::error_code failed;
  const std::filesystem::path shared = std::filesystem::temp_directory_path(failed);
  return failed ? "/tmp" : shared.string();
}

// Returns the name of a new file with mode 0600 that leads to `address`; empty when it cannot be
// written.
std::string redirect_to(const std::string& address) {
  std::string name = folder() + "/hapsix-view-XXXXXX.html";
  const int fd = mkostemps(name.data(), 5, O_CLOEXEC);
  if (fd < 0) return "";
  const std::string text =
      "<!doctype html><meta charset=\"utf-8\"><meta name=\"referrer\" content=\"no-referrer\">"
      "<meta http-equiv=\"refresh\" content=\"0; url=" +
      address + "\"><title>hapsix</title><a href=\"" + address + "\">the view</a>\n";
  const bool whole = write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  close(fd);
  if (whole) return name;
  unlink(name.c_str());
  return "";
}

// Between fork and exec. A copy of the listening socket would keep the port after this program.
void leave_nothing_open() {
  const int nothing = open("/dev/null", O_RDWR);
  for (int fd = 0; fd < 3; ++fd)
    if (nothing < 0 || dup2(nothing, fd) < 0) _exit(1);
  if (close_range(3, ~0u, 0) == 0) return;
  const long most = sysconf(_SC_OPEN_MAX);  // a kernel older than 5.9
  for (int fd = 3; fd < (most > 0 ? most : 65536); ++fd) close(fd);
}

}  // namespace

Browser::~Browser() {
  if (!file_.empty()) unlink(file_.c_str());
}

bool Browser::open(const std::string& address) {
  if (!std::getenv("DISPLAY") && !std::getenv("WAYLAND_DISPLAY")) return false;
  if (file_.empty()) file_ = redirect_to(address);
  if (file_.empty()) return false;
  const pid_t child = fork();
  if (child < 0) return false;
  if (child == 0) {
    if (fork() == 0) {
      setsid();
      leave_nothing_open();
      execlp("xdg-open", "xdg-open", file_.c_str(), static_cast<char*>(nullptr));
      _exit(127);
    }
    _exit(0);
  }
  int status;
  waitpid(child, &status, 0);
  return true;
}

}  // namespace h6::io::view
