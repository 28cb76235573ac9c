// SPDX-License-Identifier: Apache-2.0
// mesh_file.cpp - reads a mesh from a file or from bytes, and writes a binary STL. The readers of
// the formats are in stl.cpp, obj.cpp, ply.cpp, gltf.cpp and collada.cpp.
#include "io/mesh/mesh_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <memory>
#include <new>
#include <stdexcept>

#include "io/file/free_memory.h"
#include "io/file/gunzip.h"
#include "io/file/text_scan.h"
#include "io/file/write_aside.h"
#include "io/mesh/formats.h"

namespace h6::io {

void MeshSource::fail(const std::string& place, const std::string& what) const {
  throw BadMesh{name + ", " + place + ": " + what + "."};
}
void MeshSource::fail(const std::string& what) const { throw BadMesh{name + ": " + what + "."}; }

void fail_coordinate(const MeshSource& source, const std::string& place, double value) {
  if (!std::isfinite(value)) source.fail(place, "a coordinate is not finite");
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  source.fail(place, std::string("the coordinate ") + text +
                         " lies beyond 1e6 m; is the unit of length the right one?");
}

namespace {

namespace fs = std::filesystem;

// ---- which format -------------------------------------------------------------------------------

using Reader = Mesh (*)(const MeshSource&);

struct Format {
  const char* ending;
  Reader read;
  bool has_unit = false;
};
// A new format is one more line here and one more reader.
constexpr Format kFormats[] = {{".stl", read_stl},        {".obj", read_obj},
                               {".ply", read_ply},        {".gltf", read_gltf, true},
                               {".glb", read_gltf, true}, {".dae", read_collada, true}};

std::string lower_case(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

struct Named {
  const Format* format;
  bool gz;
};

// Decides by the ending alone; `format` is null when that is unknown.
Named named(const std::string& name, std::string& ending) {
  fs::path path(lower_case(name));
  const bool gz = path.extension() == ".gz";
  if (gz) path = path.stem();
  ending = path.extension().string();
  for (const Format& format : kFormats)
    if (ending == format.ending) return {&format, gz};
  return {nullptr, gz};
}

// The same, but throws.
Named format_of(const std::string& name) {
  std::string ending;
  if (const Named found = named(name, ending); found.format) return found;
  const std::string what = ending.empty() ? "the name has no ending that says what it is"
                                          : "'" + ending + "' files are not read";
  throw BadMesh{name + ": " + what +
                "; export the mesh as .stl, .obj, .ply, .glb or .dae (.gz is fine too)."};
}

// Checks for mistakes that any format may have.
void check_start(std::string_view bytes, const MeshSource& source) {
  if (bytes.empty()) source.fail("the file is empty");
  if (bytes.starts_with("\x1f\x8b"))
    source.fail("the content is gzip; give the file the ending .gz too");
  if (bytes.starts_with("version https://git-lfs"))
    source.fail("this is a Git LFS pointer, not the mesh; fetch it with 'git lfs pull'");
}

// A larger mesh is more likely in millimetres than a part for a hand.
constexpr double kLargest = 20;  // [m]
void remark_size(const MeshSource& source, Mesh& mesh) {
  const double across = bounds_of(mesh).longest();
  if (across <= kLargest) return;
  char text[128];
  std::snprintf(text, sizeof text,
                ": it is %.4g m across. If its numbers are millimetres, say so: --units mm, or "
                "\"units\": \"mm\" in a scene.",
                across);
  mesh.remarks.push_back(source.name + text);
  mesh.unit_is_doubtful = true;
}

Mesh parse(std::string_view bytes, const std::string& name, const Format& format, Unit unit,
           const fs::path* folder) {
  const MeshSource source{bytes, name, metres(unit), folder};
  check_start(bytes, source);
  Mesh mesh = format.read(source);
  if (mesh.triangles.empty()) source.fail("there is no triangle in it");
  if (!format.has_unit && unit == Unit::m) remark_size(source, mesh);
  return mesh;
}

template <class Work>
Result<Mesh> caught(const std::string& name, const Work& work) {
  try {
    return work();
  } catch (const BadMesh& bad) {
    return Failure{bad.sentence};
  } catch (const std::bad_alloc&) {
    return Failure{name + ": there is not enough memory to read it."};
  } catch (const std::length_error&) {
    return Failure{name + ": it is too large to read."};
  }
}

// ---- the file -----------------------------------------------------------------------------------

// The most bytes of a file, inflated: half of the free memory, since a reader needs as much again.
std::size_t most_bytes() {
  constexpr std::uint64_t kMost = std::uint64_t{8} << 30;
  return std::min(kMost, free_memory().value_or(kMost) / 2);
}

class OpenFile {
 public:
  OpenFile(const fs::path& path, const MeshSource& source) : source_(source) {
    // Without O_NONBLOCK, opening a named pipe would wait for its writer.
    fd_ = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (fd_ < 0 && errno == ENOENT) source.fail("there is no such file");
    if (fd_ < 0) source.fail(std::string("cannot be opened: ") + std::strerror(errno));
    struct stat status {};
    const bool known = fstat(fd_, &status) == 0;
    regular_ = known && S_ISREG(status.st_mode);
    folder_ = known && S_ISDIR(status.st_mode);
    size_ = regular_ ? static_cast<std::uint64_t>(status.st_size) : 0;
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  ~OpenFile() {
    if (fd_ >= 0) close(fd_);
  }

  std::uint64_t size() const {
    if (folder_) source_.fail("this is a folder, not a mesh file");
    if (!regular_) source_.fail("this is not a regular file");
    return size_;
  }

  // Appends `count` bytes, fewer at the end of the file.
  void read_more(std::string& bytes, std::size_t count) {
    const std::size_t begin = bytes.size();
    bytes.resize(begin + count);
    std::size_t have = 0;
    while (have < count) {
      const ssize_t got = read(fd_, bytes.data() + begin + have, count - have);
      if (got < 0 && errno == EINTR) continue;
      if (got < 0)
        source_.fail("byte " + std::to_string(begin + have),
                     std::string("cannot be read: ") + std::strerror(errno));
      if (got == 0) break;
      have += static_cast<std::size_t>(got);
    }
    bytes.resize(begin + have);
  }

 private:
  const MeshSource& source_;
  int fd_ = -1;
  bool regular_ = false, folder_ = false;
  std::uint64_t size_ = 0;
};

std::string read_bytes(const fs::path& path, const MeshSource& source, const Named& named) {
  OpenFile file(path, source);
  const std::uint64_t size = file.size();
  std::string bytes;
  constexpr std::size_t kStart = 4096;
  file.read_more(bytes, static_cast<std::size_t>(std::min<std::uint64_t>(size, kStart)));
  // A file of the wrong kind is refused before all of it is in memory.
  if (!named.gz) check_start(bytes, source);
  if (!named.gz && named.format->read == read_stl) check_stl_size(bytes, size, source);
  if (size > most_bytes())
    source.fail("it has " + std::to_string(size) + " bytes, more than can be read here; split it");
  if (size > kStart) {
    bytes.reserve(static_cast<std::size_t>(size));
    file.read_more(bytes, static_cast<std::size_t>(size) - bytes.size());
  }
  return bytes;
}

Result<Mesh> parse_named(const std::string& bytes, const std::string& name, const Named& named,
                         Unit unit, const fs::path* folder = nullptr) {
  if (!named.gz) return parse(bytes, name, *named.format, unit, folder);
  const Result<std::string> inflated = gunzip(bytes, name, most_bytes());
  if (!inflated) return inflated.failure();
  return parse(*inflated, name, *named.format, unit, folder);
}

// ---- binary STL out -----------------------------------------------------------------------------

using StlTriangle = std::array<char, 50>;

struct Point3f {
  float x, y, z;
};

// A unit vector, or zero for a triangle without area, as readers expect.
Point3f normal_of(const Point3f& a, const Point3f& b, const Point3f& c) {
  const double ux = double{b.x} - a.x, uy = double{b.y} - a.y, uz = double{b.z} - a.z;
  const double vx = double{c.x} - a.x, vy = double{c.y} - a.y, vz = double{c.z} - a.z;
  const double nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
  const double length = std::sqrt(nx * nx + ny * ny + nz * nz);
  if (!(length > 0) || !std::isfinite(length)) return {0, 0, 0};
  return {static_cast<float>(nx / length), static_cast<float>(ny / length),
          static_cast<float>(nz / length)};
}

StlTriangle stl_triangle(const std::array<Point3f, 3>& corners) {
  const Point3f normal = normal_of(corners[0], corners[1], corners[2]);
  StlTriangle bytes{};
  std::memcpy(bytes.data(), &normal, 12);
  std::memcpy(bytes.data() + 12, corners.data(), 36);
  return bytes;
}

// Why the mesh cannot be written; empty when it can.
std::string unwritable(const Mesh& mesh, double scale) {
  if (mesh.triangles.empty()) return "the mesh has no triangle";
  if (mesh.triangles.size() > std::numeric_limits<std::uint32_t>::max())
    return "the mesh has more triangles than an STL can hold";
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t vertex : triangle)
      if (vertex >= mesh.vertices.size()) return "a triangle names a vertex that is not there";
  const double most = std::numeric_limits<float>::max() * scale;
  for (const Vec3& p : mesh.vertices)
    for (const double value : {p.x, p.y, p.z})
      if (!(std::abs(value) <= most)) return "a coordinate is not finite";
  return {};
}

Outcome write_triangles(const fs::path& file, const Mesh& mesh, Unit unit) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> out(std::fopen(file.c_str(), "wbe"),
                                                            std::fclose);
  const auto fault = [&] {
    return Failure{"Cannot write " + file.string() + ": " + std::strerror(errno) + "."};
  };
  if (!out) return fault();
  // It must not start with "solid": some readers would take the file for text.
  static constexpr const char* kUnits[] = {"m", "mm", "cm", "in"};
  char head[84] = {};
  std::snprintf(head, 80, "binary STL by hapsix, unit of length: %s",
                kUnits[static_cast<int>(unit)]);
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  std::memcpy(head + 80, &count, 4);
  if (std::fwrite(head, sizeof head, 1, out.get()) != 1) return fault();

  const double scale = metres(unit);
  const auto in_unit = [&](std::uint32_t vertex) {
    const Vec3& p = mesh.vertices[vertex];
    return Point3f{static_cast<float>(p.x / scale), static_cast<float>(p.y / scale),
                   static_cast<float>(p.z / scale)};
  };
  std::vector<StlTriangle> block;
  constexpr std::size_t kBlock = 4096;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& triangle = mesh.triangles[t];
    block.push_back(
        stl_triangle({in_unit(triangle[0]), in_unit(triangle[1]), in_unit(triangle[2])}));
    if (block.size() < kBlock && t + 1 < mesh.triangles.size()) continue;
    if (std::fwrite(block.data(), sizeof(StlTriangle), block.size(), out.get()) != block.size())
      return fault();
    block.clear();
  }
  if (std::fflush(out.get()) != 0) return fault();
  return Done{};
}

}  // namespace

