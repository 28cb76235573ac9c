// SPDX-License-Identifier: Apache-2.0
// Fields of real meshes: distances against a tree in double, sides against parity and winding.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "io/bake/bake_field.h"
#include "io/mesh/mesh_file.h"
#include "tests/io/bake/field_check.h"

using namespace field_check;
using namespace h6::io;

namespace {

struct Part {
  const char* file;
  Unit unit;
  int voxels;
};
const Part kParts[] = {
    {"nut-bolt/factory_bolt_m16_tight.obj", Unit::m, 192},
    {"nut-bolt/factory_nut_m16_loose_subdiv_3x.obj", Unit::m, 192},
    {"gears/factory_gear_base_loose_space_5e-4_subdiv_4x.obj", Unit::m, 192},
    {"gears/factory_gear_medium_space_5e-4.obj", Unit::m, 192},
    {"peg-hole/factory_round_peg_16mm_tight.obj", Unit::m, 128},
    {"peg-hole/factory_round_hole_16mm_subdiv_3x.obj", Unit::m, 128},
    {"screw/screw-big.obj", Unit::m, 128},
    {"screw/nut-big.obj", Unit::m, 128},
    {"screw/anchor.obj", Unit::m, 192},
    {"shells/hip_fe_module_shell_base.STL", Unit::mm, 192},
    {"shells/hip_fe_module_shell_cover.STL", Unit::mm, 192},
    {"ariac/insert_collision.stl", Unit::m, 128},
    {"ariac/pump_base.stl", Unit::m, 128},
    {"beams/0.obj", Unit::m, 128},
    {"beams/1.obj", Unit::m, 128},
    {"beams/2.obj", Unit::m, 128},
    {"beams/6.obj", Unit::m, 128},
    {"cad/counter.unitsmm.STL", Unit::mm, 192},
    {"cad/featuretype.STL", Unit::mm, 128},
    {"soups/robosim_chassis_new.stl", Unit::m, 192},
    {"soups/curiosity_chassis.obj", Unit::m, 192},
    {"soups/anymal_b_ref_pose.stl.gz", Unit::m, 256},
    {"deformable/simpleBridge.obj", Unit::m, 192},
};

// Random points on the triangles, uniform by area.
class Surface {
 public:
  explicit Surface(const Mesh& mesh) : mesh_(mesh) {
    double sum = 0;
    for (const auto& t : mesh.triangles) {
      const Vec3 a = mesh.vertices[t[0]];
      sum += norm(cross(mesh.vertices[t[1]] - a, mesh.vertices[t[2]] - a));
      area_.push_back(sum);
    }
  }
  Vec3 point(Random& random) const {
    const double at = random(0, area_.back());
    std::size_t t = std::size_t(std::upper_bound(area_.begin(), area_.end(), at) - area_.begin());
    t = std::min(t, area_.size() - 1);
    double u = random(0, 1), v = random(0, 1);
    if (u + v > 1) u = 1 - u, v = 1 - v;
    const Vec3 a = mesh_.vertices[mesh_.triangles[t][0]];
    return a + u * (mesh_.vertices[mesh_.triangles[t][1]] - a) +
           v * (mesh_.vertices[mesh_.triangles[t][2]] - a);
  }

