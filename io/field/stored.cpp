// SPDX-License-Identifier: Apache-2.0
// stored.cpp - uncompressed fields, laid out in OpenVDB's format by many threads.
//
//   head     what OpenVDB writes before the buffers of `distance`: header, metadata, topology
//   records  one a brick, all of a size (vdb_tree.h)
//   tail     the small grids, written by OpenVDB
// Blocks of the file are filled, hashed for the seal and written at once by each thread, and read
// the same way; the first comes last, with the seal. Nothing of a field is there twice.
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/io/io.h>
#include <openvdb/openvdb.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <sstream>

#include "io/field/file_seal.h"
#include "io/field/grids.h"
#include "io/field/vdb_tree.h"
#include "io/file/direct_file.h"

namespace h6::io {
namespace {

using openvdb::FloatGrid;

// ---- writing ------------------------------------------------------------------------------------

template <class T>
void put(std::ostream& out, const T& value) {
  out.write(reinterpret_cast<const char*>(&value), sizeof value);
}

// OpenVDB wants a name for every version of a file; ours are equal where the fields are.
std::string uuid_of(const FieldData& field) {
  const Hash128 parts[2] = {
      hash_bytes(field.input_hash.data(), field.input_hash.size()),
      hash_bytes(field.far_grid.data(), field.far_grid.size() * sizeof(float))};
  std::string digits = hex(hash_bytes(parts, sizeof parts));
  for (const std::size_t at : {8u, 13u, 18u, 23u}) digits.insert(at, "-");
  return digits;
}

void write_header(std::ostream& out, const FieldData& field, std::size_t grids) {
  put(out, std::int64_t{openvdb::OPENVDB_MAGIC});
  put(out, std::uint32_t{openvdb::OPENVDB_FILE_VERSION});
  put(out, std::uint32_t{openvdb::OPENVDB_LIBRARY_MAJOR_VERSION});
  put(out, std::uint32_t{openvdb::OPENVDB_LIBRARY_MINOR_VERSION});
  put(out, char{1});  // grids tell where they begin and end
  out << uuid_of(field);
  openvdb::MetaMap seal;
  seal.insertMeta("hapsix_seal", openvdb::StringMetadata(seal_text()));
  seal.writeMeta(out);
  put(out, std::int32_t(grids));
}

// `base` is where the stream's beginning comes to lie in the file. For `distance` the topology is
// given, and room for its buffers is left behind the stream's end.
void write_grid(std::ostream& out, const openvdb::GridBase& grid, std::uint64_t base,
                const std::string* topology, std::uint64_t buffers) {
  const auto here = [&] { return std::int64_t(base) + std::int64_t(out.tellp()); };
  openvdb::io::GridDescriptor place(grid.getName(), grid.type());
  place.writeHeader(out);
  const auto places = out.tellp();
  place.writeStreamPos(out);
  place.setGridPos(here());
  put(out, std::uint32_t{openvdb::io::COMPRESS_NONE});
  openvdb::io::setDataCompression(out, openvdb::io::COMPRESS_NONE);
  grid.writeMeta(out);
  grid.writeTransform(out);
  if (topology)
    out << *topology;
  else
    grid.writeTopology(out);
  place.setBlockPos(here());
  if (!topology) grid.writeBuffers(out);
  place.setEndPos(here() + std::int64_t(buffers));
  const auto end = out.tellp();
  out.seekp(places);
  place.writeStreamPos(out);
  out.seekp(end);
}

// What OpenVDB notes of a tree, for a tree that is never made.
void add_stats(FloatGrid& grid, const std::vector<VdbLeaf>& leaves) {
  openvdb::Coord low = openvdb::Coord::max(), high = openvdb::Coord::min();
  for (const VdbLeaf& leaf : leaves) {
    const openvdb::Coord first(8 * leaf.brick[0], 8 * leaf.brick[1], 8 * leaf.brick[2]);
    low.minComponent(first);
    high.maxComponent(first.offsetBy(7));
  }
  if (leaves.empty()) low = high = openvdb::Coord(0);
  grid.insertMeta(openvdb::GridBase::META_FILE_BBOX_MIN, openvdb::Vec3IMetadata(low.asVec3i()));
  grid.insertMeta(openvdb::GridBase::META_FILE_BBOX_MAX, openvdb::Vec3IMetadata(high.asVec3i()));
  grid.insertMeta(openvdb::GridBase::META_FILE_VOXEL_COUNT,
                  openvdb::Int64Metadata(std::int64_t(512 * leaves.size())));
  grid.insertMeta(openvdb::GridBase::META_FILE_MEM_BYTES,
                  openvdb::Int64Metadata(
                      std::int64_t(leaves.size() * sizeof(FloatGrid::TreeType::LeafNodeType) +
                                   leaves.size() * 512 * sizeof(float))));
}

struct Layout {
  std::vector<VdbLeaf> leaves;
  std::string head, tail;
  std::uint64_t records() const { return leaves.size() * kLeafRecord; }
  std::uint64_t size() const { return head.size() + records() + tail.size(); }
};

Layout lay_out(const FieldData& field) {
  Layout l;
  l.leaves = leaves_of(field);
  const openvdb::GridPtrVec small = small_grids(field);
  const FloatGrid::Ptr distance = bare_distance_grid(field);
  add_stats(*distance, l.leaves);
  std::ostringstream head, tail;
  const std::string topology = vdb_topology(field, l.leaves);
  write_header(head, field, 1 + small.size());
  write_grid(head, *distance, 0, &topology, l.records());
  l.head = std::move(head).str();
  for (const auto& grid : small) {
    grid->addStatsMetadata();
    write_grid(tail, *grid, l.head.size() + l.records(), nullptr, 0);
  }
  l.tail = std::move(tail).str();
  return l;
}

// The part of `from`, which lies at `at` in the file, that belongs into a block.
void copy_overlap(std::uint64_t at, std::span<const char> from, std::uint64_t begin,
                  std::span<char> block) {
  const std::uint64_t first = std::max(at, begin);
  const std::uint64_t last = std::min(at + from.size(), begin + block.size());
  if (first < last)
    std::memcpy(block.data() + (first - begin), from.data() + (first - at), last - first);
}

void fill_block(const FieldData& field, const Layout& l, std::uint64_t begin,
                std::span<char> block) {
  copy_overlap(0, l.head, begin, block);
  const std::uint64_t first = l.head.size(), end = first + l.records();
  const std::uint64_t from = std::max(first, begin), to = std::min(end, begin + block.size());
  for (std::uint64_t i = (from - first) / kLeafRecord; from < to; ++i) {
    const std::uint64_t at = first + i * kLeafRecord;
    if (at >= to) break;
    const float* samples = &field.samples[std::size_t(l.leaves[i].row) * 512];
    if (at >= begin && at + kLeafRecord <= begin + block.size()) {
      write_leaf(samples, block.data() + (at - begin));
    } else {
      char record[kLeafRecord];
      write_leaf(samples, record);
      copy_overlap(at, record, begin, block);
    }
  }
  copy_overlap(end, l.tail, begin, block);
}

std::string why(int error) { return std::strerror(error); }

// ---- reading ------------------------------------------------------------------------------------

class StoredReader {
 public:
  StoredReader(const std::filesystem::path& path, const VdbLayout& layout)
      : path_(path), layout_(layout), grid_(layout.grids.front()), seals_(layout.size) {}