std::string read_beside(const MeshSource& source, const std::string& name, std::uint64_t count) {
  const std::string shown = io::quoted(name);
  if (!source.folder)
    source.fail("it names the file " + shown + " beside it, which is out of reach here");
  const fs::path path(name);
  bool inside = !name.empty() && !path.has_root_path() && name.find('\0') == std::string::npos &&
                name.find('\\') == std::string::npos && name.find(':') == std::string::npos;
  for (const fs::path& step : path) inside = inside && step != "..";
  if (!inside)
    source.fail("it names the file " + shown + "; only files in its own folder are read");
  const MeshSource other{{}, (*source.folder / path).string(), 1};
  OpenFile file(other.name, other);
  const std::uint64_t size = std::min(file.size(), count);
  if (size > most_bytes()) other.fail("it has more bytes than can be read here");
  std::string bytes;
  file.read_more(bytes, static_cast<std::size_t>(size));
  return bytes;
}

const char* unit_name(Unit unit) {
  static constexpr const char* kNames[] = {"m", "mm", "cm", "in"};
  return kNames[static_cast<int>(unit)];
}

double metres(Unit unit) {
  switch (unit) {
    case Unit::m:
      return 1;
    case Unit::mm:
      return 1e-3;
    case Unit::cm:
      return 1e-2;
    case Unit::in:
      return 0.0254;
  }
  return 1;
}

