// SPDX-License-Identifier: Apache-2.0
// recording_kill_test.cpp - recordings survive kills at random instants, full disks and readers,
// and cost no older file.
#include <doctest/doctest.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "io/record/copies.h"
#include "io/record/recording.h"
#include "tests/io/record/recorded_frames.h"

using namespace h6;
using namespace h6::io;
using namespace h6::recorded;
using Clock = std::chrono::steady_clock;

namespace {

// ---- a process that records until it is killed

struct Report {
  std::uint64_t handed_over;
  Clock::time_point when;
};

struct Victim {
  pid_t pid;
  int reports;
};

// Real time: what is due, every 10 ms, at 1 kHz. Otherwise `at_once` frames without a pause.
Victim record_until_killed(const fs::path& file, bool real_time, std::size_t at_once) {
  int ends[2];
  REQUIRE(::pipe(ends) == 0);
  const pid_t pid = ::fork();
  if (pid != 0) {
    ::close(ends[1]);
    return {pid, ends[0]};
  }
  auto recorder = Recorder::create(file, head());
  const auto began = Clock::now();
  for (std::uint64_t done = 0; recorder;) {
    std::size_t count = at_once;
    if (real_time) {
      std::this_thread::sleep_until(began + std::chrono::milliseconds(done));
      const auto due = (Clock::now() - began) / std::chrono::milliseconds(1) + 10;
      count = static_cast<std::size_t>(due) - done;
    }
    if (!add(**recorder, frames(done, count))) break;
    done += count;
    const Report report{done, Clock::now()};
    if (::write(ends[1], &report, sizeof report) != sizeof report) break;
  }
  ::_exit(1);
}

std::vector<Report> kill_and_listen(const Victim& victim) {
  ::kill(victim.pid, SIGKILL);
  ::waitpid(victim.pid, nullptr, 0);
  std::vector<Report> all;
  for (Report r; ::read(victim.reports, &r, sizeof r) == sizeof r;) all.push_back(r);
  ::close(victim.reports);
  return all;
}

}  // namespace

TEST_CASE("what was handed over is on disk soon, at any rate of frames") {
  const Folder folder;
  const fs::path file = folder / "run.h5";
  auto recorder = start(file);
  CHECK(plain_shape(file, "/frames/t") == std::vector<hsize_t>{0});
  REQUIRE(add(*recorder, frames(0, 10)));
  REQUIRE(recorder->event({0.01, "late", ""}));
  std::this_thread::sleep_for(std::chrono::milliseconds(310));
  REQUIRE(recorder->frames(nullptr, 0));  // wall time: the ten have waited long enough
  CHECK(read(file).frames.size() == 10);
  CHECK(read(file).events.size() == 1);
  CHECK_FALSE(read(file).whole);
  CHECK_FALSE(read(file).remark.empty());

  // Recorded time: never more than half a second behind, however fast frames come.
  for (std::uint64_t done = 10; done < 5000; done += 70) {
    REQUIRE(add(*recorder, frames(done, 70)));
    REQUIRE(plain_shape(file, "/frames/t").at(0) + 500 >= done + 70);
  }
  // Frames that were lost on the way do not hold back the others.
  REQUIRE(add(*recorder, frames(20000, 1)));
  REQUIRE(add(*recorder, frames(20900, 1)));
  CHECK(read(file).frames.back().report.frame == 20900);
}

