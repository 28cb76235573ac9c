// SPDX-License-Identifier: Apache-2.0
// smoothness.cpp - how smooth the force is on given paths.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "io/experiments/probe.h"

namespace h6::cli {

Study study_smoothness(const std::vector<MethodColumn>& columns, const Console& console) {
  Study out;
  out.title = "Force smoothness";
  out.about =
      "Largest change of the contact force between two frames, in k·voxel, at h = 1 ms and 0.1 "
      "ms, on paths given in time: a box (400 points) that tilts from 0.05 rad to flat in 1 s, "
      "and one that slides off a plate's edge at 50 mm/s, 0.4 voxel deep. A continuous force "
      "changes a tenth as much in a tenth of the time; a jump stays as large. Prototype, "
      "slide-off: gauss3 .129 → .031, with depth weighting .021 → .0003.";
  auto flat = io::load_scene(posed_scene("flat", plate(-40 * kMm, 40 * kMm), bottom(20, 20)));
  auto edge = io::load_scene(posed_scene("edge", plate(-40 * kMm, 0), bottom(20, 20)));
  out.table = head("path", columns);
  if (!flat || !edge) return out;
  struct Way {
    const char* name;
    const io::LoadedScene* scene;
    double seconds;
    h6Pose (*at)(double t);
  };
  const Way ways[] = {{"tilt to flat", flat->get(), 1,
                       [](double t) {
                         const double a = 0.05 * (1 - t);
                         return h6Pose{{0, 0, 4.6 * kMm}, turn_by({0.5 * a, a, 0})};
                       }},
                      {"slide off an edge", edge->get(), 0.5, [](double t) {
                         return h6Pose{{-12.5 * kMm + 50 * kMm * t, 0, 4.6 * kMm}, {1, 0, 0, 0}};
                       }}};
  double found[2][2][64] = {};
  std::vector<std::function<void()>> jobs;
  for (int w = 0; w < 2; ++w)
    for (int fine = 0; fine < 2; ++fine)
      for (std::size_t m = 0; m < columns.size() && m < 64; ++m)
        jobs.push_back([&, w, fine, m] {
          Probe probe(*ways[w].scene, columns[m]);
          if (!probe) return;
          const int steps = static_cast<int>(ways[w].seconds * (fine ? 10000 : 1000));
          h6Vec3 last{};
          for (int i = 0; i <= steps; ++i) {
            const h6Pose pose = ways[w].at(ways[w].seconds * i / steps);
            const h6Vec3 f = elastic_wrench(probe.at(pose), 1 / kProbeVoxel).force;
            if (i > 0) found[w][fine][m] = std::max(found[w][fine][m], norm(f - last));
            last = f;
          }
        });
  run_jobs(jobs, console, "smoothness");
  for (int w = 0; w < 2; ++w) {
    out.table.push_back({ways[w].name});
    for (std::size_t m = 0; m < columns.size() && m < 64; ++m) {
      const double coarse = found[w][0][m], fine = found[w][1][m];
      out.table.back().push_back(number(coarse, 4) + " → " + number(fine, 4));
      out.json[ways[w].name][columns[m].name] = {{"1ms", coarse}, {"0.1ms", fine}};
    }
  }
  return out;
}

// ---- torque ripple on baked fields -------------------------------------------------------------

namespace {

io::Mesh fine_bowl() {
  constexpr int kRings = 48;
  std::vector<io::Ring> rings;
  for (int i = 0; i < kRings; ++i) {
    const double angle = std::numbers::pi / 2 * i / kRings;
    rings.push_back({10 * kMm * std::cos(angle), -10 * kMm * std::sin(angle)});
  }
  return io::block_with_cavity(20 * kMm, 20 * kMm, rings, -10 * kMm, 192);
}

io::PointCloud peg() {
  io::PointCloud cloud;
  io::add_cylinder_side(cloud, 6 * kMm, 10 * kMm, 38, 20);
  return cloud;
}

// The lower half of a ball, without the part near the bowl's rim.
io::PointCloud ball(int count) {
  io::PointCloud cloud;
  const double turn = std::numbers::pi * (3 - std::sqrt(5.0)), radius = 10 * kMm;
  for (int i = 0; i < count; ++i) {
    const double z = -1 + 0.8 * (i + 0.5) / count, r = std::sqrt(1 - z * z);
    const h6Vec3 out = {r * std::cos(turn * i), r * std::sin(turn * i), z};
    io::add_shell_point(cloud, radius * out, -1.0 * out);
  }
  return cloud;
}

constexpr int kFrames = 400;

struct Ripple {
  // Root mean square deviation from the mean, in k voxel and in k voxel L, where L is the greatest
  // distance of a point from the body's origin.
  double force = 0, torque = 0;
  double mean = 0;  // length of the mean force, in k voxel
};

// How much the interpolated depths vary along the path [voxel]: the root mean square deviation of
// each point's depth from its own mean, over the points that touch in every frame.
double field_noise(const io::LoadedScene& loaded, h6Pose (*at)(double t)) {
  Probe probe(loaded, {"none", "none", 0});
  if (!probe) return 0;
  const std::size_t points = loaded.scene.bodies[1].shell->points->x.size();
  std::vector<double> sum(points, 0), squares(points, 0);
  std::vector<int> times(points, 0);
  for (int i = 0; i < kFrames; ++i) {
    const h6Contacts c = probe.at(at((i + 0.5) / kFrames));
    for (std::size_t j = 0; j < c.count; ++j) {
      const double depth = c.depth[j] / kProbeVoxel;
      sum[c.point[j]] += depth, squares[c.point[j]] += depth * depth, ++times[c.point[j]];
    }
  }
  double variance = 0;
  std::size_t count = 0;
  for (std::size_t p = 0; p < points; ++p)
    if (times[p] == kFrames) {
      const double mean = sum[p] / kFrames;
      variance += std::max(0.0, squares[p] / kFrames - mean * mean);
      ++count;
    }
  return count ? std::sqrt(variance / static_cast<double>(count)) : 0;
}

Ripple ripple_of(const io::LoadedScene& loaded, const MethodColumn& method,
                 h6Pose (*at)(double t)) {
  Ripple out;
  Probe probe(loaded, method);
  if (!probe) return out;
  double lever = 0;
  const io::PointCloud& points = *loaded.scene.bodies[1].shell->points;
  for (std::size_t i = 0; i < points.x.size(); ++i)
    lever = std::max(lever, norm({points.x[i], points.y[i], points.z[i]}));
  std::vector<h6Wrench> all;
  h6Vec3 force{}, torque{};
  for (int i = 0; i < kFrames; ++i) {
    all.push_back(elastic_wrench(probe.at(at((i + 0.5) / kFrames)), 1 / kProbeVoxel));
    force = force + (1.0 / kFrames) * all.back().force;
    torque = torque + (1.0 / kFrames) * all.back().torque;
  }
  for (const h6Wrench& w : all) {
    const h6Vec3 df = w.force - force, dt = w.torque - torque;
    out.force += dot(df, df) / kFrames, out.torque += dot(dt, dt) / kFrames;
  }
  out.force = std::sqrt(out.force), out.torque = std::sqrt(out.torque) / lever;
  out.mean = norm(force);
  return out;
}

}  // namespace

Study study_ripple(const std::vector<MethodColumn>& columns, const Console& console) {
  Study out;
  out.title = "Ripple on baked fields";
  out.about =
      "A body moves at constant depth over surfaces that do not change along its way; only the "
      "field's samples do, because they are turned by 0.75 rad against the surface. A box of 20 "
      "mm (400 points) moves 0.4 voxel deep over a plane and along a ridge of 4 mm radius. A "
      "peg of 6 mm (760 points) is pressed 0.4 voxel sideways in a hole of its size and slides "
      "along it. A ball of 10 mm (500 points) spins 0.2 voxel deep in a bowl of its size. The "
      "table gives the root mean square of force and torque around their means, in k·voxel and "
      "k·voxel·L (L is the body's radius), then that of the torque in thousandths of the mean "
      "force times L. The last column is the noise of the field: the RMS, in voxels, of the "
      "interpolated distance of each touching point around its mean. Trilinear interpolation is "
      "exact on a plane at any angle, so only rounding remains there; contacts of a ball have "
      "no lever arm.";
  struct Way {
    const char* name;
    io::Scene scene;
    h6Pose (*at)(double t);
  };
  const io::Mesh hole = io::block_with_hole(15 * kMm, 50 * kMm, 6 * kMm, 48 * kMm, 256);
  std::vector<Way> ways;
  ways.push_back({"box on a plane",
                  turned_scene("ripple", plate(-40 * kMm, 40 * kMm), bottom(20, 20)), [](double t) {
                    return h6Pose{{(20 * t - 10) * kMm, 0, 4.6 * kMm}, {1, 0, 0, 0}};
                  }});
  ways.push_back({"box on a ridge", turned_scene("ripple", ridge(), bottom(20, 20)), [](double t) {
                    return h6Pose{{(20 * t - 10) * kMm, 0, 4.6 * kMm}, {1, 0, 0, 0}};
                  }});
  ways.push_back({"peg in a hole", turned_scene("ripple", hole, peg()), [](double t) {
                    return h6Pose{{0.4 * kMm, 0, (-35 + 20 * t) * kMm}, {1, 0, 0, 0}};
                  }});
  ways.push_back({"ball in a bowl", turned_scene("ripple", fine_bowl(), ball(500)), [](double t) {
                    return h6Pose{{0, 0, -0.2 * kMm}, turn_by({0, 0, 2 * t})};
                  }});
  out.table = head("surface", columns);
  out.table[0].push_back("field");
  std::vector<std::vector<Ripple>> found(ways.size(), std::vector<Ripple>(columns.size()));
  std::vector<double> noise(ways.size(), 0);
  std::vector<std::function<void()>> jobs;
  for (std::size_t w = 0; w < ways.size(); ++w)
    jobs.push_back([&, w] {
      auto loaded = io::load_scene(ways[w].scene);
      if (!loaded) return;
      noise[w] = field_noise(**loaded, ways[w].at);
      for (std::size_t m = 0; m < columns.size(); ++m)
        found[w][m] = ripple_of(**loaded, columns[m], ways[w].at);
    });
  run_jobs(jobs, console, "ripple");
  for (std::size_t w = 0; w < ways.size(); ++w) {
    out.table.push_back({ways[w].name});
    for (std::size_t m = 0; m < columns.size(); ++m) {
      const Ripple& r = found[w][m];
      const double share = r.mean > 0 ? 1e3 * r.torque / r.mean : 0;
      out.table.back().push_back(number(r.force, 4) + ", " + number(r.torque, 4) + " (" +
                                 number(share, 2) + " ‰)");
      out.json[ways[w].name][columns[m].name] = {
          {"force", r.force}, {"torque", r.torque}, {"mean_force", r.mean}};
    }
    out.table.back().push_back(number(noise[w], 4));
    out.json[ways[w].name]["field_noise_voxels"] = noise[w];
  }
  return out;
}

}  // namespace h6::cli