Result<Unit> unit_from_name(const std::string& name) {
  if (name == "m") return Unit::m;
  if (name == "mm") return Unit::mm;
  if (name == "cm") return Unit::cm;
  if (name == "in") return Unit::in;
  return Failure{"'" + name + "' is not a unit of length; use m, mm, cm or in."};
}

bool is_mesh_name(const std::string& name) {
  std::string ending;
  return named(name, ending).format != nullptr;
}

bool states_unit(const std::string& name) {
  std::string ending;
  const Format* format = named(name, ending).format;
  return format && format->has_unit;
}

Result<Mesh> read_mesh(const fs::path& file, Unit unit) {
  const std::string name = file.string();
  return caught(name, [&]() -> Result<Mesh> {
    const MeshSource source{{}, name, metres(unit)};
    // A missing file is reported before an unknown ending.
    OpenFile(file, source).size();
    const Named named = format_of(name);
    const fs::path folder = file.parent_path();
    return parse_named(read_bytes(file, source, named), name, named, unit, &folder);
  });
}

Result<Mesh> parse_mesh(const std::string& bytes, const std::string& name, Unit unit) {
  return caught(name,
                [&]() -> Result<Mesh> { return parse_named(bytes, name, format_of(name), unit); });
}

Outcome write_stl(const fs::path& file, const Mesh& mesh, Unit unit) {
  const std::string why = unwritable(mesh, metres(unit));
  if (!why.empty()) return Failure{"Cannot write " + file.string() + ": " + why + "."};
  return write_aside(file,
                     [&](const fs::path& aside) { return write_triangles(aside, mesh, unit); });
}

}  // namespace h6::io
