// SPDX-License-Identifier: Apache-2.0
// attributes.cpp - compares the attributes of a recording with an empty one in memory, which the
// functions write that write recordings.
#include <cstdio>
#include <optional>

#include "io/record/first_in_child.h"
#include "io/record/log.h"
#include "io/record/stored.h"
#include "io/record/to_hdf5.h"

namespace h6::io {
namespace fs = std::filesystem;
using namespace recording;

namespace {

using Cells = std::vector<std::string>;
constexpr hssize_t kMostCells = 1 << 17;  // of an attribute

Cells texts_of(hid_t attribute, hid_t space, std::size_t count) {
  const Handle type = text_type();
  std::vector<char*> chars(count, nullptr);
  Cells cells;
  if (count == 0 || H5Aread(attribute, type, chars.data()) < 0) return cells;
  for (const char* text : chars) cells.emplace_back(text ? text : "");
  H5Dvlen_reclaim(type, space, H5P_DEFAULT, chars.data());
  return cells;
}

// The cells of an attribute of texts or numbers. Nothing: it cannot be read as a recording's.
std::optional<Cells> cells_of(hid_t object, const char* name) {
  const Handle attribute = H5Aopen(object, name, H5P_DEFAULT);
  const Handle space = H5Aget_space(attribute), type = H5Aget_type(attribute);
  const hssize_t count = H5Sget_simple_extent_npoints(space);
  if (count < 0 || count > kMostCells) return std::nullopt;
  const auto cells = static_cast<std::size_t>(count);
  if (H5Tis_variable_str(type) > 0) return texts_of(attribute, space, cells);
  const H5T_class_t kind = H5Tget_class(type);
  if (kind != H5T_INTEGER && kind != H5T_FLOAT) return std::nullopt;
  std::vector<double> numbers(cells);
  if (H5Aread(attribute, H5T_NATIVE_DOUBLE, numbers.data()) < 0) return std::nullopt;
  Cells out;
  for (const double number : numbers) {
    char text[32];
    std::snprintf(text, sizeof text, "%.17g", number);
    out.emplace_back(text);
  }
  return out;
}

bool is_label(const std::string& attribute) {
  return attribute == "units" || attribute == "columns" || attribute.ends_with("_names");
}

// The first attribute of `expected`, an object of this name, that has other cells in `file`.
// With `labels`, names and units count, too.
std::string changed_in(hid_t expected, hid_t file, const std::string& name, H5I_type_t kind,
                       bool labels) {
  if (!has(file, name.c_str(), kind)) return "";
  const Handle a = H5Oopen(expected, name.c_str(), H5P_DEFAULT),
               b = H5Oopen(file, name.c_str(), H5P_DEFAULT);
  char attribute[64] = "";
  for (hsize_t i = 0; H5Aget_name_by_idx(a, ".", H5_INDEX_NAME, H5_ITER_INC, i, attribute,
                                         sizeof attribute, H5P_DEFAULT) >= 0;
       ++i)
    if (H5Aexists(b, attribute) > 0 && (labels || !is_label(attribute)) &&
        cells_of(a, attribute) != cells_of(b, attribute))
      return "the attribute " + std::string(attribute) + " of /" + name;
  return "";
}

Result<std::string> compare(const fs::path& file, const Recording& recording) {
  constexpr std::size_t kStep = 1 << 16;
  const Handle access = H5Pcreate(H5P_FILE_ACCESS);
  if (H5Pset_fapl_core(access, kStep, false) < 0) return Failure{library_reason()};
  const Handle expected = H5Fcreate("hapsix-attributes", H5F_ACC_TRUNC, H5P_DEFAULT, access);
  if (!put_empty(expected, recording.head, recording.summary_json))
    return Failure{library_reason()};
  const Handle h5 = H5Fopen(file.c_str(), H5F_ACC_RDONLY, file_access());
  if (!h5.ok()) return Failure{"cannot read " + file.string() + ": " + library_reason()};
  std::string changed;
  // An older program, whose recordings lack a column, may have had other names and units.
  const bool of_today = recording.columns.size() == columns(recording.head.bends).size();
  for (const char* group : {"config", "summary"})
    if (changed.empty()) changed = changed_in(expected, h5, group, H5I_GROUP, of_today);
  const auto datasets = [&](const char* folder, const std::vector<std::string>& names) {
    if (!changed.empty() || !has(h5, folder, H5I_GROUP)) return;
    for (const std::string& name : names)
      if (changed.empty())
        changed = changed_in(expected, h5, std::string(folder) + "/" + name, H5I_DATASET, of_today);
  };
  datasets("frames", recording.columns);
  datasets("events", {"t"});
  return changed;
}

}  // namespace

Result<std::string> first_changed_attribute(const fs::path& name, const Recording& recording) {
  const fs::path file = followed(name);
  // Attributes are written with the file, which has a log beside it while there is none or an older
  // one.
  if (open_log(part_of(file)).ok()) return std::string();
  const LibraryLock lock;
  const Outcome survives = first_in_child(file, "a recording whose attributes were read",
                                          [&] { (void)compare(file, recording); });
  return survives ? compare(file, recording) : survives.failure();
}

}  // namespace h6::io
