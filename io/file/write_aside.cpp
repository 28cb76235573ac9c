// SPDX-License-Identifier: Apache-2.0
#include "io/file/write_aside.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <climits>
#include <cstring>
#include <exception>
#include <fstream>
#include <string>

namespace h6::io {
namespace {

namespace fs = std::filesystem;

// ---- the table a signal handler can read --------------------------------------------------------

// `owner` is 0 while the place is free, -1 while its path is being written, else the process that
// owns the file: a forked child inherits the table but must not remove its parent's files.
struct Unfinished {
  std::atomic<int> owner{0};
  char path[PATH_MAX];
};
static_assert(std::atomic<int>::is_always_lock_free, "a signal handler must not meet a lock");
std::array<Unfinished, 32> unfinished_files;

class Registered {
 public:
  explicit Registered(const std::string& path) {
    if (path.size() >= PATH_MAX) return;
    for (Unfinished& place : unfinished_files) {
      int free = 0;
      if (!place.owner.compare_exchange_strong(free, -1)) continue;
      std::memcpy(place.path, path.c_str(), path.size() + 1);
      place.owner.store(static_cast<int>(getpid()), std::memory_order_release);
      place_ = &place;
      return;
    }
  }
  Registered(const Registered&) = delete;
  Registered& operator=(const Registered&) = delete;
  ~Registered() {
    if (place_) place_->owner.store(0, std::memory_order_release);
  }

 private:
  Unfinished* place_ = nullptr;
};

// ---- the temporary file -------------------------------------------------------------------------

std::string reason(int error) { return std::strerror(error); }

Failure cannot_write(const fs::path& file, const std::string& why) {
  return {"Cannot write " + file.string() + ": " + why + "."};
}

// A new, empty file, on disk and in the table until it is renamed or this is destroyed. It enters
// the table first: a signal in between finds a name without a file, which is harmless.
class TemporaryFile {
 public:
  explicit TemporaryFile(fs::path path) : path_(std::move(path)), registered_(path_.string()) {
    // O_EXCL: a killed process with our number may have left a file of this name behind.
    const int fd = open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    error_ = fd < 0 ? errno : 0;
    ours_ = fd >= 0;
    if (ours_) close(fd);
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() {
    if (ours_) unlink(path_.c_str());
  }
  const fs::path& path() const { return path_; }
  int error() const { return error_; }  // errno of its creation, or 0

  // 0 or errno.
  int sync_and_rename(const fs::path& file, const struct stat* replaced) {
    const int fd = open(path_.c_str(), O_RDONLY | O_CLOEXEC);
    if (fd < 0) return errno;
    if (replaced) (void)!fchmod(fd, replaced->st_mode & 0777);  // some file systems have no modes
    // Other errors mean that the file system cannot sync.
    const bool lost = fsync(fd) != 0 && (errno == EIO || errno == ENOSPC || errno == EDQUOT);
    const int error = lost ? errno : 0;
    close(fd);
    if (error) return error;
    if (rename(path_.c_str(), file.c_str()) != 0) return errno;
    ours_ = false;
    return 0;
  }

 private:
  fs::path path_;
  Registered registered_;
  int error_ = 0;
  bool ours_ = false;
};

fs::path temporary_name(const fs::path& file) {
  static std::atomic<unsigned> counter{0};
  // Cut, because file systems limit names to 255 bytes.
  const std::string stem = file.stem().string().substr(0, 100);
  std::string ending = file.extension().string();
  if (ending.size() > 32) ending.clear();
  return file.parent_path() / (stem + ".unfinished-" + std::to_string(getpid()) + "-" +
                               std::to_string(counter++) + ending);
}

void sync_folder(const fs::path& folder) {
  const int fd = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return;
  fsync(fd);  // best effort: the name, too, survives a power cut
  close(fd);
}

// The writer's sentence, about the requested file instead of the temporary one.
Failure about(const fs::path& file, const fs::path& temporary, std::string why) {
  const std::string asked = file.string(), other = temporary.string();
  for (std::size_t at = 0; (at = why.find(other, at)) != std::string::npos; at += asked.size())
    why.replace(at, other.size(), asked);
  if (why.find(asked) == std::string::npos) why = "Cannot write " + asked + ": " + why;
  return {why};
}

Outcome call(const std::function<Outcome(const fs::path&)>& write, const fs::path& temporary,
             const fs::path& file) {
  try {
    const Outcome written = write(temporary);
    if (!written) return about(file, temporary, written.error());
    return written;
  } catch (const std::exception& e) {
    return cannot_write(file, e.what());
  }
}

}  // namespace

Outcome write_aside(const fs::path& file, const std::function<Outcome(const fs::path&)>& write) {
  if (file.filename().empty() || file.filename() == "." || file.filename() == "..")
    return cannot_write(file, "this names a folder, give a file name");
  std::error_code failed;
  // Absolute, because another thread may change the working folder meanwhile.
  fs::path target = fs::absolute(file, failed);
  if (failed) return cannot_write(file, failed.message());
  if (fs::is_symlink(target, failed)) {
    target = fs::weakly_canonical(target, failed);
    if (failed) return cannot_write(file, failed.message());
  }

  const fs::path folder = target.parent_path();
  struct stat there {};
  if (stat(folder.c_str(), &there) != 0)
    return cannot_write(
        file, "the folder " + folder.string() +
                  (errno == ENOENT ? " does not exist, create it first" : ": " + reason(errno)));
  if (!S_ISDIR(there.st_mode)) return cannot_write(file, folder.string() + " is not a folder");

  const bool exists = stat(target.c_str(), &there) == 0;
  if (exists && S_ISDIR(there.st_mode)) return cannot_write(file, "it is a folder");
  // Renaming over /dev/null, as root, would replace the device.
  if (exists && !S_ISREG(there.st_mode)) return cannot_write(file, "it is not a regular file");
  if (exists && access(target.c_str(), W_OK) != 0) return cannot_write(file, reason(errno));

  for (int attempt = 0; attempt < 100; ++attempt) {
    TemporaryFile temporary(temporary_name(target));
    if (temporary.error() == EEXIST) continue;
    if (temporary.error()) return cannot_write(file, reason(temporary.error()));
    const Outcome written = call(write, temporary.path(), file);
    if (!written) return written;

    struct stat made {};
    if (stat(temporary.path().c_str(), &made) != 0)
      return cannot_write(file, "its temporary file disappeared while it was written");
    if (made.st_size == 0) return cannot_write(file, "nothing was written");
    if (const int error = temporary.sync_and_rename(target, exists ? &there : nullptr))
      return cannot_write(file, reason(error));
    sync_folder(folder);
    return Done{};
  }
  return cannot_write(file, "its folder is full of unfinished files, remove them");
}

Outcome write_text_aside(const fs::path& file, std::string_view text) {
  return write_aside(file, [&](const fs::path& aside) -> Outcome {
    std::ofstream out(aside, std::ios::binary);
    out << text;
    out.close();
    if (!out) return Failure{file.string() + ": writing failed; is the disk full?"};
    return Done{};
  });
}

void remove_unfinished() noexcept {
  const int error = errno;
  const int self = static_cast<int>(getpid());
  for (Unfinished& place : unfinished_files)
    if (place.owner.load(std::memory_order_acquire) == self) unlink(place.path);
  errno = error;
}

}  // namespace h6::io