  Result<std::optional<FieldData>> read() {
    if (const int error = file_.open(path_, DirectFile::For::reading)) return cannot_read(error);
    if (file_.size() != layout_.size) return cannot_read(EIO);
    if (const int error = read_head()) return cannot_read(error);
    if (!read_topology({&head_[grid_.tree], std::size_t(grid_.block - grid_.tree)}, leaves_) ||
        leaves_.size() * kLeafRecord != grid_.end - grid_.block)
      return std::optional<FieldData>{};
    FieldData field;
    field.samples.resize(leaves_.size() * 512);
    tail_.resize(std::size_t(layout_.size - grid_.end));
    if (const int error = read_blocks(field.samples.data())) return cannot_read(error);
    const Seal seal = seals_.check({head_.get(), std::min<std::size_t>(kSealBlock, file_.size())});
    if (seal == Seal::none) return std::optional<FieldData>{};
    if (seal == Seal::broken) return broken_seal(path_.string());
    return take(std::move(field));
  }

 private:
  Failure cannot_read(int error) const {
    return {"cannot read " + path_.string() + ": " + why(error)};
  }

  // The blocks up to the first record, and a page more.
  int read_head() {
    head_blocks_ = std::size_t(grid_.block / kSealBlock + 1);
    head_ = direct_buffer(head_blocks_ * kSealBlock + kDirectPage);
    if (!head_) return ENOMEM;
    return for_blocks(head_blocks_, 0, [&](std::size_t i, char*) {
      return file_.read(i * kSealBlock, &head_[i * kSealBlock],
                        kSealBlock + (i + 1 == head_blocks_ ? kDirectPage : 0));
    });
  }

