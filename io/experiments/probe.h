// SPDX-License-Identifier: Apache-2.0
// probe.h - contacts at given poses: a study places a free body and reads its contacts.
#pragma once
#include "io/experiments/grid.h"

namespace h6::cli {

inline constexpr double kMm = io::kMm, kProbeStiffness = 1e4, kProbeVoxel = 1e-3;
inline constexpr double kProbeDepth = 0.2 * kMm;  // penetration depth of a patch's points

// A scene with one obstacle (voxel kProbeVoxel) and a free body with these points.
io::Scene posed_scene(const std::string& name, io::Mesh obstacle, io::PointCloud points);

// The same on a lattice turned by 0.75 rad, so that the surface crosses it at all angles, as the
// surfaces of machine parts do.
io::Scene turned_scene(const std::string& name, io::Mesh obstacle, io::PointCloud points);

// A ridge along x: a cylinder of radius 4 mm with 256 sides, its top at z = 0.
io::Mesh ridge();
// A plate 12 mm thick below z = 0, and the bottom of a box of 20 x 20 x 10 mm in the frame of the
// box's centre.
io::Mesh plate(double from_x, double to_x);
io::PointCloud bottom(int nu, int nv);

class Probe {
 public:
  Probe(const io::LoadedScene& loaded, const MethodColumn& method);
  explicit operator bool() const { return session_ != nullptr; }
  h6Contacts at(const h6Pose& pose);
  h6FrameReport report() const { return h6GetFrame(session_.get()); }

 private:
  SessionPtr session_;
};

}  // namespace h6::cli
