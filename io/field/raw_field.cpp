// SPDX-License-Identifier: Apache-2.0
// raw_field.cpp - one page with the head, then the arrays one after the other: samples,
// brick_index, far_grid, part, triangle, the finer samples, texts. Blocks of the arrays are hashed
// by all threads; the head comes last, with a hash of itself and of the blocks' hashes.
//
// A field that is read keeps its floats in the mapped file. Copies of 2 GB would need 2 GB of fresh
// memory, which the system clears, and which a virtual machine must first get from its host.
#include "io/field/raw_field.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <memory>
#include <new>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "io/file/content_hash.h"
#include "io/file/direct_file.h"
#include "io/file/mapped_file.h"
#include "io/file/write_aside.h"

namespace h6::io {
namespace {

constexpr std::size_t kHashed = std::size_t{4} << 20;
constexpr std::size_t kAhead = 8 * kHashed;  // the disk is asked this much before a block is read
constexpr std::string_view kFieldMagic = "hapsix cached field ", kVersion = "3\n";

struct Head {
  char magic[24] = {};
  std::array<std::int32_t, 3> bricks{};
  std::int32_t zero = 0;
  double origin[3] = {}, voxel_size = 0, band = 0, offset = 0;
  std::uint64_t triangles = 0;
  std::uint64_t brick_count = 0, part_count = 0, triangle_count = 0, text_bytes = 0;
  Hash128 hash;
  std::uint64_t refined_count = 0, fine_index_count = 0, halves_count = 0, quarters_count = 0;
  double tolerance = 0, grown = 0;
  char rest[kDirectPage - 192] = {};
};
static_assert(sizeof(Head) == kDirectPage);

// The arrays of a file in their order.
using Pieces = std::array<std::span<const char>, 10>;

template <class T, class A>
std::span<const char> bytes_of(const std::vector<T, A>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

Pieces pieces_of(const FieldData& f, const std::vector<char>& text) {
  return {bytes_of(f.samples),  bytes_of(f.brick_index), bytes_of(f.far_grid),   bytes_of(f.part),
          bytes_of(f.triangle), bytes_of(f.refined),     bytes_of(f.fine_index), bytes_of(f.halves),
          bytes_of(f.quarters), bytes_of(text)};
}

std::uint64_t total(const Pieces& pieces) {
  std::uint64_t bytes = 0;
  for (const auto& piece : pieces) bytes += piece.size();
  return bytes;
}

std::size_t blocks_of(std::uint64_t bytes) { return std::size_t((bytes + kHashed - 1) / kHashed); }

// Calls copy(bytes of a piece, place in the block, count) for all that lies in a block.
template <class Copy>
void for_overlaps(const Pieces& pieces, std::uint64_t begin, std::size_t count, const Copy& copy) {
  std::uint64_t at = 0;
  for (const auto& piece : pieces) {
    const std::uint64_t first = std::max(at, begin), end = at + piece.size();
    const std::uint64_t last = std::min(end, begin + count);
    if (first < last) copy(piece.data() + (first - at), first - begin, last - first);
    at = end;
  }
}

// Where a block is written from: the place of its samples, the first piece, if that is aligned for
// direct access; else the buffer.
const char* block_place(const Pieces& pieces, std::uint64_t begin, std::size_t count,
                        const char* buffer) {
  const auto& samples = pieces.front();
  if (begin + count > samples.size() || count % kDirectPage != 0) return buffer;
  const char* place = samples.data() + begin;
  return reinterpret_cast<std::uintptr_t>(place) % kDirectPage == 0 ? place : buffer;
}

Hash128 seal(Head head, const std::vector<Hash128>& blocks) {
  head.hash = hash_bytes(blocks.data(), blocks.size() * sizeof(Hash128));
  return hash_bytes(&head, sizeof head);
}

// ---- texts --------------------------------------------------------------------------------------

std::vector<char> texts_of(const FieldData& f) {
  std::vector<char> out;
  const auto put = [&](const std::string& text) {
    const std::uint64_t size = text.size();
    const char* length = reinterpret_cast<const char*>(&size);
    out.insert(out.end(), length, length + sizeof size);
    out.insert(out.end(), text.begin(), text.end());
  };
  put(f.sign_mode);
  put(f.input_hash);
  for (const std::string& name : f.part_names) put(name);
  return out;
}

bool take_texts(std::span<const char> bytes, FieldData& f) {
  std::vector<std::string> texts;
  while (!bytes.empty()) {
    std::uint64_t size = 0;
    if (bytes.size() < sizeof size) return false;
    std::memcpy(&size, bytes.data(), sizeof size);
    bytes = bytes.subspan(sizeof size);
    if (size > bytes.size()) return false;
    texts.emplace_back(bytes.data(), std::size_t(size));
    bytes = bytes.subspan(std::size_t(size));
  }
  if (texts.size() < 2) return false;
  f.sign_mode = texts[0];
  f.input_hash = texts[1];
  f.part_names.assign(texts.begin() + 2, texts.end());
  return true;
}

// ---- writing ------------------------------------------------------------------------------------

Head head_of(const FieldData& f, std::size_t text_bytes) {
  Head head;
  (std::string(kFieldMagic) + std::string(kVersion)).copy(head.magic, sizeof head.magic);
  head.bricks = f.bricks;
  head.origin[0] = f.origin.x, head.origin[1] = f.origin.y, head.origin[2] = f.origin.z;
  head.voxel_size = f.voxel_size;
  head.band = f.band;
  head.offset = f.offset;
  head.triangles = f.triangles;
  head.brick_count = f.brick_count();
  head.part_count = f.part.size();
  head.triangle_count = f.triangle.size();
  head.refined_count = f.refined.size();
  head.fine_index_count = f.fine_index.size();
  head.halves_count = f.halves.size();
  head.quarters_count = f.quarters.size();
  head.tolerance = f.tolerance;
  head.grown = f.grown;
  head.text_bytes = text_bytes;
  return head;
}

int write_all(DirectFile& file, const FieldData& field) {
  const std::vector<char> text = texts_of(field);
  const Pieces pieces = pieces_of(field, text);
  const std::uint64_t size = total(pieces);
  if (const int error = file.reserve(kDirectPage + size)) return error;
  std::vector<Hash128> hashes(blocks_of(size));
  const int error = for_blocks(hashes.size(), kHashed, [&](std::size_t i, char* buffer) {
    const std::uint64_t begin = i * kHashed;
    const std::size_t count = std::size_t(std::min<std::uint64_t>(kHashed, size - begin));
    const char* block = block_place(pieces, begin, count, buffer);
    if (block == buffer)
      for_overlaps(pieces, begin, count, [&](const char* from, std::uint64_t to, std::size_t n) {
        std::memcpy(buffer + to, from, n);
      });
    hashes[i] = hash_bytes(block, count);
    return file.write(kDirectPage + begin, block, count);
  });
  if (error) return error;
  const DirectBuffer page = direct_buffer(kDirectPage);
  if (!page) return ENOMEM;
  Head head = head_of(field, text.size());
  head.hash = seal(head, hashes);
  std::memcpy(page.get(), &head, sizeof head);
  if (const int failed = file.write(0, page.get(), kDirectPage)) return failed;
  return file.cut(kDirectPage + size);
}

// ---- reading ------------------------------------------------------------------------------------

// Whether the arrays that a head announces fill a file with so many bytes behind the head.
bool fits(const Head& head, std::uint64_t bytes) {
  std::uint64_t cells = 1, nodes = 1;
  for (const std::int32_t n : head.bricks) {
    if (n < 1 || n > kMaxBricksOnSide) return false;
    cells *= std::uint64_t(n);
    nodes *= std::uint64_t(n) + 1;
  }
  if (std::max({head.brick_count, head.part_count, head.triangle_count, head.refined_count}) >
          cells ||
      std::max({head.text_bytes, head.fine_index_count, head.halves_count, head.quarters_count}) >
          bytes)
    return false;
  const std::uint64_t announced =
      head.brick_count * 512 * sizeof(float) + cells * sizeof(std::int32_t) +
      nodes * sizeof(float) +
      (head.part_count + head.triangle_count + head.refined_count + head.fine_index_count) *
          sizeof(std::int32_t) +
      (head.halves_count + head.quarters_count) * sizeof(float) + head.text_bytes;
  return announced == bytes;
}

// The seal of the bytes in a file.
int read_seal(const MappedFile& file, const Head& head, Hash128& found) {
  const std::uint64_t size = file.size() - kDirectPage;
  std::vector<Hash128> hashes(blocks_of(size));
  const int error = for_blocks(hashes.size(), 0, [&](std::size_t i, char*) {
    const std::uint64_t begin = kDirectPage + i * kHashed;
    const std::size_t count = std::size_t(std::min<std::uint64_t>(kHashed, file.size() - begin));
    file.expect(begin + kAhead, kHashed);
    if (const int failed = file.fetch(begin, count)) return failed;
    hashes[i] = hash_bytes(file.data() + begin, count);
    return 0;
  });
  found = seal(head, hashes);
  return error;
}

// Takes arrays from a file, one behind the other.
class Arrays {
 public:
  explicit Arrays(std::shared_ptr<const MappedFile> file)
      : file_(std::move(file)), at_(file_->data() + kDirectPage) {}

  // Floats stay in the file.
  void take(Samples& out, std::uint64_t count) {
    float* const place = reinterpret_cast<float*>(at_);
    out = Samples(SampleAllocator<float>(file_, place, std::size_t(count)));
    out.resize(std::size_t(count));
    at_ += count * sizeof(float);
  }
  // Indices are copied: they are checked next, and must not change after that if the file does.
  template <class Indices>
  void take(Indices& out, std::uint64_t count) {
    const auto* const place = reinterpret_cast<const typename Indices::value_type*>(at_);
    out.assign(place, place + count);
    at_ += count * sizeof *place;
  }

 private:
  std::shared_ptr<const MappedFile> file_;
  char* at_;
};

// The field in a file that fits its head; its indices are not checked.
FieldData field_in(const std::shared_ptr<const MappedFile>& file, const Head& head,
                   std::vector<char>& text) {
  FieldData f;
  f.origin = {head.origin[0], head.origin[1], head.origin[2]};
  f.voxel_size = head.voxel_size;
  f.bricks = head.bricks;
  f.band = head.band;
  f.offset = head.offset;
  f.triangles = std::size_t(head.triangles);
  f.tolerance = head.tolerance;
  f.grown = head.grown;
  std::uint64_t cells = 1, nodes = 1;
  for (const std::int32_t n : f.bricks) cells *= std::uint64_t(n), nodes *= std::uint64_t(n) + 1;
  Arrays arrays(file);
  arrays.take(f.samples, head.brick_count * 512);
  arrays.take(f.brick_index, cells);
  arrays.take(f.far_grid, nodes);
  arrays.take(f.part, head.part_count);
  arrays.take(f.triangle, head.triangle_count);
  arrays.take(f.refined, head.refined_count);
  arrays.take(f.fine_index, head.fine_index_count);
  arrays.take(f.halves, head.halves_count);
  arrays.take(f.quarters, head.quarters_count);
  arrays.take(text, head.text_bytes);
  return f;
}

}  // namespace

Outcome write_raw_field(const std::filesystem::path& file, const FieldData& field) {
  if (!consistent(field))
    return Failure{"the field for " + file.string() + " is not consistent: nothing was written"};
  return write_aside(file, [&](const std::filesystem::path& path) -> Outcome {
    DirectFile out;
    int error = out.open(path);
    if (error == 0) error = write_all(out, field);
    if (error) return Failure{"Cannot write " + path.string() + ": " + std::strerror(error) + "."};
    return Done{};
  });
}

Result<FieldData> read_raw_field(const std::filesystem::path& file) {
  const std::string name = file.string();
  const auto cannot_read = [&](int error) {
    return Failure{"Cannot read " + name + ": " + std::strerror(error) + "."};
  };
  try {
    const auto in = std::make_shared<MappedFile>();
    if (const int error = in->open(file)) return cannot_read(error);
    if (const int error = in->fetch(0, std::min(in->size(), kDirectPage)))
      return cannot_read(error);
    const std::string_view start(in->data(), std::min(in->size(), kDirectPage));
    if (!start.starts_with(kFieldMagic)) return Failure{name + " is no field of the cache."};
    if (!start.substr(kFieldMagic.size()).starts_with(kVersion))
      return Failure{name + " was written by another version of hapsix."};
    Head head;
    start.copy(reinterpret_cast<char*>(&head), sizeof head);
    if (in->size() < kDirectPage || !fits(head, in->size() - kDirectPage))
      return Failure{name + " is truncated or damaged."};
    Hash128 found;
    if (const int error = read_seal(*in, head, found)) return cannot_read(error);
    if (found != head.hash) return Failure{name + " is damaged (its checksum differs)."};
    std::vector<char> text;
    FieldData field = field_in(in, head, text);
    if (!take_texts(text, field) || !consistent(field)) return Failure{name + " is damaged."};
    return field;
  } catch (const std::bad_alloc&) {
    return Failure{"There is not enough memory to read " + name + "."};
  }
}

}  // namespace h6::io
