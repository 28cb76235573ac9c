// SPDX-License-Identifier: Apache-2.0
// write_aside_test.cpp - a file is whole or absent, whatever happens to its writer.
#include <doctest/doctest.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "io/file/write_aside.h"
#include "tests/support/sanitized.h"

namespace fs = std::filesystem;
using namespace h6;
using io::write_aside;

namespace {

struct Folder {
  fs::path path = fs::temp_directory_path() / ("hapsix_aside_" + std::to_string(getpid()));
  Folder() {
    fs::remove_all(path);
    fs::create_directories(path);
  }
  ~Folder() { fs::remove_all(path); }
  std::size_t entries() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(path), {}));
  }
};

std::string content(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

Outcome put(const fs::path& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary);
  out << text;
  return out.flush() ? Outcome(Done{}) : Outcome(Failure{"the disk is full."});
}

void says(const Outcome& outcome, const std::string& words) {
  REQUIRE_FALSE(outcome);
  CAPTURE(outcome.error());
  CHECK(outcome.error().find(words) != std::string::npos);
  CHECK(outcome.error().ends_with("."));
}

// Runs in a child process; one that still runs after ten seconds hangs.
template <class Work>
pid_t in_a_child(const Work& work) {
  const pid_t child = fork();
  if (child == 0) {
    alarm(10);
    work();
    _exit(0);
  }
  return child;
}

extern "C" void clean_up_and_end(int signal) {
  io::remove_unfinished();
  _exit(128 + signal);
}

}  // namespace

TEST_CASE("the file appears when it is whole, and nothing else does") {
  const Folder folder;
  const fs::path file = folder.path / "result.vdb";
  fs::path seen;
  CHECK(write_aside(file, [&](const fs::path& aside) {
    seen = aside;
    CHECK_FALSE(fs::exists(file));
    CHECK(aside.parent_path() == folder.path);
    CHECK(aside.extension() == ".vdb");  // packages choose a format by the ending
    return put(aside, "whole");
  }));
  CHECK(content(file) == "whole");
  CHECK_FALSE(fs::exists(seen));
  CHECK(folder.entries() == 1);
}

TEST_CASE("a relative name without a folder is in the working folder") {
  const Folder folder;
  const fs::path before = fs::current_path();
  fs::current_path(folder.path);
  CHECK(write_aside("here.txt", [](const fs::path& aside) { return put(aside, "x"); }));
  fs::current_path(before);
  CHECK(content(folder.path / "here.txt") == "x");
}

TEST_CASE("a writer that fails, throws or writes nothing leaves the old file as it was") {
  const Folder folder;
  const fs::path file = folder.path / "a";
  REQUIRE(put(file, "old"));
  says(write_aside(file,
                   [](const fs::path& aside) {
                     (void)put(aside, "half");
                     return Outcome(Failure{"The disk is full."});
                   }),
       "The disk is full.");
  says(write_aside(file,
                   [](const fs::path& aside) -> Outcome {
                     (void)put(aside, "half");
                     throw std::runtime_error("out of paper");
                   }),
       "out of paper");
  CHECK_THROWS_AS((void)write_aside(file, [](const fs::path&) -> Outcome { throw 7; }), int);
  says(write_aside(file, [](const fs::path&) { return Outcome(Done{}); }), "nothing was written");
  says(write_aside(file,
                   [](const fs::path& aside) {
                     fs::remove(aside);
                     return Outcome(Done{});
                   }),
       "disappeared");
  CHECK(content(file) == "old");
  CHECK(folder.entries() == 1);
}

TEST_CASE("what cannot be replaced is refused before anything is written") {
  const Folder folder;
  const auto never = [](const fs::path&) -> Outcome {
    FAIL("the writer was called");
    return Done{};
  };
  says(write_aside(folder.path / "none" / "a", never), "create it first");
  says(write_aside("", never), "file name");
  says(write_aside(folder.path / "", never), "file name");
  says(write_aside(folder.path, never), "folder");
  says(write_aside("/dev/null", never), "not a regular file");
  REQUIRE(put(folder.path / "plain", "x"));
  says(write_aside(folder.path / "plain" / "a", never), "is not a folder");
}