  int read_blocks(float* samples) {
    // A page more than a block: a record that begins in one block may end in the next.
    static_assert(kLeafRecord <= kDirectPage);
    const int error =
        for_blocks(seals_.blocks(), kSealBlock + kDirectPage, [&](std::size_t i, char* buffer) {
          const std::uint64_t begin = i * kSealBlock;
          const char* bytes = buffer;
          if (i < head_blocks_)
            bytes = &head_[begin];
          else if (const int failed = file_.read(begin, buffer, kSealBlock + kDirectPage))
            return failed;
          const std::size_t count = std::min<std::uint64_t>(kSealBlock, file_.size() - begin);
          seals_.add(i, {bytes, count});
          take_records(begin, bytes, samples);
          copy_overlap(begin, {bytes, count}, grid_.end, tail_);
          return 0;
        });
    return error;
  }

  void take_records(std::uint64_t begin, const char* bytes, float* samples) {
    const std::uint64_t from = std::max(begin, grid_.block);
    std::uint64_t i = (from - grid_.block + kLeafRecord - 1) / kLeafRecord;
    bool good = true;
    for (; i < leaves_.size(); ++i) {
      const std::uint64_t at = grid_.block + i * kLeafRecord;
      if (at >= begin + kSealBlock) break;
      good &= read_leaf(bytes + (at - begin), samples + std::size_t(leaves_[i].row) * 512);
    }
    if (!good) bad_ = true;
  }

  // The rest, once the seal is whole: as a file without a leaf, by OpenVDB.
  Result<std::optional<FieldData>> take(FieldData field) {
    std::string small(head_.get(), grid_.tree);
    small += empty_vdb_topology(0);
    small += tail_;
    std::stringbuf bytes(std::move(small), std::ios::in | std::ios::binary);
    const Result<openvdb::GridPtrVec> grids = read_grids(bytes, path_.string());
    if (!grids) return grids.failure();
    const auto distance = own_distance(*grids);
    if (bad_ || !distance || !take_head(*distance, field) || !place_bricks(field) ||
        !take_small(*grids, field))
      return damaged_field(path_.string());
    return std::optional<FieldData>(std::move(field));
  }

  bool place_bricks(FieldData& f) const {
    const Place cells{f.bricks};
    f.brick_index.assign(cells.count(), -1);
    for (const VdbLeaf& leaf : leaves_) {
      for (std::size_t k = 0; k < 3; ++k)
        if (leaf.brick[k] >= f.bricks[k]) return false;
      f.brick_index[cells.index(leaf.brick[0], leaf.brick[1], leaf.brick[2])] =
          std::int32_t(leaf.row);
    }
    return true;
  }

  const std::filesystem::path& path_;
  const VdbLayout& layout_;
  const VdbGrid& grid_;
  DirectFile file_;
  BlockSeals seals_;
  DirectBuffer head_;
  std::size_t head_blocks_ = 0;
  std::vector<VdbLeaf> leaves_;
  std::string tail_;
  std::atomic<bool> bad_{false};
};

}  // namespace

Outcome write_stored(const std::filesystem::path& path, const FieldData& field) {
  const auto failed = [&](int error) {
    return Failure{"Cannot write " + path.string() + ": " + why(error) + "."};
  };
  const Layout l = lay_out(field);
  DirectFile file;
  if (const int error = file.open(path, DirectFile::For::writing)) return failed(error);
  if (const int error = file.reserve(l.size())) return failed(error);
  BlockSeals seals(l.size());
  const auto block_bytes = [&](std::size_t i) {
    return std::size_t(std::min<std::uint64_t>(kSealBlock, l.size() - i * kSealBlock));
  };
  const DirectBuffer first = direct_buffer(kSealBlock);
  if (!first) return failed(ENOMEM);
  const std::span<char> start{first.get(), block_bytes(0)};
  fill_block(field, l, 0, start);
  seals.add(0, start);
  const int error = for_blocks(seals.blocks() - 1, kSealBlock, [&](std::size_t b, char* buffer) {
    const std::size_t i = b + 1, count = block_bytes(i);
    fill_block(field, l, i * kSealBlock, {buffer, count});
    seals.add(i, {buffer, count});
    return file.write(i * kSealBlock, buffer, count);
  });
  if (error) return failed(error);
  if (!seals.put_digits(start)) return Failure{path.string() + " has no place for a checksum"};
  if (const int last = file.write(0, first.get(), start.size())) return failed(last);
  if (const int cut = file.cut(l.size())) return failed(cut);
  return Done{};
}

bool is_stored(const VdbLayout& layout) {
  if (layout.grids.empty() || layout.format != kFieldFormat) return false;
  const VdbGrid& g = layout.grids.front();
  return g.name == "distance" && g.type == FloatGrid::gridType() &&
         g.compression == openvdb::io::COMPRESS_NONE && g.tree > 0 && g.tree < g.block &&
         g.block <= g.end && (g.end - g.block) % kLeafRecord == 0;
}

Result<std::optional<FieldData>> read_stored(const std::filesystem::path& file,
                                             const VdbLayout& layout) {
  return StoredReader(file, layout).read();
}

}  // namespace h6::io
