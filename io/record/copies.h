// SPDX-License-Identifier: Apache-2.0
// copies.h - one file that is whole at every instant while it grows. Private.
//
//   OUT        the published copy: complete, closed, never written to
//   OUT.part   the spare copy: gets the last change and the new one, then the two swap names
//
// A kill at any instant leaves OUT as one change or the next, and perhaps a spare to throw away.
// Each byte is written twice; nothing is ever repaired to be read. A file that was OUT before stays
// as OUT.before (OUT.before-2, ...) until the new one is finished.
#pragma once
#include <filesystem>
#include <string>

#include "hapsix/result.h"
#include "io/record/image.h"

namespace h6::io::recording {

// The file that a symbolic link names: that one is written and has copies beside it.
std::filesystem::path followed(const std::filesystem::path& file);
std::filesystem::path part_of(const std::filesystem::path& file);  // OUT.part
std::filesystem::path swap_of(const std::filesystem::path& file);  // OUT.swap, see swap_names

// Two files in one folder swap their names in one step where the file system can do that. Else in
// three through `spare_name`; with hard links `shown` is there all the time, without it is gone
// for an instant. `one_step` false: the latter, for tests.
bool swap_names(const std::filesystem::path& shown, const std::filesystem::path& other,
                const std::filesystem::path& spare_name, bool one_step = true);

// The name under which an older `file` is kept: the first of .before, .before-2, ... that is free.
std::filesystem::path free_name(const std::filesystem::path& file, const char* ending);

class Copies {
 public:
  explicit Copies(std::filesystem::path file) : file_(std::move(file)) {}
  ~Copies();
  Copies(const Copies&) = delete;
  Copies& operator=(const Copies&) = delete;

  // The first state; an older file makes room.
  Outcome start(const Change& first);
  Outcome publish(Change change);
  // The published copy, for reading; changes with each publish.
  int base() const { return published_.fd; }
  // Puts it on the disk, removes the spare and the file that it replaces.
  Outcome finish();
  // Removes everything of this run and gives the older file its name back.
  void abandon();
  // Leaves the published copy and an older file as they are.
  void drop_spare();

 private:
  struct Copy {
    int fd = -1;
  };
  Outcome prepare_spare();
  Outcome new_spare(bool filled);
  bool named(const std::filesystem::path& name, const Copy& copy) const;
  Failure failed(const char* doing, int error) const;

  std::filesystem::path file_;
  std::filesystem::path before_;  // empty: there was none
  Copy published_, spare_;
  Change behind_;  // what the spare lacks
};

}  // namespace h6::io::recording
