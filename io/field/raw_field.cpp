// SPDX-License-Identifier: Apache-2.0
// raw_field.cpp - one page with the head, then the arrays one after the other: samples,
// brick_index, far_grid, part, triangle, the finer samples, texts. Blocks of the arrays are hashed
// while they are written or read, by all threads; the head comes last, with a hash of itself and of
// the blocks' hashes.
#include "io/field/raw_field.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "io/file/content_hash.h"
#include "io/file/direct_file.h"
#include "io/file/write_aside.h"

namespace h6::io {
namespace {

constexpr std::size_t kHashed = std::size_t{4} << 20;
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

// The arrays of a file in their order. Only a reader writes through them.
using Pieces = std::array<std::span<char>, 10>;

template <class T, class A>
std::span<char> bytes_of(const std::vector<T, A>& values) {
  return {const_cast<char*>(reinterpret_cast<const char*>(values.data())),
          values.size() * sizeof(T)};
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

// Where a block is read or written: in place for blocks of the first piece, the samples, whose
// memory is aligned for direct access; else in the buffer.
char* block_place(const Pieces& pieces, std::uint64_t begin, std::size_t count, char* buffer) {
  const auto& samples = pieces.front();
  if (begin + count > samples.size() || count % kDirectPage != 0) return buffer;
  char* place = samples.data() + begin;
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

// A field whose arrays have their sizes; no value when the head does not fit a file of this size.
std::optional<FieldData> room_for(const Head& head, std::uint64_t bytes, std::vector<char>& text) {
  std::uint64_t cells = 1, nodes = 1;
  for (const std::int32_t n : head.bricks) {
    if (n < 1 || n > kMaxBricksOnSide) return std::nullopt;
    cells *= std::uint64_t(n);
    nodes *= std::uint64_t(n) + 1;
  }
  if (std::max({head.brick_count, head.part_count, head.triangle_count, head.refined_count}) >
          cells ||
      std::max({head.text_bytes, head.fine_index_count, head.halves_count, head.quarters_count}) >
          bytes)
    return std::nullopt;
  const std::uint64_t announced =
      head.brick_count * 512 * sizeof(float) + cells * sizeof(std::int32_t) +
      nodes * sizeof(float) +
      (head.part_count + head.triangle_count + head.refined_count + head.fine_index_count) *
          sizeof(std::int32_t) +
      (head.halves_count + head.quarters_count) * sizeof(float) + head.text_bytes;
  if (announced != bytes) return std::nullopt;
  FieldData f;
  f.origin = {head.origin[0], head.origin[1], head.origin[2]};
  f.voxel_size = head.voxel_size;
  f.bricks = head.bricks;
  f.band = head.band;
  f.offset = head.offset;
  f.triangles = std::size_t(head.triangles);
  f.samples.resize(std::size_t(head.brick_count) * 512);
  f.brick_index.resize(std::size_t(cells));
  f.far_grid.resize(std::size_t(nodes));
  f.part.resize(std::size_t(head.part_count));
  f.triangle.resize(std::size_t(head.triangle_count));
  f.refined.resize(std::size_t(head.refined_count));
  f.fine_index.resize(std::size_t(head.fine_index_count));
  f.halves.resize(std::size_t(head.halves_count));
  f.quarters.resize(std::size_t(head.quarters_count));
  f.tolerance = head.tolerance;
  f.grown = head.grown;
  text.resize(std::size_t(head.text_bytes));
  return f;
}

// Fills the pieces and returns the seal of the bytes that it read.
int read_pieces(DirectFile& file, const Head& head, const Pieces& pieces, Hash128& found) {
  const std::uint64_t size = total(pieces);
  std::vector<Hash128> hashes(blocks_of(size));
  const int error = for_blocks(hashes.size(), kHashed, [&](std::size_t i, char* buffer) {
    const std::uint64_t begin = i * kHashed;
    const std::size_t count = std::size_t(std::min<std::uint64_t>(kHashed, size - begin));
    char* block = block_place(pieces, begin, count, buffer);
    if (const int failed = file.read(kDirectPage + begin, block, count)) return failed;
    hashes[i] = hash_bytes(block, count);
    if (block == buffer)
      for_overlaps(pieces, begin, count, [&](char* to, std::uint64_t from, std::size_t n) {
        std::memcpy(to, buffer + from, n);
      });
    return 0;
  });
  found = seal(head, hashes);
  return error;
}

}  // namespace

Outcome write_raw_field(const std::filesystem::path& file, const FieldData& field) {
  if (!consistent(field))
    return Failure{"the field for " + file.string() + " is not consistent: nothing was written"};
  return write_aside(file, [&](const std::filesystem::path& path) -> Outcome {
    DirectFile out;
    int error = out.open(path, DirectFile::For::writing);
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
  DirectFile in;
  if (const int error = in.open(file, DirectFile::For::reading)) return cannot_read(error);
  const DirectBuffer page = direct_buffer(kDirectPage);
  if (!page) return cannot_read(ENOMEM);
  std::memset(page.get(), 0, kDirectPage);
  if (const int error = in.read(0, page.get(), kDirectPage)) return cannot_read(error);
  const std::string_view start(page.get(), kDirectPage);
  if (!start.starts_with(kFieldMagic)) return Failure{name + " is no field of the cache."};
  if (!start.substr(kFieldMagic.size()).starts_with(kVersion))
    return Failure{name + " was written by another version of hapsix."};
  Head head;
  std::memcpy(&head, page.get(), sizeof head);
  try {
    std::vector<char> text;
    std::optional<FieldData> field;
    if (in.size() >= kDirectPage) field = room_for(head, in.size() - kDirectPage, text);
    if (!field) return Failure{name + " is truncated or damaged."};
    Hash128 found;
    if (const int error = read_pieces(in, head, pieces_of(*field, text), found))
      return cannot_read(error);
    if (found != head.hash) return Failure{name + " is damaged (its checksum differs)."};
    if (!take_texts(text, *field) || !consistent(*field)) return Failure{name + " is damaged."};
    return std::move(*field);
  } catch (const std::bad_alloc&) {
    return Failure{"There is not enough memory to read " + name + "."};
  }
}

}  // namespace h6::io