 private:
  const Mesh& mesh_;
  std::vector<double> area_;
};

struct Table {
  double worst_node = 0;  // [voxel]
  double mean_between = 0, worst_between = 0;
  std::size_t nodes = 0, buried = 0, wrong_parity = 0, voted = 0;
  std::size_t wrong_winding = 0, wound = 0, overlaps = 0, cavities = 0;
};

// The error of a sample, as far as bake_field.h defines it: outside it is u - offset; inside a
// closed mesh it is u, or more where walls are buried; inside a soup it is at least offset - u.
void check_node(const FieldData& f, double d, double u, Table& table) {
  const double h = f.voxel_size;
  ++table.nodes;
  double error = 0;
  if (d >= 0)
    error = std::fabs(d + f.offset - u);
  else if (f.offset == 0 && -d > u + 1e-3 * h)
    ++table.buried;
  else if (f.offset == 0)
    error = std::fabs(-d - u);
  else
    error = std::max(0.0, std::min(std::fabs(f.offset - u), f.offset + u) + d);
  table.worst_node = std::max(table.worst_node, error / h);
}

// Whether all nodes around a point are inside.
bool all_inside(const FieldData& f, Vec3 p) {
  const Vec3 g = (1 / f.voxel_size) * (p - f.origin);
  for (int i = 0; i < 8; ++i) {
    const float* d =
        node_sample(f, {int(std::floor(g.x)) + (i & 1), int(std::floor(g.y)) + (i >> 1 & 1),
                        int(std::floor(g.z)) + (i >> 2)});
    if (d == nullptr || *d >= 0) return false;
  }
  return true;
}

Table examine(const Mesh& mesh, const FieldData& f, const std::function<bool(Vec3)>& finer) {
  const Judge judge(mesh);
  const Surface surface(mesh);
  Random random(11);
  Table table;
  const double h = f.voxel_size;
  const std::size_t windings = std::min<std::size_t>(500, 20'000'000 / mesh.triangles.size());
  double sum = 0;
  std::size_t between = 0;
  while (table.nodes < 10000) {
    const Vec3 p =
        surface.point(random) + h * Vec3{random(-2.5, 2.5), random(-2.5, 2.5), random(-2.5, 2.5)};
    const Vec3 g = (1 / h) * (p - f.origin);
    const std::array<int, 3> n = {int(std::lround(g.x)), int(std::lround(g.y)),
                                  int(std::lround(g.z))};
    const float* sample = node_sample(f, n);
    if (sample == nullptr) {  // only deep inside a soup: no way out is near
      REQUIRE(f.sign_mode == "flood");
      ++table.nodes;
      continue;
    }
    const Vec3 at = node_position(f, n);
    const double d = *sample, u = judge.distance(at);
    if (u < f.band)
      check_node(f, d, u, table);
    else
      ++table.nodes;
    if (f.sign_mode == "closed" && u > 1e-4 * h) {
      ++table.voted;
      const bool odd = judge.inside_by_parity(at, random);
      // Where shells overlap, parity is even inside; the winding number is right. Cavities are
      // solid by definition, so a field four times finer must not reach them either.
      if ((d < 0) != odd) {
        const bool twice = d < 0 && std::fabs(judge.winding(at)) > 1.5;
        const bool cavity = d < 0 && !twice && finer(at);
        table.overlaps += twice;
        table.cavities += cavity;
        table.wrong_parity += !twice && !cavity;
      }
    } else if (f.sign_mode == "flood" && u > 2 * f.offset && table.wound < windings) {
      const double w = std::fabs(judge.winding(at));
      if (std::fabs(w - 0.5) > 0.3) {
        ++table.wound;
        table.wrong_winding += (d < 0) != (w > 0.5);
      }
    }
    double value;
    if (between >= 2000 || !interpolate(f, p, value) || value < 0) continue;
    const double error = std::fabs(value + f.offset - judge.distance(p)) / h;
    sum += error;
    ++between;
    table.worst_between = std::max(table.worst_between, error);
  }
  table.mean_between = between ? sum / double(between) : 0;
  return table;
}

}  // namespace

TEST_CASE("bake_field: real meshes have exact distances at nodes and the right side everywhere") {
  const char* folder = std::getenv("HAPSIX_TEST_DATA");
  if (folder == nullptr || !std::filesystem::is_directory(folder)) {
    MESSAGE("skipped: no real meshes");
    return;
  }
  for (const Part& part : kParts) {
    const std::filesystem::path file = std::filesystem::path(folder) / part.file;
    if (!std::filesystem::exists(file)) continue;
    INFO(part.file);
    const auto mesh = read_mesh(file, part.unit);
    REQUIRE_MESSAGE(mesh, mesh.error());
    FieldBake options;
    options.voxels = part.voxels;
    options.grow_thin = false;
    FieldBakeReport report;
    const auto field = bake_field(*mesh, options, &report);
    REQUIRE_MESSAGE(field, field.error());
    FieldData fine;
    const Table t = examine(*mesh, *field, [&](Vec3 p) {
      if (fine.samples.empty()) {
        options.voxels *= 4;
        const auto baked = bake_field(*mesh, options, nullptr);
        REQUIRE_MESSAGE(baked, baked.error());
        fine = *baked;
      }
      return all_inside(fine, p);
    });
    MESSAGE(std::string(part.file), " ", field->sign_mode, ": worst node ", t.worst_node,
            " voxel; between nodes mean ", t.mean_between, " worst ", t.worst_between,
            "; beyond buried walls ", t.buried, "; parity wrong ", t.wrong_parity, " of ", t.voted,
            ", in overlaps ", t.overlaps, ", in cavities ", t.cavities, "; winding disagrees ",
            t.wrong_winding, " of ", t.wound);
    CHECK(t.worst_node < 1e-3);
    if (report.closed) CHECK(t.wrong_parity == 0);
  }
}
