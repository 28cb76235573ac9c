// SPDX-License-Identifier: Apache-2.0
// recording_kill_test.cpp - recordings survive kills at random instants, full disks and readers,
// and no run destroys an older file.
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

#include "io/record/log.h"
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

// In real time every 10 ms the frames that are due at 1 kHz; otherwise `at_once` frames without a
// pause.
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

std::uint64_t rows_on_disk(const fs::path& file) {
  const auto index = recording::index_log(recording::open_log(recording::part_of(file)));
  return index ? index->row_count : 0;
}

}  // namespace

TEST_CASE("frames are on disk within half a second, at any rate") {
  const Folder folder;
  const fs::path file = folder / "run.h5";
  auto recorder = start(file);
  CHECK(read(file).frames.empty());
  REQUIRE(add(*recorder, frames(0, 10)));
  REQUIRE(recorder->event({0.01, "late", ""}));
  std::this_thread::sleep_for(std::chrono::milliseconds(310));
  REQUIRE(recorder->frames(nullptr, 0));  // wall time: the ten rows have waited long enough
  CHECK(read(file).frames.size() == 10);
  CHECK(read(file).events.size() == 1);
  CHECK_FALSE(read(file).whole);
  CHECK_FALSE(read(file).remark.empty());

  // Recorded time: the log is at most half a second behind, however fast frames come.
  for (std::uint64_t done = 10; done < 5000; done += 70) {
    REQUIRE(add(*recorder, frames(done, 70)));
    REQUIRE(rows_on_disk(file) + 500 >= done + 70);
  }
  CHECK(is_prefix(read(file)));
  // A gap in the frames does not delay the rows after it.
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
      // A loaded machine may not schedule the process; that time does not count as lost.
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

TEST_CASE("kills in the midst of writing leave a log that can be read, and the older file") {
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
    CHECK(bytes_of(file) == older);  // a run leaves it alone until it ends

    // After repair nothing of the killed run is left but its recording, and the next run works.
    const bool left = fs::exists(place / "run.h5.part");
    const auto repaired = repair_recording(file);
    REQUIRE(repaired);
    CHECK(repaired->empty() != left);
    CHECK_FALSE(fs::exists(place / "run.h5.part"));
    const Recording r = read(file);
    REQUIRE(is_prefix(r));
    if (!reports.empty()) CHECK(r.frames.size() + 500 >= reports.back().handed_over);
    const fs::path before = place / "run.h5.before";
    const bool replaced = !r.whole;
    CHECK(bytes_of(replaced ? before : file) == older);
    CHECK(plain_shape(file, "/frames/t").at(0) == r.frames.size());
    record(file, 7);
    CHECK(read(file).frames.size() == 7);
    CHECK(fs::exists(before) == replaced);
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

TEST_CASE("a disk with room for the log only: finish says so, and the whole run is kept") {
  const Folder folder;
  const fs::path file = folder / "run.h5";
  const pid_t pid = ::fork();
  if (pid == 0) {
    const rlimit limit{400'000, 400'000};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    auto recorder = start(file);
    const bool fits = add(*recorder, frames(0, 300));
    const Outcome end = recorder->finish("{}");
    recorder.reset();
    ::_exit(fits && !end && end.error().find("`hapsix info ") != std::string::npos ? 0 : 1);
  }
  int status = 0;
  ::waitpid(pid, &status, 0);
  REQUIRE(WIFEXITED(status));
  CHECK(WEXITSTATUS(status) == 0);
  CHECK(fs::exists(folder / "run.h5.part"));
  CHECK(folder.files() == 1);
  const Recording r = read(file);
  CHECK(r.frames.size() == 300);
  CHECK(r.whole);
  CHECK(is_prefix(r));
}

TEST_CASE("a run can be read while it goes on, and a reader of the older file keeps that") {
  const Folder folder;
  const fs::path file = folder / "run.h5";
  record(file, 1000);
  const hid_t h5 = H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  REQUIRE(h5 >= 0);
  auto recorder = start(file);
  for (std::uint64_t i = 0; i < 4000; i += 250) {
    REQUIRE(add(*recorder, frames(i, 250)));
    if (i % 1000 == 0) CHECK(read(file).frames.size() == i + 250);
  }
  CHECK(read(folder / "run.h5.part").frames.size() == 4000);
  CHECK_FALSE(read(file).whole);
  CHECK(mentions(read(file).remark, "still going on"));
  CHECK(repair_recording(file)->empty());  // not while the run goes on
  REQUIRE(recorder->finish("{}"));
  const hid_t data = H5Dopen2(h5, "/frames/hash", H5P_DEFAULT);
  std::vector<std::uint64_t> hashes(1000);
  CHECK(H5Dread(data, H5T_NATIVE_UINT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, hashes.data()) >= 0);
  for (std::uint64_t i = 0; i < 1000; ++i) CHECK(hashes[i] == frame(i).report.state_hash);
  H5Dclose(data);
  H5Fclose(h5);
  CHECK(read(file).frames.size() == 4000);
  CHECK(is_prefix(read(file)));
}

TEST_CASE("a second run on the same file is refused, and a removed log costs nothing") {
  const Folder folder;
  const fs::path file = folder / "run.h5";
  auto first = start(file);
  REQUIRE(add(*first, frames(0, 500)));
  const auto second = Recorder::create(file, head());
  REQUIRE_FALSE(second);
  CHECK(mentions(second.error(), "another run"));
  fs::remove(folder / "run.h5.part");
  REQUIRE(add(*first, frames(500, 1500)));
  REQUIRE(first->finish("{}"));
  CHECK(read(file).frames.size() == 2000);
  CHECK(is_prefix(read(file)));
  CHECK(folder.files() == 1);
}

TEST_CASE("a log that is cut off or damaged anywhere gives the frames before that place") {
  const Folder folder;
  std::vector<char> log;
  {
    auto recorder = start(folder / "run.h5");
    REQUIRE(add(*recorder, frames(0, 250)));
    REQUIRE(recorder->event({0.25, "late", "own computation"}));
    REQUIRE(add(*recorder, frames(250, 300)));
    log = bytes_of(folder / "run.h5.part");
  }
  const fs::path file = folder / "left.h5", part = folder / "left.h5.part";
  std::size_t sizes[3] = {};  // how many logs gave 0, 250, 500 frames
  const auto judge = [&](const std::vector<char>& bytes, std::size_t count) {
    fs::remove(file);
    write_bytes(part, bytes, count);
    const auto repaired = repair_recording(file);
    REQUIRE(repaired);
    CHECK_FALSE(fs::exists(part));
    if (!fs::exists(file)) {
      CHECK(mentions(*repaired, "was removed"));
      return;
    }
    const Recording r = read(file);
    CHECK(mentions(*repaired, ("left.h5.part with " + std::to_string(r.frames.size())).c_str()));
    CHECK(is_prefix(r));
    CHECK_FALSE(r.whole);
    REQUIRE(r.frames.size() % 250 == 0);
    REQUIRE(r.frames.size() <= 500);
    ++sizes[r.frames.size() / 250];
  };
  for (std::size_t size = 0; size < log.size(); size += 1 + log.size() / 97) judge(log, size);
  judge(log, log.size());
  for (std::size_t at = 0; at < log.size(); at += 1 + log.size() / 97) {
    std::vector<char> bytes = log;
    bytes[at] = static_cast<char>(bytes[at] ^ 0x40);
    judge(bytes, bytes.size());
  }
  for (const std::size_t count : sizes) CHECK(count > 0);
}

TEST_CASE("a killed run's log becomes the file, and the older file is kept") {
  const Folder folder;
  const fs::path file = folder / "a.h5", part = folder / "a.h5.part";
  CHECK(repair_recording(file)->empty());
  auto recorder = start(folder / "run.h5");
  REQUIRE(add(*recorder, frames(0, 250)));
  fs::copy_file(folder / "run.h5.part", part);  // nobody holds a lock on the copy
  CHECK(mentions(read(file).remark, "a.h5.part with 250 frames"));
  CHECK_FALSE(read(file).whole);
  CHECK_FALSE(fs::exists(part));
  CHECK(repair_recording(file)->empty());  // nothing is left to do
  CHECK(plain_shape(file, "/frames/t") == std::vector<hsize_t>{250});

  record(file, 20);
  const std::vector<char> older = bytes_of(file);
  fs::copy_file(folder / "run.h5.part", part);
  const auto replaced = repair_recording(part);
  REQUIRE(replaced);
  CHECK(mentions(*replaced, "kept as a.h5.before"));
  CHECK(plain_shape(file, "/frames/t") == std::vector<hsize_t>{250});
  CHECK(bytes_of(folder / "a.h5.before") == older);

  // The next run begins all the same, and only its own file is replaced.
  fs::copy_file(folder / "run.h5.part", part);
  record(file, 7);
  CHECK(read(file).frames.size() == 7);
  CHECK(bytes_of(folder / "a.h5.before") == older);
  CHECK(plain_shape(folder / "a.h5.before-2", "/frames/t") == std::vector<hsize_t>{250});
}
