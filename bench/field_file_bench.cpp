// SPDX-License-Identifier: Apache-2.0
// field_file_bench.cpp - writes baked fields to files and reads them back:
// bake/file/MESH/voxels:N/WHAT, where WHAT is
//   write       writes a cache file to the disk (fsync) and renames it
//   load/warm   reads it from the page cache
//   model       makes the engine's model of what load/warm read
//   load/cold   reads it after posix_fadvise dropped it from the page cache
//   write/blosc, load/blosc   an exported .vdb, compressed by OpenVDB; warm
//   write/none, load/none     an exported .vdb, uncompressed; warm
// All use every thread of the machine. Each field that is read is compared, bit by bit, with the
// field that was written. Files are in $HAPSIX_BENCH_FOLDER, or else in the folder of temporary
// files, whose disk limits these times. The engine bay and the landing gear run only
// with HAPSIX_BENCH_SOUPS=1.
#include <benchmark/benchmark.h>
#include <fcntl.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "hapsix/hapsix.h"
#include "io/bake/bake_field.h"
#include "io/field/field_file.h"
#include "io/field/raw_field.h"
#include "io/scenes/industrial/industrial.h"
#include "io/scenes/scenes.h"

namespace {

using namespace h6;
namespace fs = std::filesystem;

// Bakes a field on first use.
class Baked {
 public:
  Baked(std::function<io::Mesh()> mesh, int voxels) : mesh_(std::move(mesh)), voxels_(voxels) {}
  const io::FieldData* get(benchmark::State& state) {
    if (!field_) {
      io::FieldBake options;
      options.voxels = voxels_;
      auto field = io::bake_field(mesh_(), options, nullptr);
      if (!field) return state.SkipWithError(field.error().c_str()), nullptr;
      field_ = std::make_unique<io::FieldData>(std::move(*field));
    }
    return field_.get();
  }

 private:
  std::function<io::Mesh()> mesh_;
  int voxels_;
  std::unique_ptr<io::FieldData> field_;
};
using BakedPtr = std::shared_ptr<Baked>;

struct TemporaryFile {
  fs::path path;
  TemporaryFile() {
    const char* folder = std::getenv("HAPSIX_BENCH_FOLDER");
    path = (folder && *folder ? fs::path(folder) : fs::temp_directory_path()) /
           ("hapsix-bench-" + std::to_string(getpid()) + ".vdb");
  }
  ~TemporaryFile() { remove(); }
  void remove() const {
    std::error_code ignored;
    fs::remove(path, ignored);
  }
};

template <class Array>
bool same(const Array& a, const Array& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof a[0]) == 0);
}
bool same_field(const io::FieldData& a, const io::FieldData& b) {
  return std::memcmp(&a.origin, &b.origin, sizeof a.origin) == 0 && a.voxel_size == b.voxel_size &&
         a.bricks == b.bricks && same(a.brick_index, b.brick_index) && same(a.samples, b.samples) &&
         same(a.far_grid, b.far_grid) && a.band == b.band && same(a.part, b.part) &&
         a.part_names == b.part_names && same(a.triangle, b.triangle) &&
         a.input_hash == b.input_hash && a.triangles == b.triangles;
}

// On Linux these bring a file into the page cache, or drop it from there.
void warm_up(const fs::path& file) {
  const int fd = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  std::vector<char> bytes(1 << 20);
  while (fd >= 0 && read(fd, bytes.data(), bytes.size()) > 0) continue;
  if (fd >= 0) close(fd);
}
void cool_down(const fs::path& file) {
  const int fd = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return;
  posix_fadvise(fd, 0, 0, POSIX_FADV_DONTNEED);
  close(fd);
}

