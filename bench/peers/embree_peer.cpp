// SPDX-License-Identifier: Apache-2.0
// embree_peer.cpp - Embree's query for the nearest triangle, for every point of the shell.
#include "bench/peers/peer.h"
#include "hapsix/vector.h"

namespace h6::peers {
namespace {

constexpr double kWithin = 2;  // [voxel] it looks no farther, so deeper points are not found

class Embree : public Peer {
 public:
  explicit Embree(const Task& task)
      : mesh_(task.obstacle),
        points_(task.points),
        within_(kWithin * task.field.voxel_size),
        rays_(std::move(*io::RayScene::make(mesh_))) {}
  const char* name() const override { return "Embree, every point"; }
  bool on_field() const override { return false; }
  void meet(const h6Pose& pose) override {
    found_.clear();
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const h6Vec3 p = place(pose, points_[i]);
      const io::RayScene::Near near = rays_->nearest(p, within_);
      if (near.triangle == io::RayScene::kNoTriangle) continue;
      const auto& t = mesh_.triangles[near.triangle];
      const h6Vec3 a = mesh_.vertices[t[0]], out = near.point - p;
      const h6Vec3 normal = cross(mesh_.vertices[t[1]] - a, mesh_.vertices[t[2]] - a);
      if (!(dot(out, normal) > 0)) continue;  // the side is that of the triangle's winding
      found_.push_back({p, (1 / near.distance) * out, near.distance});
    }
  }
  void contacts(std::vector<Contact>& all) const override { all = found_; }

 private:
  const io::Mesh& mesh_;
  const std::vector<h6Vec3>& points_;
  double within_;
  std::unique_ptr<io::RayScene> rays_;
  std::vector<Contact> found_;
};

}  // namespace

std::unique_ptr<Peer> make_embree(const Task& task) { return std::make_unique<Embree>(task); }

}  // namespace h6::peers
