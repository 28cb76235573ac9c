// SPDX-License-Identifier: Apache-2.0
// field_file.cpp - fields to and from OpenVDB files (grids.cpp has their grids).
//
// OpenVDB trusts its input. An exception while it reads a tree frees memory that was never
// allocated, and it does not notice a flipped bit in an uncompressed file. So our files carry a
// seal over all bytes, checked before OpenVDB reads them. For files of any program, scan_vdb checks
// every length before OpenVDB allocates by it, and a file reads as zeros past its end, which end
// every tree.
#include "io/field/field_file.h"

#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>

#include <algorithm>
#include <fstream>

#include "io/field/file_seal.h"
#include "io/field/grids.h"
#include "io/file/free_memory.h"
#include "io/file/write_aside.h"

namespace h6::io {
namespace {

Failure ends_early(const std::string& name) {
  return {name + " ends too early or is damaged: it is no whole OpenVDB file"};
}

Outcome write_grids(const std::filesystem::path& path, const FieldData& field,
                    Compression compression) {
  openvdb::io::File out(path.string());
  out.setCompression(compression == Compression::none
                         ? openvdb::io::COMPRESS_NONE
                         : openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK);
  openvdb::MetaMap seal;
  seal.insertMeta("hapsix_seal", openvdb::StringMetadata(seal_text()));
  out.write(grids_of(field), seal);
  out.close();
  // OpenVDB does not report a failed write; but then the offsets in the file do not fit its size.
  if (!scan_vdb(path)) return Failure{"the field could not be written whole: is the disk full?"};
  return seal_file(path);
}

// A stream that reads as zeros past its end, and remembers whether they were read.
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

// Reads all grids of a file. Fails, with a sentence, when the file ends too early.
Result<openvdb::GridPtrVec> read_grids(const std::filesystem::path& file) {
  std::filebuf bytes;
  bytes.open(file, std::ios::in | std::ios::binary);
  ZerosBehind padded(bytes);
  std::istream in(&padded);
  openvdb::io::Stream stream(in, /*delayLoad=*/false);
  openvdb::GridPtrVec grids = *stream.getGrids();
  if (padded.passed()) return ends_early(file.string());
  return grids;
}

Result<FieldData> read_sealed(const std::filesystem::path& file) {
  const std::string name = file.string();
  const Result<Seal> seal = check_seal(file);
  if (!seal) return seal.failure();
  if (*seal == Seal::broken)
    return Failure{name + " is a damaged field (its checksum differs): bake it again"};
  openvdb::initialize();
  const Result<openvdb::GridPtrVec> grids = read_grids(file);
  if (!grids) return grids.failure();
  if (!are_ours(*grids)) return foreign_field(*grids, name);
  std::optional<FieldData> field = field_of(*grids);
  if (!field) return Failure{name + " is a damaged field: bake it again"};
  return std::move(*field);
}

}  // namespace

Outcome write_field(const std::filesystem::path& file, const FieldData& field,
                    Compression compression) {
  if (!consistent(field))
    return Failure{"the field for " + file.string() + " is not consistent: nothing was written"};
  // OpenVDB's grids hold all samples once more, and leaves that finer samples fill in part.
  const double taken = 4.6 * double(field.samples.size()) +
                       12.0 * double(field.halves.size() + field.quarters.size());
  constexpr double kSmall = 1e8;  // what is free is not known so well
  if (taken > kSmall && taken > double(free_memory().value_or(UINT64_MAX)))
    return Failure{"there is not enough free memory to write " + file.string() +
                   ", which takes another " + std::to_string(int(1e-6 * taken)) + " MB"};
  try {
    openvdb::initialize();
    return write_aside(file, [&](const std::filesystem::path& path) {
      return write_grids(path, field, compression);
    });
  } catch (const std::exception& e) {
    return Failure{"cannot write " + file.string() + ": " + e.what()};
  }
}

Outcome write_level_set(const std::filesystem::path& file, const FieldData& field) {
  try {
    openvdb::initialize();
    return write_aside(file, [&](const std::filesystem::path& path) -> Outcome {
      const openvdb::GridPtrVec all = grids_of(field);
      std::vector<std::string> ours;
      for (auto meta = all[0]->beginMeta(); meta != all[0]->endMeta(); ++meta)
        if (meta->first.rfind("hapsix_", 0) == 0) ours.push_back(meta->first);
      for (const std::string& name : ours) all[0]->removeMeta(name);
      openvdb::io::File out(path.string());
      out.write({all[0]});
      out.close();
      return scan_vdb(path) ? Outcome(Done{})
                            : Failure{"it could not be written whole: is the disk full?"};
    });
  } catch (const std::exception& e) {
    return Failure{"cannot write " + file.string() + ": " + e.what()};
  }
}

Result<FieldData> read_field(const std::filesystem::path& file) {
  const std::string name = file.string();
  const Result<std::optional<std::int32_t>> format = scan_vdb(file);
  if (!format) return format.failure();
  // The format is checked before the seal, which another version may compute differently.
  if (*format && !reads_format(**format))
    return Failure{name + " was written by another version of hapsix: bake it again"};
  try {
    return read_sealed(file);
  } catch (const std::ios_base::failure&) {
    return ends_early(name);
  } catch (const std::bad_alloc&) {
    return Failure{name + " is damaged, or too large for this machine's memory"};
  } catch (const std::exception& e) {
    return Failure{name + " cannot be read as OpenVDB: " + e.what()};
  }
}

}  // namespace h6::io
