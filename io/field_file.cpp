// field_file.cpp - fields to and from OpenVDB files.
//
//   distance  FloatGrid, level set [m]; a leaf of 8^3 voxels is a brick, all of it active
//   far       FloatGrid, one voxel every 8: the far grid, as it stands
//   part      Int32Grid, one voxel a brick; only where the mesh has parts
// The rest of FieldData is metadata of `distance`, named hapsix_*. Leaves run z fastest, bricks x.
//
// OpenVDB trusts its input: an exception while it reads a tree frees what was never made, and an
// uncompressed file does not notice a flipped bit. So our files carry a seal over all bytes that is
// looked at before OpenVDB sees them; and for anybody's files, check_vdb_lengths has looked at
// every length before OpenVDB allocates by it, and past its end a file reads as zeros, which end
// every tree.
#include "io/field_file.h"

#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/SignedFloodFill.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "io/field_grids.h"
#include "io/file_seal.h"
#include "io/write_aside.h"
#include "sched/parallel_for.h"

namespace h6::io {
namespace {

using openvdb::FloatGrid;
using openvdb::Int32Grid;
using FloatLeaf = FloatGrid::TreeType::LeafNodeType;
using Leaves = std::vector<FloatLeaf*>;

std::string key(const char* name) { return std::string("hapsix_") + name; }

// How many of the file's units make a metre: 1, unless voxels are so small that OpenVDB takes their
// volume for zero (it refuses transforms below 3e-15). hapsix_units_per_metre says so in the file;
// our own size and place come from metadata in metres.
double units_per_metre(const FieldData& field) {
  double units = 1;
  while (field.voxel_size * units < 2e-5) units *= 1000;
  return units;
}

openvdb::math::Transform::Ptr make_transform(const FieldData& field, double spacing) {
  const double u = units_per_metre(field);
  auto transform = openvdb::math::Transform::createLinearTransform(u * spacing);
  transform->postTranslate(
      openvdb::Vec3d(u * field.origin.x, u * field.origin.y, u * field.origin.z));
  return transform;
}

struct Place {
  std::array<std::int32_t, 3> size;
  std::array<std::int32_t, 3> at(std::size_t i) const {
    const std::size_t x = std::size_t(size[0]), y = std::size_t(size[1]);
    return {std::int32_t(i % x), std::int32_t(i / x % y), std::int32_t(i / x / y)};
  }
  std::size_t index(std::int32_t a, std::int32_t b, std::int32_t c) const {
    return (std::size_t(c) * std::size_t(size[1]) + std::size_t(b)) * std::size_t(size[0]) +
           std::size_t(a);
  }
  std::size_t count() const {
    return std::size_t(size[0]) * std::size_t(size[1]) * std::size_t(size[2]);
  }
};

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

// ---- writing ------------------------------------------------------------------------------------

FloatGrid::Ptr distance_grid(const FieldData& field) {
  auto grid = FloatGrid::create(float(field.band));
  grid->setName("distance");
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  grid->setTransform(make_transform(field, field.voxel_size));
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

  grid->insertMeta(key("format"), openvdb::Int32Metadata(1));
  grid->insertMeta(key("bricks"), openvdb::Vec3IMetadata(openvdb::Vec3i(field.bricks.data())));
  grid->insertMeta(key("origin"), openvdb::Vec3DMetadata(openvdb::Vec3d(
                                      field.origin.x, field.origin.y, field.origin.z)));
  grid->insertMeta(key("voxel_size"), openvdb::DoubleMetadata(field.voxel_size));
  grid->insertMeta(key("band"), openvdb::DoubleMetadata(field.band));
  grid->insertMeta(key("offset"), openvdb::DoubleMetadata(field.offset));
  grid->insertMeta(key("sign_mode"), openvdb::StringMetadata(field.sign_mode));
  grid->insertMeta(key("units_per_metre"), openvdb::DoubleMetadata(units_per_metre(field)));
  grid->insertMeta(key("input_hash"), openvdb::StringMetadata(field.input_hash));
  grid->insertMeta(key("triangles"),
                   openvdb::Int64Metadata(static_cast<openvdb::Int64>(field.triangles)));
  grid->insertMeta(key("parts"), openvdb::Int32Metadata(std::int32_t(field.part_names.size())));
  for (std::size_t i = 0; i < field.part_names.size(); ++i)
    grid->insertMeta(key("part_") + std::to_string(i),
                     openvdb::StringMetadata(field.part_names[i]));
  return grid;
}

FloatGrid::Ptr far_grid(const FieldData& field) {
  auto grid = FloatGrid::create(float(field.band));
  grid->setName("far");
  grid->setTransform(make_transform(field, 8 * field.voxel_size));
  const Place nodes{{field.bricks[0] + 1, field.bricks[1] + 1, field.bricks[2] + 1}};
  auto access = grid->getAccessor();
  for (std::size_t i = 0; i < field.far_grid.size(); ++i) {
    const auto at = nodes.at(i);
    access.setValueOn(openvdb::Coord(at[0], at[1], at[2]), field.far_grid[i]);
  }
  return grid;
}

Int32Grid::Ptr part_grid(const FieldData& field) {
  auto grid = Int32Grid::create(-1);
  grid->setName("part");
  grid->setTransform(make_transform(field, 8 * field.voxel_size));
  const Place cells{field.bricks};
  auto access = grid->getAccessor();
  for (std::size_t c = 0; c < field.brick_index.size(); ++c) {
    if (field.brick_index[c] < 0) continue;
    const auto at = cells.at(c);
    access.setValueOn(openvdb::Coord(at[0], at[1], at[2]),
                      field.part[std::size_t(field.brick_index[c])]);
  }
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
         (f.part.empty() || f.part.size() == f.brick_count());
}

// OpenVDB does not tell that a write failed; then the places it noted do not fit the file.
Outcome write_grids(const std::filesystem::path& path, const openvdb::GridPtrVec& grids,
                    Compression compression) {
  openvdb::io::File out(path.string());
  out.setCompression(compression == Compression::none
                         ? openvdb::io::COMPRESS_NONE
                         : openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK);
  openvdb::MetaMap seal;
  seal.insertMeta("hapsix_seal", openvdb::StringMetadata(seal_text()));
  out.write(grids, seal);
  out.close();
  if (!check_vdb_lengths(path))
    return Failure{"the field could not be written whole: is the disk full?"};
  return seal_file(path);
}

// ---- reading ------------------------------------------------------------------------------------

template <class T>
bool take(const openvdb::GridBase& grid, const char* name, T& value) {
  const auto meta = grid.getMetadata<openvdb::TypedMetadata<T>>(key(name));
  if (!meta) return false;
  value = meta->value();
  return true;
}

bool take_head(const FloatGrid& grid, FieldData& f, std::int32_t& parts) {
  openvdb::Vec3i bricks;
  openvdb::Vec3d origin;
  openvdb::Int64 triangles = 0;
  std::int32_t format = 0;
  const bool whole = take(grid, "format", format) && format == 1 && take(grid, "bricks", bricks) &&
                     take(grid, "origin", origin) && take(grid, "voxel_size", f.voxel_size) &&
                     take(grid, "band", f.band) && take(grid, "offset", f.offset) &&
                     take(grid, "sign_mode", f.sign_mode) &&
                     take(grid, "input_hash", f.input_hash) && take(grid, "triangles", triangles) &&
                     triangles >= 0 && take(grid, "parts", parts) && parts >= 0;
  if (!whole) return false;
  f.triangles = std::size_t(triangles);
  f.origin = {origin.x(), origin.y(), origin.z()};
  for (std::size_t k = 0; k < 3; ++k) {
    f.bricks[k] = bricks[int(k)];
    if (f.bricks[k] < 1 || f.bricks[k] > kMaxBricksOnSide) return false;
  }
  return std::isfinite(origin.x() + origin.y() + origin.z()) && std::isfinite(f.voxel_size) &&
         f.voxel_size > 0 && std::isfinite(f.band) && f.band > 0 && std::isfinite(f.offset);
}

bool take_bricks(FloatGrid& grid, FieldData& f) {
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

bool take_far(const FloatGrid& grid, FieldData& f) {
  const Place nodes{{f.bricks[0] + 1, f.bricks[1] + 1, f.bricks[2] + 1}};
  f.far_grid.resize(nodes.count());
  const auto access = grid.getConstAccessor();
  for (std::size_t i = 0; i < f.far_grid.size(); ++i) {
    const auto at = nodes.at(i);
    if (!access.probeValue(openvdb::Coord(at[0], at[1], at[2]), f.far_grid[i])) return false;
    if (!std::isfinite(f.far_grid[i])) return false;
  }
  return true;
}

bool take_parts(const FloatGrid& distance, const Int32Grid* grid, std::int32_t parts,
                FieldData& f) {
  for (std::int32_t i = 0; i < parts; ++i) {
    std::string name;
    const std::string at = "part_" + std::to_string(i);
    if (!take(distance, at.c_str(), name)) return false;
    f.part_names.push_back(name);
  }
  if (grid == nullptr) return true;
  const Place cells{f.bricks};
  const auto access = grid->getConstAccessor();
  f.part.resize(f.brick_count());
  for (std::size_t c = 0; c < f.brick_index.size(); ++c) {
    if (f.brick_index[c] < 0) continue;
    const auto at = cells.at(c);
    std::int32_t& part = f.part[std::size_t(f.brick_index[c])];
    if (!access.probeValue(openvdb::Coord(at[0], at[1], at[2]), part)) return false;
    if (part < 0 || (parts > 0 && part >= parts)) return false;
  }
  return true;
}

template <class Grid>
typename Grid::Ptr find(const openvdb::GridPtrVec& grids, const std::string& name) {
  for (const auto& grid : grids)
    if (grid && grid->getName() == name)
      if (auto typed = openvdb::gridPtrCast<Grid>(grid)) return typed;
  return nullptr;
}

// A file that goes on with zeros behind its end, and remembers that somebody went there.
class ZerosBehind : public std::filebuf {
 public:
  bool passed() const { return passed_ > 0; }

 protected:
  std::streamsize xsgetn(char* out, std::streamsize count) override {
    const std::streamsize there = std::max<std::streamsize>(0, std::filebuf::xsgetn(out, count));
    if (there < count) {
      passed_ += count - there;
      if (passed_ > kMostZeros) throw std::ios_base::failure("too many bytes past the end");
      std::fill(out + there, out + count, char{0});
    }
    return count;
  }
  int_type uflow() override {
    const int_type c = std::filebuf::uflow();
    if (!traits_type::eq_int_type(c, traits_type::eof())) return c;
    ++passed_;
    return traits_type::to_int_type(char{0});
  }

 private:
  static constexpr std::streamsize kMostZeros = 256 << 20;
  std::streamsize passed_ = 0;
};

Result<openvdb::GridPtrVec> read_grids(const std::filesystem::path& file) {
  ZerosBehind bytes;
  bytes.open(file, std::ios::in | std::ios::binary);
  std::istream in(&bytes);
  openvdb::io::Stream stream(in, /*delayLoad=*/false);
  openvdb::GridPtrVec grids = *stream.getGrids();
  if (bytes.passed())
    return Failure{file.string() + " ends too early or is damaged: it is no whole OpenVDB file"};
  return grids;
}

Result<FieldData> take_field(const openvdb::GridPtrVec& grids, const std::string& name) {
  const auto distance = find<FloatGrid>(grids, "distance");
  if (!distance || !distance->getMetadata<openvdb::Int32Metadata>(key("format")))
    return foreign_field(grids, name);
  FieldData field;
  std::int32_t parts = 0;
  const auto far = find<FloatGrid>(grids, "far");
  const auto part = find<Int32Grid>(grids, "part");
  if (!take_head(*distance, field, parts) || !take_bricks(*distance, field) || !far ||
      !take_far(*far, field) || !take_parts(*distance, part.get(), parts, field))
    return Failure{name + " is a damaged field: bake it again"};
  return field;
}

}  // namespace

Outcome write_field(const std::filesystem::path& file, const FieldData& field,
                    Compression compression) {
  if (!consistent(field))
    return Failure{"the field for " + file.string() + " is not consistent: nothing was written"};
  try {
    openvdb::initialize();
    openvdb::GridPtrVec grids{distance_grid(field), far_grid(field)};
    if (!field.part.empty()) grids.push_back(part_grid(field));
    return write_aside(file, [&](const std::filesystem::path& path) {
      return write_grids(path, grids, compression);
    });
  } catch (const std::exception& e) {
    return Failure{"cannot write " + file.string() + ": " + e.what()};
  }
}

Result<FieldData> read_field(const std::filesystem::path& file) {
  const std::string name = file.string();
  if (const Outcome sane = check_vdb_lengths(file); !sane) return sane.failure();
  try {
    const Result<Seal> seal = check_seal(file);
    if (!seal) return seal.failure();
    if (*seal == Seal::broken)
      return Failure{name + " is a damaged field (its checksum differs): bake it again"};
    openvdb::initialize();
    const Result<openvdb::GridPtrVec> grids = read_grids(file);
    if (!grids) return grids.failure();
    return take_field(*grids, name);
  } catch (const std::ios_base::failure&) {
    return Failure{name + " ends too early or is damaged: it is no whole OpenVDB file"};
  } catch (const std::bad_alloc&) {
    return Failure{name + " is damaged, or too large for this machine's memory"};
  } catch (const std::exception& e) {
    return Failure{name + " cannot be read as OpenVDB: " + e.what()};
  }
}

}  // namespace h6::io
