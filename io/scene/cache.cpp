// SPDX-License-Identifier: Apache-2.0
// cache.cpp - keeps baked assets on disk.
//
// A file has its key in its name and again inside; it is used only if both agree. Files are written
// under another name and then renamed. So two programs may bake the same asset at the same time:
// both succeed, and the second file replaces an equal one.
#include "io/scene/cache.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <system_error>

#include "io/bake/plan.h"
#include "io/deform/deformable_file.h"
#include "io/field/raw_field.h"
#include "io/file/free_memory.h"
#include "io/shell/shell_file.h"

namespace h6::io {
namespace {

namespace fs = std::filesystem;

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

// Another user could put wrong assets into a file or folder of theirs.
bool is_own(const fs::path& place) {
  struct stat found {};
  return stat(place.c_str(), &found) == 0 && found.st_uid == geteuid() &&
         (found.st_mode & S_IWOTH) == 0;
}

// The cache file of a key. Empty if there is no cache folder.
fs::path cached_file(const std::string& key, const char* ending, Cached& cached) {
  const fs::path folder = cache_folder();
  if (folder.empty()) {
    cached.warnings.push_back(
        "There is no folder for baked assets, so this one is not kept: set "
        "HAPSIX_CACHE to a folder.");
    return {};
  }
  std::error_code error;
  if (fs::exists(folder, error) && !is_own(folder)) {
    cached.warnings.push_back("The cache " + folder.string() +
                              " is another user's, or open to all, so it is not used: set "
                              "HAPSIX_CACHE to a folder of your own.");
    return {};
  }
  return folder / (key + ending);
}

template <class Data>
bool is_it(const Result<Data>& read, const std::string& key, const fs::path& file, Cached& cached) {
  if (read && read->input_hash == key) return true;
  const std::string why =
      read ? file.string() + ": it was baked from something else." : read.error();
  cached.warnings.push_back("A file of the cache is of no use and is baked again. " + why);
  return false;
}

template <class Write>
void store(const fs::path& file, Cached& cached, const Write& write) {
  std::error_code error;
  // If this fails, `write` reports it.
  if (fs::create_directories(file.parent_path(), error))
    fs::permissions(file.parent_path(), fs::perms::owner_all, error);
  if (const Outcome kept = write(file); !kept) {
    cached.warnings.push_back("The baked asset is not kept in the cache. " + kept.error());
  }
}

template <class Data, class Read, class Bake, class Write>
Result<Data> through_cache(const std::string& key, const char* ending, bool keep, Cached* report,
                           const Read& read, const Bake& bake, const Write& write) {
  Cached unheard;
  Cached& cached = report ? *report : unheard;
  cached.hit = cached.rebuilt = false;
  cached.file = cached_file(key, ending, cached);
  std::error_code error;
  if (!cached.file.empty() && fs::exists(cached.file, error) && !is_own(cached.file)) {
    cached.warnings.push_back("A file of the cache is another user's, so it is baked again: " +
                              cached.file.string());
    cached.rebuilt = true;
    fs::remove(cached.file, error);  // what replaced it would keep its permissions
  } else if (!cached.file.empty() && fs::exists(cached.file, error)) {
    Result<Data> found = read(cached.file);
    if (is_it(found, key, cached.file, cached)) {
      cached.hit = true;
      return found;
    }
    cached.rebuilt = true;
  }
  Result<Data> baked = bake(cached);
  if (!baked) return baked;
  baked->input_hash = key;
  if (keep && !cached.file.empty()) {
    store(cached.file, cached, [&](const fs::path& file) { return write(file, *baked); });
  }
  return baked;
}

// Better a sentence now than a machine that stands still, or a killed program, minutes later.
Outcome check_memory(const Mesh& mesh, const FieldBake& options) {
  const std::optional<std::uint64_t> free = free_memory();
  if (!free) return Done{};
  const Result<FieldPlan> plan = plan_field(mesh, audit(mesh), options);
  if (!plan) return plan.failure();
  const Result<std::string> needs = needs_of(*plan, *free);
  return needs ? Outcome(Done{}) : Outcome(needs.failure());
}

}  // namespace

std::filesystem::path cache_folder() {
  if (const std::string own = environment("HAPSIX_CACHE"); !own.empty()) return own;
  const fs::path xdg = environment("XDG_CACHE_HOME");
  if (xdg.is_absolute()) return xdg / "hapsix";  // the XDG standard ignores relative paths
  const std::string home = environment("HOME");
  return home.empty() ? fs::path{} : fs::path(home) / ".cache" / "hapsix";
}

Result<FieldData> cached_field(const HashedMesh& mesh, const FieldBake& options, Cached* cached,
                               const Progress& progress, bool keep) {
  return through_cache<FieldData>(
      asset_key(mesh, options), ".field", keep, cached,
      [](const fs::path& file) { return read_raw_field(file); },
      [&](Cached& told) {
        if (Outcome fits = check_memory(mesh.mesh, options); !fits)
          return Result<FieldData>(fits.failure());
        FieldBakeReport report;
        Result<FieldData> field = bake_field(mesh.mesh, options, &report, progress);
        told.warnings.insert(told.warnings.end(), report.warnings.begin(), report.warnings.end());
        return field;
      },
      [](const fs::path& file, const FieldData& field) { return write_raw_field(file, field); });
}

Result<ShellData> cached_shell(const HashedMesh& mesh, const ShellBake& options, Cached* cached,
                               const Progress& progress, bool keep) {
  return through_cache<ShellData>(
      asset_key(mesh, options), ".ply", keep, cached,
      [](const fs::path& file) { return read_shell(file); },
      [&](Cached& told) {
        if (std::string far = too_far_for_floats(mesh.mesh); !far.empty())
          told.warnings.push_back(far);
        return bake_shell(mesh.mesh, options, &told.warnings, progress);
      },
      [](const fs::path& file, const ShellData& shell) { return write_shell(file, shell); });
}

Result<ReducedModel> cached_bend(const SolidMesh& solid, const ReduceOptions& options,
                                 Cached* cached, const Progress& progress) {
  return through_cache<ReducedModel>(
      reduction_key(solid, options), ".h5", true, cached,
      [](const fs::path& file) { return read_deformable(file); },
      [&](Cached&) { return reduce(solid, options, nullptr, progress); },
      [](const fs::path& file, const ReducedModel& model) {
        return write_deformable(file, model);
      });
}

}  // namespace h6::io
