#include "io/file_seal.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <vector>

#include "io/content_hash.h"
#include "sched/parallel_for.h"

namespace h6::io {
namespace {

constexpr std::string_view kMark = "hapsix-file-checksum:";
constexpr std::size_t kDigits = 32, kHead = 65536, kChunk = std::size_t{16} << 20;

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
  std::string_view bytes() const { return bytes_; }

 private:
  int fd_;
  std::string_view bytes_;
};

std::size_t digits_at(std::string_view bytes) {
  const std::size_t mark = bytes.substr(0, kHead).find(kMark);
  if (mark == std::string_view::npos || mark + kMark.size() + kDigits > bytes.size())
    return std::string_view::npos;
  return mark + kMark.size();
}

// Of everything but the digits: in chunks, then of the chunks' hashes.
std::string hash_without(std::string_view bytes, std::size_t digits) {
  const std::string_view rest = bytes.substr(digits + kDigits);
  const std::size_t chunks = (rest.size() + kChunk - 1) / kChunk;
  std::vector<Hash128> parts(chunks + 1);
  parts[0] = hash_bytes(bytes.data(), digits);
  sched::parallel_for(chunks, 0, [&](std::size_t i) {
    const std::string_view chunk = rest.substr(i * kChunk, kChunk);
    parts[i + 1] = hash_bytes(chunk.data(), chunk.size());
  });
  return hex(hash_bytes(parts.data(), parts.size() * sizeof(Hash128)));
}

}  // namespace

std::string seal_text() { return std::string(kMark) + std::string(kDigits, '0'); }

Outcome seal_file(const std::filesystem::path& file) {
  std::string hash;
  std::size_t at = 0;
  {
    const Mapped mapped(file);
    at = digits_at(mapped.bytes());
    if (at == std::string_view::npos)
      return Failure{file.string() + " has no place for a checksum"};
    hash = hash_without(mapped.bytes(), at);
  }
  const int fd = open(file.c_str(), O_WRONLY | O_CLOEXEC);
  const bool written = fd >= 0 && pwrite(fd, hash.data(), kDigits, off_t(at)) == ssize_t(kDigits);
  const int why = errno;
  if (fd >= 0) close(fd);
  if (!written) return Failure{"cannot write " + file.string() + ": " + std::strerror(why)};
  return Done{};
}

Result<Seal> check_seal(const std::filesystem::path& file) {
  const Mapped mapped(file);
  if (mapped.bytes().empty()) return Failure{file.string() + " is empty or cannot be read"};
  const std::size_t at = digits_at(mapped.bytes());
  if (at == std::string_view::npos) {
    // Our name without our mark: the mark itself is what was damaged.
    const bool ours = mapped.bytes().substr(0, kHead).find("hapsix") != std::string_view::npos;
    return ours ? Seal::broken : Seal::none;
  }
  return mapped.bytes().substr(at, kDigits) == hash_without(mapped.bytes(), at) ? Seal::whole
                                                                                : Seal::broken;
}

}  // namespace h6::io
