// SPDX-License-Identifier: Apache-2.0
// field_file.cpp - fields to and from OpenVDB files.
//
//   distance  FloatGrid, level set [m]; a leaf of 8^3 voxels is a brick, all of it active
//   far       FloatGrid, one voxel every 8: the far grid, as it stands
//   part      Int32Grid, one voxel a brick; only where the mesh has parts
//   triangle  Int32Grid, one voxel a brick; -1 where a sealed hole is nearest
// The rest of FieldData is metadata of `distance`, named hapsix_*. Leaves run z fastest, bricks x.
// Uncompressed files of ours are laid out and read by stored.cpp, all others by OpenVDB here.
//
// OpenVDB trusts its input: an exception while it reads a tree frees what was never made, and an
// uncompressed file does not notice a flipped bit. So our files carry a seal over all bytes that is
// looked at before OpenVDB sees them; and for anybody's files, scan_vdb has looked at every length
// before OpenVDB allocates by it, and past its end a file reads as zeros, which end every tree.
#include "io/field/field_file.h"

#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/SignedFloodFill.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "io/field/file_seal.h"
#include "io/field/grids.h"
#include "io/file/write_aside.h"
#include "sched/parallel_for.h"

namespace h6::io {
namespace {

using openvdb::FloatGrid;
using FloatLeaf = FloatGrid::TreeType::LeafNodeType;
using Leaves = std::vector<FloatLeaf*>;

void samples_to_leaf(const float* samples, FloatLeaf& leaf) {
  float* out = leaf.buffer().data();
  for (std::size_t z = 0; z < 8; ++z)
    for (std::size_t y = 0; y < 8; ++y)
      for (std::size_t x = 0; x < 8; ++x) out[x * 64 + y * 8 + z] = samples[z * 64 + y * 8 + x];
}

// False where a value is not finite.
bool leaf_to_samples(const FloatLeaf& leaf, float* samples) {
  const float* in = leaf.buffer().data();
  bool finite = true;
  for (std::size_t z = 0; z < 8; ++z)
    for (std::size_t y = 0; y < 8; ++y)
      for (std::size_t x = 0; x < 8; ++x) {
        const float v = in[x * 64 + y * 8 + z];
        finite &= std::isfinite(v);
        samples[z * 64 + y * 8 + x] = v;
      }
  return finite;
}

FloatGrid::Ptr distance_grid(const FieldData& field) {
  const FloatGrid::Ptr grid = bare_distance_grid(field);
  const Place cells{field.bricks};
  std::vector<std::size_t> used;
  for (std::size_t c = 0; c < field.brick_index.size(); ++c)
    if (field.brick_index[c] >= 0) used.push_back(c);
  Leaves leaves(used.size());
  sched::parallel_for(used.size(), 0, [&](std::size_t i) {
    const auto at = cells.at(used[i]);
    leaves[i] = new FloatLeaf(openvdb::Coord(8 * at[0], 8 * at[1], 8 * at[2]), 0.0f, true);
    samples_to_leaf(&field.samples[std::size_t(field.brick_index[used[i]]) * 512], *leaves[i]);
  });
  for (FloatLeaf* leaf : leaves) grid->tree().addLeaf(leaf);
  // Other programs see the inside of a solid as inside; leaves are all active and stay as they are.
  openvdb::tools::signedFloodFill(grid->tree());
  return grid;
}

bool consistent(const FieldData& f) {
  for (std::int32_t n : f.bricks)
    if (n < 1 || n > kMaxBricksOnSide) return false;
  const Place cells{f.bricks}, nodes{{f.bricks[0] + 1, f.bricks[1] + 1, f.bricks[2] + 1}};
  std::size_t used = 0;
  for (std::int32_t row : f.brick_index) {
    if (row >= 0 && std::size_t(row) >= f.brick_count()) return false;
    used += row >= 0;
  }
  return f.brick_index.size() == cells.count() && f.far_grid.size() == nodes.count() &&
         f.samples.size() % 512 == 0 && used == f.brick_count() &&
         (f.part.empty() || f.part.size() == f.brick_count()) &&
         (f.triangle.empty() || f.triangle.size() == f.brick_count());
}

// OpenVDB does not tell that a write failed; then the places it noted do not fit the file.
Outcome write_compressed(const std::filesystem::path& path, const FieldData& field) {
  openvdb::GridPtrVec grids = small_grids(field);
  grids.insert(grids.begin(), distance_grid(field));
  openvdb::io::File out(path.string());
  out.setCompression(openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK);
  openvdb::MetaMap seal;
  seal.insertMeta("hapsix_seal", openvdb::StringMetadata(seal_text()));
  out.write(grids, seal);
  out.close();
  if (!scan_vdb(path)) return Failure{"the field could not be written whole: is the disk full?"};
  return seal_file(path);
}

bool take_leaves(FloatGrid& grid, FieldData& f) {
  const Place cells{f.bricks};
  f.brick_index.assign(cells.count(), -1);
  Leaves leaves;
  grid.tree().getNodes(leaves);
  std::vector<FloatLeaf*> leaf_of(cells.count(), nullptr);
  for (FloatLeaf* leaf : leaves) {
    const openvdb::Coord o = leaf->origin();
    for (int k = 0; k < 3; ++k)
      if (o[k] < 0 || o[k] >= 8 * f.bricks[std::size_t(k)]) return false;
    leaf_of[cells.index(o[0] / 8, o[1] / 8, o[2] / 8)] = leaf;
  }
  std::vector<const FloatLeaf*> rows;
  for (std::size_t c = 0; c < leaf_of.size(); ++c) {
    if (leaf_of[c] == nullptr) continue;
    f.brick_index[c] = std::int32_t(rows.size());
    rows.push_back(leaf_of[c]);
  }
  f.samples.resize(rows.size() * 512);
  std::vector<std::uint8_t> finite(rows.size());
  sched::parallel_for(rows.size(), 0, [&](std::size_t r) {
    finite[r] = leaf_to_samples(*rows[r], &f.samples[r * 512]);
  });
  return std::find(finite.begin(), finite.end(), 0) == finite.end();
}

// Bytes that go on with zeros behind their end, and remember that somebody went there.
class ZerosBehind : public std::streambuf {
 public:
  explicit ZerosBehind(std::streambuf& bytes) : bytes_(bytes) {}
  bool passed() const { return passed_ > 0; }