TEST_CASE(
    "50 runs killed at random instants leave files that open and lack at most half a second") {
  const Folder folder;
  std::mt19937_64 random(20);
  std::size_t kills = 0;
  double worst = 0;
  for (int round = 0; round < 5; ++round) {
    std::vector<std::pair<fs::path, Victim>> victims;
    std::vector<Clock::duration> lives;
    for (int i = 0; i < 10; ++i) {
      const std::string name = "run" + std::to_string(round) + std::to_string(i) + ".h5";
      const fs::path file = folder / name.c_str();
      victims.emplace_back(file, record_until_killed(file, true, 0));
      lives.push_back(std::chrono::milliseconds(100 + random() % 1400));
    }
    std::sort(lives.begin(), lives.end());
    const auto began = Clock::now();
    for (std::size_t i = 0; i < victims.size(); ++i) {
      const auto& [file, victim] = victims[i];
      std::this_thread::sleep_until(began + lives[i]);
      const auto killed = Clock::now();
      const std::vector<Report> reports = kill_and_listen(victim);
      const Recording r = read(file);
      ++kills;
      REQUIRE(is_prefix(r));
      CHECK_FALSE(r.whole);
      CHECK(plain_shape(file, "/frames/wrench").at(0) == r.frames.size());
      if (reports.empty()) continue;
      CHECK(r.frames.size() + 500 >= reports.back().handed_over);
      // A loaded machine may not let the process run at all: that time is not held against it.
      Clock::duration withheld{};
      for (std::size_t k = 1; k < reports.size(); ++k)
        withheld = std::max(withheld,
                            reports[k].when - reports[k - 1].when - std::chrono::milliseconds(60));
      for (const Report& report : reports)
        if (report.handed_over > r.frames.size()) {
          const std::chrono::duration<double> lost = killed - report.when;
          worst = std::max(worst, lost.count());
          CHECK(lost <= std::chrono::milliseconds(500) + withheld);
          break;
        }
    }
  }
  MESSAGE(kills << " kills in real time, at most " << worst << " s lost");
  CHECK(kills == 50);
}

TEST_CASE("kills in the midst of writing leave a whole file and the older one") {
  const Folder folder;
  std::mt19937_64 random(21);
  for (int i = 0; i < 40; ++i) {
    const Folder place;
    const fs::path file = place / "run.h5";
    record(file, 5);
    const std::vector<char> older = bytes_of(file);
    const Victim victim = record_until_killed(file, false, 1 + random() % 600);
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 60000));
    const std::vector<Report> reports = kill_and_listen(victim);
    const Recording r = read(file);
    REQUIRE(is_prefix(r));
    if (!reports.empty()) CHECK(r.frames.size() + 500 >= reports.back().handed_over);
    const fs::path before = place / "run.h5.before";
    const bool replaced = !r.whole;
    CHECK(bytes_of(replaced ? before : file) == older);

    // After repair nothing of the killed run is left but its recording, and the next run works.
    for (const char* other : {"run.h5.part", "run.h5.swap"})
      if (fs::exists(place / other))
        fs::last_write_time(place / other,
                            fs::file_time_type::clock::now() - std::chrono::seconds(60));
    const bool left = fs::exists(place / "run.h5.part") || fs::exists(place / "run.h5.swap");
    const auto repaired = repair_recording(file);
    REQUIRE(repaired);
    CHECK(repaired->empty() != left);
    CHECK_FALSE(fs::exists(place / "run.h5.part"));
    CHECK(plain_shape(file, "/frames/t").at(0) == r.frames.size());
    record(file, 7);
    CHECK(read(file).frames.size() == 7);
    // Killed after the older file got its second name and before the new one took its place, both
    // names hold it: one file too many, nothing lost.
    if (replaced) CHECK(fs::exists(before));
    if (fs::exists(before)) CHECK(bytes_of(before) == older);
  }
}

TEST_CASE("an older recording is replaced only by a finished one") {
  const Folder folder;
  const fs::path file = folder / "run.h5";
  record(file, 300);
  const std::vector<char> older = bytes_of(file);
  { auto nothing = start(file); }  // as when the device does not open
  CHECK(bytes_of(file) == older);
  CHECK(folder.files() == 1);
  {
    auto unfinished = start(file);
    REQUIRE(add(*unfinished, frames(0, 3)));
    CHECK_FALSE(unfinished->finish("not JSON"));
  }
  CHECK(read(file).frames.size() == 3);
  CHECK_FALSE(read(file).whole);
  CHECK(bytes_of(folder / "run.h5.before") == older);
  record(file, 4);
  CHECK(read(file).frames.size() == 4);
  CHECK(bytes_of(folder / "run.h5.before") == older);
  CHECK(folder.files() == 2);
}

TEST_CASE("a full disk is one sentence, and the frames before it are kept") {
  const Folder folder;
  const fs::path file = folder / "run.h5";
  const pid_t pid = ::fork();
  if (pid == 0) {
    const rlimit limit{1 << 20, 1 << 20};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    auto recorder = Recorder::create(file, head());
    std::string first;
    for (std::uint64_t i = 0; first.empty() && i < 20000; i += 100) {
      const auto some = frames(i, 100);
      const Outcome added = (*recorder)->frames(some.data(), some.size());
      if (!added) first = added.error();
    }
    const Outcome again = (*recorder)->event({1, "", ""}), end = (*recorder)->finish("{}");
    const bool told = first.find(file.string()) != std::string::npos && again.error() == first &&
                      end.error() == first;
    recorder->reset();
    ::_exit(told ? 0 : 1);
  }
  int status = 0;
  ::waitpid(pid, &status, 0);
  CHECK(WIFEXITED(status));
  CHECK(WEXITSTATUS(status) == 0);
  const Recording r = read(file);
  CHECK(r.frames.size() > 500);
  CHECK(is_prefix(r));
  CHECK_FALSE(r.whole);
  CHECK(folder.files() == 1);
}

