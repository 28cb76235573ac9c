// SPDX-License-Identifier: Apache-2.0
#include "io/deform/solid_file.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <new>
#include <stdexcept>

#include "io/deform/elements.h"
#include "io/deform/solid_formats.h"
#include "io/file/gunzip.h"

namespace h6::io {
namespace deform {

void SolidText::fail(const std::string& what) const {
  throw BadSolid{name_ + ", line " + std::to_string(scan.line()) + ": " + what + "."};
}
void SolidText::fail_whole(const std::string& what) const {
  throw BadSolid{name_ + ": " + what + "."};
}

double SolidText::number(std::string_view word) const {
  double value = 0;
  if (const char* fault = parse_number(word, value)) fail(io::quoted(word) + fault);
  if (!std::isfinite(value)) fail(io::quoted(word) + " is not a finite number");
  return value;
}

std::int64_t SolidText::whole(std::string_view word) const {
  std::int64_t value = 0;
  if (const char* fault = parse_number(word, value)) fail(io::quoted(word) + fault);
  return value;
}

std::size_t SolidText::count(std::string_view word, const char* what, std::size_t least) const {
  const std::int64_t value = whole(word);
  if (value < 0) fail("the number of " + std::string(what) + " is negative");
  if (static_cast<std::uint64_t>(value) > scan.behind().size() / least + 1)
    fail("the file claims " + std::to_string(value) + " " + what + ", more than it has room for");
  return static_cast<std::size_t>(value);
}

double SolidText::coordinate(std::string_view word) const {
  const double metres = number(word) * scale_ + 0.0;  // + 0.0 turns -0 into 0
  if (!(std::abs(metres) <= 1e6))
    fail("the coordinate " + io::quoted(word) +
         " lies beyond 1e6 m; is the unit of length the right one?");
  return metres;
}

bool VertexNumbers::add(std::int64_t number) {
  if (count_ == 0 && !apart_) first_ = number;
  if (!apart_ && behind_first(number) != static_cast<std::uint64_t>(count_)) {
    apart_ = true;
    for (std::int64_t i = 0; i < count_; ++i) table_.emplace(first_ + i, i);
  }
  if (apart_ && !table_.emplace(number, count_).second) return false;
  ++count_;
  return true;
}

std::int64_t VertexNumbers::find(std::int64_t number) const {
  if (apart_) {
    const auto found = table_.find(number);
    return found == table_.end() ? -1 : found->second;
  }
  const std::uint64_t place = behind_first(number);
  return place < static_cast<std::uint64_t>(count_) ? static_cast<std::int64_t>(place) : -1;
}

void SetNames::add(const std::string& name, std::uint32_t element) {
  const auto [place, fresh] = places_.emplace(name, sets_.size());
  if (fresh) sets_.push_back({name, {}});
  sets_[place->second].elements.push_back(element);
}

}  // namespace deform

namespace {

namespace fs = std::filesystem;
using deform::BadSolid;
using deform::SolidText;

constexpr std::uint64_t kMostBytes = std::uint64_t{2} << 30;

struct SolidFormat {
  const char* ending;
  SolidMesh (*read)(SolidText&);
};
constexpr SolidFormat kSolidFormats[] = {
    {".veg", deform::read_veg}, {".msh", deform::read_msh}, {".vtk", deform::read_vtk}};

struct NamedSolid {
  const SolidFormat* format = nullptr;
  bool gz = false;
};
NamedSolid named_solid(const std::string& name) {
  std::string lower = name;
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  fs::path path(lower);
  NamedSolid out;
  out.gz = path.extension() == ".gz";
  if (out.gz) path = path.stem();
  for (const SolidFormat& format : kSolidFormats)
    if (path.extension() == format.ending) out.format = &format;
  return out;
}

// A file whose elements are all wound the other way follows another convention; one with some such
// elements is broken, and check_solid names the first.
void turn_all(SolidMesh& mesh, std::uint32_t corners, const char* what) {
  bool some = false;
  for (const SolidElement& e : mesh.elements) {
    if (e.corners != corners) continue;
    some = true;
    const deform::Quadrature points = deform::quadrature(mesh, e);
    for (std::size_t i = 0; i < points.count; ++i)
      if (!(points.point[i].weight < 0)) return;
  }
  if (!some) return;
  for (SolidElement& e : mesh.elements) {
    if (e.corners != corners) continue;
    std::swap(e.corner[1], e.corner[corners == 4 ? 2 : 3]);
    if (corners == 8) std::swap(e.corner[5], e.corner[7]);
  }
  mesh.remarks.push_back(std::string("All ") + what +
                         " of the file are wound the other way, so they were turned.");
}

SolidMesh parse(std::string_view bytes, const std::string& name, const SolidFormat& format,
                Unit unit) {
  SolidText text(bytes, name, metres(unit));
  if (bytes.empty()) text.fail_whole("the file is empty");
  if (bytes.starts_with("version https://git-lfs"))
    text.fail_whole("this is a Git LFS pointer, not the mesh; fetch it with 'git lfs pull'");
  SolidMesh mesh = format.read(text);
  if (mesh.elements.empty())
    text.fail_whole(
        "there is no tetrahedron or hexahedron in it; mesh the volume, not the surface");
  turn_all(mesh, 4, "tetrahedra");
  turn_all(mesh, 8, "hexahedra");
  return mesh;
}

template <class Work>
Result<SolidMesh> caught(const std::string& name, const Work& work) {
  try {
    return work();
  } catch (const BadSolid& bad) {
    return Failure{bad.sentence};
  } catch (const std::bad_alloc&) {
    return Failure{name + ": there is not enough memory to read it."};
  } catch (const std::length_error&) {
    return Failure{name + ": it is too large to read."};
  }
}

}  // namespace

bool is_solid_name(const std::string& name) { return named_solid(name).format != nullptr; }

Result<SolidMesh> parse_solid(const std::string& bytes, const std::string& name, Unit unit) {
  return caught(name, [&]() -> Result<SolidMesh> {
    const NamedSolid named = named_solid(name);
    if (!named.format)
      return Failure{name + ": solid meshes end in .veg, .msh or .vtk (.gz is fine too)."};
    if (!named.gz) return parse(bytes, name, *named.format, unit);
    const Result<std::string> inflated = gunzip(bytes, name, kMostBytes);
    if (!inflated) return inflated.failure();
    return parse(*inflated, name, *named.format, unit);
  });
}

Result<SolidMesh> read_solid(const fs::path& file, Unit unit) {
  const std::string name = file.string();
  std::error_code error;
  if (!fs::exists(file, error)) return Failure{name + ": there is no such file."};
  if (!fs::is_regular_file(file, error)) return Failure{name + ": this is not a regular file."};
  const std::uint64_t size = fs::file_size(file, error);
  if (error || size > kMostBytes)
    return Failure{name + ": it has more bytes than can be read here."};
  return caught(name, [&]() -> Result<SolidMesh> {
    std::string bytes(size, '\0');
    std::ifstream in(file, std::ios::binary);
    if (!in.read(bytes.data(), static_cast<std::streamsize>(size)))
      return Failure{name + ": cannot be read."};
    return parse_solid(bytes, name, unit);
  });
}

}  // namespace h6::io