 protected:
  std::streamsize xsgetn(char* out, std::streamsize count) override {
    const std::streamsize there = std::max<std::streamsize>(0, bytes_.sgetn(out, count));
    if (there < count) {
      passed_ += count - there;
      if (passed_ > kMostZeros) throw std::ios_base::failure("too many bytes past the end");
      std::fill(out + there, out + count, char{0});
    }
    return count;
  }
  int_type underflow() override {
    const int_type c = bytes_.sgetc();
    return traits_type::eq_int_type(c, traits_type::eof()) ? traits_type::to_int_type(char{0}) : c;
  }
  int_type uflow() override {
    const int_type c = bytes_.sbumpc();
    if (!traits_type::eq_int_type(c, traits_type::eof())) return c;
    ++passed_;
    return traits_type::to_int_type(char{0});
  }
  pos_type seekoff(off_type off, std::ios_base::seekdir from, std::ios_base::openmode m) override {
    return bytes_.pubseekoff(off, from, m);
  }
  pos_type seekpos(pos_type at, std::ios_base::openmode m) override {
    return bytes_.pubseekpos(at, m);
  }

 private:
  static constexpr std::streamsize kMostZeros = 256 << 20;
  std::streambuf& bytes_;
  std::streamsize passed_ = 0;
};

Result<FieldData> take_field(const openvdb::GridPtrVec& grids, const std::string& name) {
  const auto distance = own_distance(grids);
  if (!distance) return foreign_field(grids, name);
  FieldData field;
  if (!take_head(*distance, field) || !take_leaves(*distance, field) || !take_small(grids, field))
    return damaged_field(name);
  return field;
}

Result<FieldData> read_any(const std::filesystem::path& file, const VdbLayout& layout) {
  const std::string name = file.string();
  openvdb::initialize();
  if (is_stored(layout)) {
    Result<std::optional<FieldData>> stored = read_stored(file, layout);
    if (!stored) return stored.failure();
    if (*stored) return std::move(**stored);
  }
  const Result<Seal> seal = check_seal(file);
  if (!seal) return seal.failure();
  if (*seal == Seal::broken) return broken_seal(name);
  std::filebuf bytes;
  bytes.open(file, std::ios::in | std::ios::binary);
  const Result<openvdb::GridPtrVec> grids = read_grids(bytes, name);
  if (!grids) return grids.failure();
  return take_field(*grids, name);
}

}  // namespace

Result<openvdb::GridPtrVec> read_grids(std::streambuf& bytes, const std::string& name) {
  ZerosBehind padded(bytes);
  std::istream in(&padded);
  openvdb::io::Stream stream(in, /*delayLoad=*/false);
  openvdb::GridPtrVec grids = *stream.getGrids();
  if (padded.passed())
    return Failure{name + " ends too early or is damaged: it is no whole OpenVDB file"};
  return grids;
}

Outcome write_field(const std::filesystem::path& file, const FieldData& field,
                    Compression compression) {
  if (!consistent(field))
    return Failure{"the field for " + file.string() + " is not consistent: nothing was written"};
  try {
    openvdb::initialize();
    return write_aside(file, [&](const std::filesystem::path& path) {
      return compression == Compression::none ? write_stored(path, field)
                                              : write_compressed(path, field);
    });
  } catch (const std::exception& e) {
    return Failure{"cannot write " + file.string() + ": " + e.what()};
  }
}

Result<FieldData> read_field(const std::filesystem::path& file) {
  const std::string name = file.string();
  const Result<VdbLayout> layout = scan_vdb(file);
  if (!layout) return layout.failure();
  // Before the seal: that of another version may be another.
  if (layout->format && *layout->format != kFieldFormat)
    return Failure{name + " was written by another version of hapsix: bake it again"};
  try {
    return read_any(file, *layout);
  } catch (const std::ios_base::failure&) {
    return Failure{name + " ends too early or is damaged: it is no whole OpenVDB file"};
  } catch (const std::bad_alloc&) {
    return Failure{name + " is damaged, or too large for this machine's memory"};
  } catch (const std::exception& e) {
    return Failure{name + " cannot be read as OpenVDB: " + e.what()};
  }
}

}  // namespace h6::io
