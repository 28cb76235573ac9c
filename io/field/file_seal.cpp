// SPDX-License-Identifier: Apache-2.0
#include "io/field/file_seal.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <span>
#include <string_view>
#include <vector>

#include "io/file/content_hash.h"
#include "sched/parallel_for.h"

namespace h6::io {
namespace {

constexpr std::string_view kMark = "hapsix-file-checksum:";
constexpr std::size_t kDigits = 32, kHead = 65536, kSealed = std::size_t{4} << 20;

// The bytes of a file, mapped into memory.
class Mapped {
 public:
  explicit Mapped(const std::filesystem::path& file)
      : fd_(open(file.c_str(), O_RDONLY | O_CLOEXEC)) {
    struct stat status {};
    if (fd_ < 0 || fstat(fd_, &status) != 0 || status.st_size <= 0) return;
    void* at = mmap(nullptr, std::size_t(status.st_size), PROT_READ, MAP_PRIVATE, fd_, 0);
    if (at != MAP_FAILED) bytes_ = {static_cast<const char*>(at), std::size_t(status.st_size)};
  }
  ~Mapped() {
    if (!bytes_.empty()) munmap(const_cast<char*>(bytes_.data()), bytes_.size());
    if (fd_ >= 0) close(fd_);
  }
  Mapped(const Mapped&) = delete;
  Mapped& operator=(const Mapped&) = delete;
  std::span<const char> bytes() const { return bytes_; }

 private:
  int fd_;
  std::span<const char> bytes_;
};

std::string_view head_of(std::span<const char> file) {
  return {file.data(), std::min(file.size(), kHead)};
}

// The place of the digits; npos without a mark.
std::size_t digits_at(std::span<const char> file) {
  const std::size_t mark = head_of(file).find(kMark);
  if (mark == std::string_view::npos || mark + kMark.size() + kDigits > file.size())
    return std::string_view::npos;
  return mark + kMark.size();
}

// A hash of the hashes of blocks, so that all threads share the work.
std::string digits_of(std::span<const char> file) {
  const std::size_t at = digits_at(file);
  const auto before = file.first(at), behind = file.subspan(at + kDigits);
  std::vector<Hash128> hashes(1 + (behind.size() + kSealed - 1) / kSealed);
  hashes[0] = hash_bytes(before.data(), before.size());
  sched::parallel_for(hashes.size() - 1, 0, [&](std::size_t i) {
    const auto rest = behind.subspan(i * kSealed);
    hashes[i + 1] = hash_bytes(rest.data(), std::min(kSealed, rest.size()));
  });
  return hex(hash_bytes(hashes.data(), hashes.size() * sizeof(Hash128)));
}

}  // namespace

std::string seal_text() { return std::string(kMark) + std::string(kDigits, '0'); }

Outcome seal_file(const std::filesystem::path& file) {
  const Mapped mapped(file);
  const std::size_t at = digits_at(mapped.bytes());
  if (at == std::string_view::npos) return Failure{file.string() + " has no place for a checksum"};
  const std::string digits = digits_of(mapped.bytes());
  const int fd = open(file.c_str(), O_WRONLY | O_CLOEXEC);
  const bool written = fd >= 0 && pwrite(fd, digits.data(), kDigits, off_t(at)) == ssize_t(kDigits);
  const int why = errno;
  if (fd >= 0) close(fd);
  if (!written) return Failure{"cannot write " + file.string() + ": " + std::strerror(why)};
  return Done{};
}

Result<Seal> check_seal(const std::filesystem::path& file) {
  const Mapped mapped(file);
  const auto bytes = mapped.bytes();
  if (bytes.empty()) return Failure{file.string() + " is empty or cannot be read"};
  const std::size_t at = digits_at(bytes);
  // The file has our name but not our mark, so the mark itself is damaged.
  if (at == std::string_view::npos)
    return head_of(bytes).find("hapsix") == std::string_view::npos ? Seal::none : Seal::broken;
  return digits_of(bytes) == std::string_view(&bytes[at], kDigits) ? Seal::whole : Seal::broken;
}

}  // namespace h6::io
