// SPDX-License-Identifier: Apache-2.0
#include "io/record/first_in_child.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <string>

// The child inherits a fuzzer, and the sanitizer would report to it.
extern "C" void __sanitizer_set_death_callback(void (*)()) __attribute__((weak));

namespace h6::io::recording {
namespace {

// It differs from that of any other file, and changes with the file.
struct Identity {
  dev_t device = 0;
  ino_t number = 0;
  off_t bytes = 0;
  timespec changed{};
  std::string as;
  bool operator==(const Identity& o) const {
    return device == o.device && number == o.number && bytes == o.bytes &&
           changed.tv_sec == o.changed.tv_sec && changed.tv_nsec == o.changed.tv_nsec && as == o.as;
  }
};

Identity identity_of(const std::filesystem::path& file, const char* what) {
  struct stat s {};
  if (stat(file.c_str(), &s) != 0) return {};
  return {s.st_dev, s.st_ino, s.st_size, s.st_ctim, what};
}

// A file system's clock is coarse, so a file of this moment may change again without a sign.
bool is_settled(const Identity& file) {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  return now.tv_sec - file.changed.tv_sec > 2;
}

[[noreturn]] void be_the_child(unsigned seconds, const std::function<void()>& read) {
  for (const int signal : {SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL, SIGALRM})
    ::signal(signal, SIG_DFL);
  if (__sanitizer_set_death_callback) __sanitizer_set_death_callback(nullptr);
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
  if (nowhere >= 0) dup2(nowhere, 1), dup2(nowhere, 2);
  alarm(seconds);
  try {
    read();
  } catch (...) {  // it will be met again, and told, outside
  }
  _exit(0);
}

}  // namespace

Outcome first_in_child(const std::filesystem::path& file, const char* what,
                       const std::function<void()>& read) {
  static Identity survived;  // under the LibraryLock
  const Identity identity = identity_of(file, what);
  if (identity.number != 0 && identity == survived) return Done{};
  const unsigned seconds = 60 + static_cast<unsigned>(identity.bytes / 10'000'000);
  std::fflush(nullptr);  // else the child would write buffered output a second time
  const pid_t child = fork();
  if (child == 0) be_the_child(seconds, read);
  if (child < 0)
    return Failure{"cannot read " + file.string() + ": the system gives no process (" +
                   std::strerror(errno) + ")"};
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) {
    survived = is_settled(identity) ? identity : Identity{};
    return Done{};
  }
  const std::string cannot = "cannot read " + file.string() + ": ";
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM)
    return Failure{cannot + "reading it does not end; it is damaged, use another copy"};
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL)
    return Failure{cannot + "it needs more memory than there is"};
  return Failure{cannot + "the HDF5 library fails on it; it is damaged, use another copy"};
}

}  // namespace h6::io::recording