TEST_CASE("an existing file keeps its permissions, and a link stays a link") {
  const Folder folder;
  const fs::path file = folder.path / "a", link = folder.path / "link";
  REQUIRE(put(file, "old"));
  fs::permissions(file, fs::perms::owner_read | fs::perms::owner_write);
  fs::create_symlink("a", link);
  REQUIRE(write_aside(link, [](const fs::path& aside) { return put(aside, "new"); }));
  CHECK(fs::is_symlink(link));
  CHECK(content(file) == "new");
  CHECK(fs::status(file).permissions() == (fs::perms::owner_read | fs::perms::owner_write));
}

TEST_CASE("names as long as the file system allows can be written aside") {
  const Folder folder;
  const fs::path file = folder.path / (std::string(250, 'n') + ".stl");
  CHECK(write_aside(file, [](const fs::path& aside) { return put(aside, "x"); }));
  CHECK(content(file) == "x");
}

TEST_CASE("many threads write aside at once, even the same file, even more than the table holds") {
  const Folder folder;
  std::vector<std::thread> threads;
  for (int t = 0; t < 40; ++t)
    threads.emplace_back([&, t] {
      const std::string text(1000, static_cast<char>('A' + t % 26));
      (void)write_aside(folder.path / "same", [&](const fs::path& aside) {
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        return put(aside, text);
      });
      (void)write_aside(folder.path / std::to_string(t),
                        [&](const fs::path& aside) { return put(aside, text); });
    });
  for (auto& thread : threads) thread.join();
  CHECK(folder.entries() == 41);
  const std::string same = content(folder.path / "same");
  CHECK(same == std::string(1000, same[0]));
  for (int t = 0; t < 40; ++t) CHECK(content(folder.path / std::to_string(t)).size() == 1000);
}

// In a child with several threads, ThreadSanitizer never delivers signals from outside.
constexpr int kInterrupt = h6::test::kThreadSanitized ? SIGABRT : SIGINT;

TEST_CASE("interrupted, the program removes what it had begun and the old file is untouched") {
  const Folder folder;
  REQUIRE(put(folder.path / "a", "old"));
  const pid_t child = in_a_child([&] {
    signal(kInterrupt, clean_up_and_end);
    (void)write_aside(folder.path / "a", [&](const fs::path& first) {
      (void)put(first, "half");
      return write_aside(folder.path / "b", [&](const fs::path& second) {
        (void)put(second, "half");
        raise(kInterrupt);
        return Outcome(Done{});
      });
    });
  });
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  CHECK(WIFEXITED(status));
  CHECK(WEXITSTATUS(status) == 128 + kInterrupt);
  CHECK(folder.entries() == 1);
  CHECK(content(folder.path / "a") == "old");
}

TEST_CASE("remove_unfinished makes writes in flight fail, and leaves finished and foreign files") {
  const Folder folder;
  io::remove_unfinished();  // nothing in flight: nothing happens
  REQUIRE(write_aside(folder.path / "done", [](const fs::path& p) { return put(p, "x"); }));
  const Outcome outcome = write_aside(folder.path / "a", [&](const fs::path& aside) {
    (void)put(aside, "half");
    // A forked child has the table too, but not the files.
    int status = 0;
    waitpid(in_a_child([] { io::remove_unfinished(); }), &status, 0);
    CHECK(fs::exists(aside));
    io::remove_unfinished();
    CHECK_FALSE(fs::exists(aside));
    return Outcome(Done{});
  });
  says(outcome, "disappeared");
  io::remove_unfinished();
  CHECK(content(folder.path / "done") == "x");
  CHECK(folder.entries() == 1);
}

TEST_CASE("killed at any moment, the file is one of the whole ones") {
  const Folder folder;
  const fs::path file = folder.path / "a";
  REQUIRE(put(file, std::string(300'000, 'a')));
  for (int kill_after_us = 500; kill_after_us < 20'000; kill_after_us += 700) {
    const pid_t child = in_a_child([&] {
      for (char c = 'a';; c = c == 'z' ? 'a' : static_cast<char>(c + 1))
        (void)write_aside(
            file, [&](const fs::path& aside) { return put(aside, std::string(300'000, c)); });
    });
    usleep(static_cast<useconds_t>(kill_after_us));
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    const std::string now = content(file);
    REQUIRE(now.size() == 300'000);
    CHECK(now == std::string(300'000, now[0]));
  }
}
