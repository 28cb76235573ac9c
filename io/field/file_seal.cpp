// SPDX-License-Identifier: Apache-2.0
#include "io/field/file_seal.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string_view>

#include "sched/parallel_for.h"

namespace h6::io {
namespace {

constexpr std::string_view kMark = "hapsix-file-checksum:";
constexpr std::size_t kDigits = 32, kHead = 65536;

// A file's bytes, mapped; not copied.
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

std::string_view head_of(std::span<const char> first) {
  return {first.data(), std::min(first.size(), kHead)};
}

std::size_t digits_at(std::span<const char> first) {
  const std::size_t mark = head_of(first).find(kMark);
  if (mark == std::string_view::npos || mark + kMark.size() + kDigits > first.size())
    return std::string_view::npos;
  return mark + kMark.size();
}

// What stands before and behind the digits.
Hash128 hash_first(std::span<const char> first) {
  const std::size_t at = digits_at(first);
  if (at == std::string_view::npos) return {};
  const auto behind = first.subspan(at + kDigits);
  const Hash128 both[2] = {hash_bytes(first.data(), at), hash_bytes(behind.data(), behind.size())};
  return hash_bytes(both, sizeof both);
}

BlockSeals seals_of(std::span<const char> bytes) {
  BlockSeals seals(bytes.size());
  sched::parallel_for(seals.blocks(), 0, [&](std::size_t i) {
    const std::size_t begin = i * kSealBlock;
    seals.add(i, bytes.subspan(begin, std::min(kSealBlock, bytes.size() - begin)));
  });
  return seals;
}

}  // namespace

std::string seal_text() { return std::string(kMark) + std::string(kDigits, '0'); }

void BlockSeals::add(std::size_t i, std::span<const char> bytes) {
  hashes_[i] = i == 0 ? hash_first(bytes) : hash_bytes(bytes.data(), bytes.size());
}

bool BlockSeals::put_digits(std::span<char> first) const {
  const std::size_t at = digits_at(first);
  if (at == std::string_view::npos) return false;
  const std::string digits = hex(hash_bytes(hashes_.data(), hashes_.size() * sizeof(Hash128)));
  std::memcpy(first.data() + at, digits.data(), kDigits);
  return true;
}

Seal BlockSeals::check(std::span<const char> first) const {
  const std::size_t at = digits_at(first);
  if (at == std::string_view::npos) {
    // Our name without our mark: the mark itself is what was damaged.
    return head_of(first).find("hapsix") != std::string_view::npos ? Seal::broken : Seal::none;
  }
  const std::string digits = hex(hash_bytes(hashes_.data(), hashes_.size() * sizeof(Hash128)));
  return std::memcmp(first.data() + at, digits.data(), kDigits) == 0 ? Seal::whole : Seal::broken;
}

Outcome seal_file(const std::filesystem::path& file) {
  std::vector<char> first;
  {
    const Mapped mapped(file);
    const auto bytes = mapped.bytes().first(std::min(kSealBlock, mapped.bytes().size()));
    first.assign(bytes.begin(), bytes.end());
    if (!seals_of(mapped.bytes()).put_digits(first))
      return Failure{file.string() + " has no place for a checksum"};
  }
  const std::size_t at = digits_at(first);
  const int fd = open(file.c_str(), O_WRONLY | O_CLOEXEC);
  const bool written =
      fd >= 0 && pwrite(fd, first.data() + at, kDigits, off_t(at)) == ssize_t(kDigits);
  const int why = errno;
  if (fd >= 0) close(fd);
  if (!written) return Failure{"cannot write " + file.string() + ": " + std::strerror(why)};
  return Done{};
}

Result<Seal> check_seal(const std::filesystem::path& file) {
  const Mapped mapped(file);
  if (mapped.bytes().empty()) return Failure{file.string() + " is empty or cannot be read"};
  return seals_of(mapped.bytes())
      .check(mapped.bytes().first(std::min(kSealBlock, mapped.bytes().size())));
}

}  // namespace h6::io
