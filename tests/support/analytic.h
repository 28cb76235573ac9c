// SPDX-License-Identifier: Apache-2.0
// analytic.h - fields and shells with known answers, for tests and benchmarks.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include "hapsix/hapsix.h"

namespace h6::test {

// Storage behind an h6FieldDef, sampled from a signed distance function (mesh frame, metres).
struct FieldArrays {
  std::vector<std::int32_t> index;
  std::vector<float> samples, far;
  h6FieldDef def{};
};

using Distance = std::function<double(double, double, double)>;

// A grid of bx x by x bz bricks from `origin`; a brick is stored when any of its 9^3 nodes is
// nearer than `band` plus a cell's diagonal.
inline FieldArrays sample_analytic(const Distance& f, h6Vec3 origin, double voxel, int bx, int by,
                                   int bz, double band_voxels = 3) {
  FieldArrays out;
  const double band = band_voxels * voxel;
  const auto at = [&](int i, int j, int k) {
    return f(origin.x + voxel * i, origin.y + voxel * j, origin.z + voxel * k);
  };
  for (int c = 0; c < bz; ++c)
    for (int b = 0; b < by; ++b)
      for (int a = 0; a < bx; ++a) {
        bool near = false;
        for (int k = 0; k <= 8 && !near; ++k)
          for (int j = 0; j <= 8 && !near; ++j)
            for (int i = 0; i <= 8 && !near; ++i)
              near = std::fabs(at(8 * a + i, 8 * b + j, 8 * c + k)) < band + 1.74 * voxel;
        out.index.push_back(near ? static_cast<std::int32_t>(out.samples.size() / 512) : -1);
        if (!near) continue;
        for (int k = 0; k < 8; ++k)
          for (int j = 0; j < 8; ++j)
            for (int i = 0; i < 8; ++i)
              out.samples.push_back(static_cast<float>(at(8 * a + i, 8 * b + j, 8 * c + k)));
      }
  for (int c = 0; c <= bz; ++c)
    for (int b = 0; b <= by; ++b)
      for (int a = 0; a <= bx; ++a) {
        // Round towards zero, so that the bound cannot become too large.
        const double d = at(8 * a, 8 * b, 8 * c);
        out.far.push_back(std::nextafter(static_cast<float>(d), 0.0f));
      }
  out.def.origin = origin;
  out.def.voxel_size = voxel;
  out.def.bricks[0] = bx, out.def.bricks[1] = by, out.def.bricks[2] = bz;
  out.def.band = band;
  return out;
}

inline h6FieldDef def_of(FieldArrays& a) {
  a.def.brick_index = a.index.data();
  a.def.samples = a.samples.data();
  a.def.brick_count = a.samples.size() / 512;
  a.def.far_grid = a.far.data();
  return a.def;
}

// Storage behind an h6ShellDef: two levels, the first a single sphere around everything.
struct ShellArrays {
  std::vector<float> x, y, z, nx, ny, nz;
  std::vector<std::uint32_t> level_first, point, first_child, child_count;
  std::vector<float> radius;

  void add(double px, double py, double pz, double ax, double ay, double az) {
    x.push_back(static_cast<float>(px)), y.push_back(static_cast<float>(py)),
        z.push_back(static_cast<float>(pz));
    nx.push_back(static_cast<float>(ax)), ny.push_back(static_cast<float>(ay)),
        nz.push_back(static_cast<float>(az));
  }
  h6ShellDef def() {
    const auto n = static_cast<std::uint32_t>(x.size());
    level_first = {0, 1, 1 + n};
    point.assign(1, 0), first_child.assign(1, 1), child_count.assign(1, n), radius.assign(1, 0);
    for (std::uint32_t i = 0; i < n; ++i) {
      point.push_back(i), first_child.push_back(0), child_count.push_back(0), radius.push_back(0);
      radius[0] = std::max(radius[0], 1.0001f * std::hypot(x[i] - x[0], y[i] - y[0], z[i] - z[0]));
    }
    h6ShellDef d{};
    d.point_count = n;
    d.x = x.data(), d.y = y.data(), d.z = z.data();
    d.nx = nx.data(), d.ny = ny.data(), d.nz = nz.data();
    d.level_count = 2;
    d.level_first = level_first.data();
    d.node_point = point.data(), d.node_radius = radius.data();
    d.node_first_child = first_child.data(), d.node_child_count = child_count.data();
    return d;
  }
};

// The bottom face (z = -half_z) of a box: nu x nv points, inward normal +z.
inline ShellArrays bottom_face(double half_x, double half_y, double half_z, int nu, int nv) {
  ShellArrays s;
  for (int i = 0; i < nu; ++i)
    for (int j = 0; j < nv; ++j)
      s.add(half_x * ((i + 0.5) / nu * 2 - 1), half_y * ((j + 0.5) / nv * 2 - 1), -half_z, 0, 0, 1);
  return s;
}

inline ShellArrays sphere_points(double radius, int n) {
  ShellArrays s;
  const double golden = M_PI * (3 - std::sqrt(5.0));
  for (int i = 0; i < n; ++i) {
    const double z = 1 - 2 * (i + 0.5) / n, r = std::sqrt(1 - z * z);
    const double ex = r * std::cos(golden * i), ey = r * std::sin(golden * i);
    s.add(radius * ex, radius * ey, radius * z, -ex, -ey, -z);
  }
  return s;
}

struct Model {
  h6Model* handle = nullptr;
  Model(std::vector<h6FieldDef> fields, std::vector<h6ShellDef> shells, h6Error* error = nullptr) {
    h6ModelDef def = h6DefaultModelDef();
    def.fields = fields.data(), def.field_count = fields.size();
    def.shells = shells.data(), def.shell_count = shells.size();
    handle = h6CreateModel(&def, error);
  }
  ~Model() { h6DestroyModel(handle); }
  Model(const Model&) = delete;
  Model& operator=(const Model&) = delete;
};

inline h6Pose pose(double x, double y, double z) { return {{x, y, z}, {1, 0, 0, 0}}; }
inline h6DeviceSample hand_at(const h6Pose& p) {
  h6DeviceSample s{};
  s.pose = p;
  return s;
}

}  // namespace h6::test
