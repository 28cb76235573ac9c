// SPDX-License-Identifier: Apache-2.0
#include "io/file/gunzip.h"

#include <zlib.h>

#include <algorithm>
#include <limits>
#include <new>

namespace h6::io {
namespace {

constexpr std::string_view kGzipMagic = "\x1f\x8b";
constexpr std::size_t kHarmless = std::size_t{16} << 20;  // [bytes] allowed at any ratio
constexpr std::size_t kMaxRatio = 250;

struct Inflater {
  z_stream z{};
  bool ready = inflateInit2(&z, 16 + MAX_WBITS) == Z_OK;  // 16: gzip, not zlib's own wrapping
  Inflater() = default;
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;
  ~Inflater() { inflateEnd(&z); }
};

std::string place(const std::string& name, std::size_t at, const std::string& what) {
  return name + ", byte " + std::to_string(at) + ": " + what;
}

Result<std::string> inflate_all(std::string_view bytes, const std::string& name,
                                std::size_t limit) {
  if (!bytes.starts_with(kGzipMagic))
    return Failure{name + ": the ending says gzip but the content is not; rename it or pack it."};
  Inflater inflater;
  if (!inflater.ready) return Failure{name + ": no memory to inflate it."};

  std::string out(std::min({limit, bytes.size() * 4 + 4096, kHarmless}), '\0');
  std::size_t read = 0, written = 0;
  constexpr std::size_t kStep = std::numeric_limits<uInt>::max() / 2;  // zlib counts in 32 bits
  for (;;) {
    if (written == out.size()) {
      if (written >= limit)
        return Failure{
            place(name, read,
                  "inflates to more than " + std::to_string(limit) + " bytes; that is refused.")};
      if (written >= kHarmless && written / kMaxRatio > read)
        return Failure{place(name, read,
                             "inflates to more than " + std::to_string(kMaxRatio) +
                                 " times its size, as no mesh does; refused.")};
      // The buffer doubles, but not beyond the ratio: a bomb is noticed before it is stored.
      const std::size_t allowed = std::max(kHarmless, (read + 1) * kMaxRatio + kMaxRatio);
      out.resize(std::min({limit, written * 2 + 4096, std::max(allowed, written + 4096)}));
    }
    z_stream& z = inflater.z;
    const std::size_t in = std::min(kStep, bytes.size() - read);
    const std::size_t room = std::min(kStep, out.size() - written);
    z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data() + read));
    z.avail_in = static_cast<uInt>(in);
    z.next_out = reinterpret_cast<Bytef*>(out.data() + written);
    z.avail_out = static_cast<uInt>(room);
    const int state = inflate(&z, Z_NO_FLUSH);
    read += in - z.avail_in;
    written += room - z.avail_out;

    if (state == Z_STREAM_END) {
      const bool more = bytes.substr(read).starts_with(kGzipMagic);
      if (!more) break;  // gzip ignores other bytes after the last member, too
      inflateReset(&z);
    } else if (state == Z_BUF_ERROR || (state == Z_OK && read == bytes.size() && z.avail_out > 0)) {
      if (read == bytes.size())
        return Failure{place(name, read, "the compressed data end early: the file is truncated.")};
    } else if (state == Z_MEM_ERROR) {
      return Failure{name + ": no memory to inflate it."};
    } else if (state != Z_OK) {
      return Failure{place(name, read,
                           std::string("the compressed data are damaged (") +
                               (z.msg ? z.msg : "bad stream") + ").")};
    }
  }
  out.resize(written);
  return out;
}

}  // namespace

Result<std::string> gunzip(std::string_view bytes, const std::string& name, std::size_t limit) {
  try {
    return inflate_all(bytes, name, limit);
  } catch (const std::bad_alloc&) {
    return Failure{name + ": not enough memory to inflate it."};
  }
}

}  // namespace h6::io