TEST_CASE("a reader that keeps the file open sees one state of it while the run goes on") {
  const Folder folder;
  const fs::path file = folder / "run.h5";
  auto recorder = start(file);
  REQUIRE(add(*recorder, frames(0, 1000)));
  const hid_t h5 = H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  REQUIRE(h5 >= 0);
  for (std::uint64_t i = 1000; i < 4000; i += 250) REQUIRE(add(*recorder, frames(i, 250)));
  const hid_t data = H5Dopen2(h5, "/frames/hash", H5P_DEFAULT);
  std::vector<std::uint64_t> hashes(1000);
  CHECK(H5Dread(data, H5T_NATIVE_UINT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, hashes.data()) >= 0);
  for (std::uint64_t i = 0; i < 1000; ++i) CHECK(hashes[i] == frame(i).report.state_hash);
  H5Dclose(data);
  H5Fclose(h5);
  REQUIRE(recorder->finish("{}"));
  CHECK(read(file).frames.size() == 4000);
  CHECK(is_prefix(read(file)));
}

TEST_CASE("a second run on the same file is told apart, and removed files are made again") {
  const Folder folder;
  const fs::path file = folder / "run.h5";
  auto first = start(file);
  REQUIRE(add(*first, frames(0, 500)));
  fs::remove(folder / "run.h5.part");
  REQUIRE(add(*first, frames(500, 500)));
  fs::remove(file);
  REQUIRE(add(*first, frames(1000, 500)));
  REQUIRE(add(*first, frames(1500, 500)));
  CHECK(read(file).frames.size() == 2000);
  CHECK(is_prefix(read(file)));
  auto second = start(file);
  REQUIRE(add(*second, frames(0, 250)));
  const auto more = frames(2000, 250);
  const Outcome stopped = first->frames(more.data(), more.size());
  REQUIRE_FALSE(stopped);
  CHECK(mentions(stopped.error(), "another program"));
  REQUIRE(second->finish("{}"));
  CHECK(read(file).frames.size() == 250);
}

TEST_CASE("names swap in one step or in three, and a kill between the three is repaired") {
  const Folder folder;
  const fs::path a = folder / "a.h5", b = recording::part_of(a), c = recording::swap_of(a);
  for (const bool one_step : {true, false}) {
    record(a, 10);
    record(b, 20);
    REQUIRE(recording::swap_names(a, b, c, one_step));
    CHECK(read(a).frames.size() == 20);
    CHECK(read(b).frames.size() == 10);
    CHECK_FALSE(fs::exists(c));
  }
  fs::rename(a, c);  // no file at the place, the older copy in .part, the newer in .swap
  CHECK(read(a).frames.size() == 20);
  CHECK(mentions(read(a).remark, "swap"));
  const auto repaired = repair_recording(a);
  REQUIRE(repaired);
  CHECK(mentions(*repaired, "a.h5.swap with 20 frames"));
  CHECK(mentions(*repaired, "a.h5.part, an older copy, was removed"));
  CHECK(repair_recording(a)->empty());  // nothing is left to do
  CHECK(plain_shape(a, "/frames/t") == std::vector<hsize_t>{20});
  CHECK(folder.files() == 1);

  // A damaged file with a copy beside it: the copy takes its place, the damaged one is kept.
  fs::copy_file(a, b);
  fs::resize_file(a, fs::file_size(a) / 2);
  CHECK(read(a).frames.size() == 20);
  const auto replaced = repair_recording(a);
  REQUIRE(replaced);
  CHECK(mentions(*replaced, "kept as a.h5.damaged"));
  CHECK(plain_shape(a, "/frames/t") == std::vector<hsize_t>{20});
  CHECK(fs::exists(folder / "a.h5.damaged"));
  CHECK_FALSE(repair_recording(folder / "none.h5"));
}