template <class Body>
double seconds(const Body& body) {
  const auto start = std::chrono::steady_clock::now();
  body();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// The formats under test.
struct Format {
  std::function<Outcome(const fs::path&, const io::FieldData&)> write;
  std::function<Result<io::FieldData>(const fs::path&)> read;
};
Format exported(io::Compression compression) {
  return {[=](const fs::path& file, const io::FieldData& field) {
            return io::write_field(file, field, compression);
          },
          io::read_field};
}
const Format cached{io::write_raw_field, io::read_raw_field};

void tell(benchmark::State& state, const io::FieldData& field, const fs::path& file) {
  state.counters["bricks"] = double(field.brick_count());
  state.counters["file_MB"] = double(fs::file_size(file)) / 1e6;
}

void write_file(benchmark::State& state, const BakedPtr& baked, const Format& format) {
  const io::FieldData* field = baked->get(state);
  if (!field) return;
  const TemporaryFile file;
  for (auto _ : state) {
    file.remove();
    state.SetIterationTime(seconds([&] {
      if (const Outcome written = format.write(file.path, *field); !written)
        state.SkipWithError(written.error().c_str());
    }));
  }
  const auto back = format.read(file.path);
  if (!back) return state.SkipWithError(back.error().c_str());
  if (!same_field(*field, *back)) return state.SkipWithError("another field came back");
  tell(state, *field, file.path);
}

void load_file(benchmark::State& state, const BakedPtr& baked, const Format& format, bool warm) {
  const io::FieldData* field = baked->get(state);
  if (!field) return;
  const TemporaryFile file;
  if (const Outcome written = format.write(file.path, *field); !written)
    return state.SkipWithError(written.error().c_str());
  for (auto _ : state) {
    warm ? warm_up(file.path) : cool_down(file.path);
    Result<io::FieldData> back = Failure{"nothing was read"};
    const double time = seconds([&] { back = format.read(file.path); });
    if (!back) return state.SkipWithError(back.error().c_str());
    if (!same_field(*field, *back)) return state.SkipWithError("another field came back");
    state.SetIterationTime(time);
  }
  tell(state, *field, file.path);
}

void make_model(benchmark::State& state, const BakedPtr& baked) {
  const io::FieldData* field = baked->get(state);
  if (!field) return;
  const TemporaryFile file;
  if (const Outcome written = io::write_raw_field(file.path, *field); !written)
    return state.SkipWithError(written.error().c_str());
  for (auto _ : state) {
    const Result<io::FieldData> back = io::read_raw_field(file.path);
    if (!back) return state.SkipWithError(back.error().c_str());
    const h6FieldDef part = back->def();
    h6ModelDef def = h6DefaultModelDef();
    def.fields = &part, def.field_count = 1;
    h6Error error{};
    h6Model* model = nullptr;
    state.SetIterationTime(seconds([&] { model = h6CreateModel(&def, &error); }));
    if (!model) return state.SkipWithError(error.message);
    state.counters["model_MB"] = double(h6ModelBytes(model)) / 1e6;
    h6DestroyModel(model);
  }
  tell(state, *field, file.path);
}

void add(const std::string& name, int voxels, std::function<io::Mesh()> mesh) {
  const auto baked = std::make_shared<Baked>(std::move(mesh), voxels);
  const auto row = [&](const char* what, auto run, auto... arguments) {
    benchmark::RegisterBenchmark(
        ("bake/file/" + name + "/voxels:" + std::to_string(voxels) + "/" + what).c_str(), run,
        baked, arguments...)
        ->Unit(benchmark::kMillisecond)
        ->UseManualTime()
        ->Iterations(3);
  };
  row("write", write_file, cached);
  row("load/warm", load_file, cached, true);
  row("model", make_model);
  row("load/cold", load_file, cached, false);
  row("write/blosc", write_file, exported(io::Compression::blosc));
  row("load/blosc", load_file, exported(io::Compression::blosc), true);
  row("write/none", write_file, exported(io::Compression::none));
  row("load/none", load_file, exported(io::Compression::none), true);
}

[[maybe_unused]] const bool registered = [] {
  add("alpha", 512, [] { return io::make_alpha().mesh; });
  const char* which = std::getenv("HAPSIX_BENCH_SOUPS");
  if (which != nullptr && *which != '\0' && *which != '0') {
    add("soup500k", 1024, [] { return io::make_engine_bay().mesh; });
    add("landing_gear", 2048, [] { return io::make_landing_gear().mesh; });
  }
  return true;
}();

}  // namespace
