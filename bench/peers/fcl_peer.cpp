// SPDX-License-Identifier: Apache-2.0
// fcl_peer.cpp - FCL's collider of two triangle meshes, asked for all contacts.
#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/narrowphase/collision.h>

#include "bench/peers/peer.h"

namespace h6::peers {
namespace {

using Tree = fcl::BVHModel<fcl::OBBRSSd>;  // FCL's default for meshes

std::shared_ptr<Tree> tree_of(const io::Mesh& mesh) {
  std::vector<fcl::Vector3d> corners;
  for (const h6Vec3& v : mesh.vertices) corners.emplace_back(v.x, v.y, v.z);
  std::vector<fcl::Triangle> triangles;
  for (const auto& t : mesh.triangles) triangles.emplace_back(t[0], t[1], t[2]);
  auto tree = std::make_shared<Tree>();
  tree->beginModel(static_cast<int>(triangles.size()), static_cast<int>(corners.size()));
  tree->addSubModel(corners, triangles);
  tree->endModel();
  return tree;
}

class Fcl : public Peer {
 public:
  explicit Fcl(const Task& task) : part_(tree_of(task.part)), obstacle_(tree_of(task.obstacle)) {}
  const char* name() const override { return "FCL"; }
  bool on_field() const override { return false; }
  void meet(const h6Pose& pose) override {
    fcl::Transform3d at = fcl::Transform3d::Identity();
    at.linear() = fcl::Quaterniond(pose.q.w, pose.q.x, pose.q.y, pose.q.z).toRotationMatrix();
    at.translation() = fcl::Vector3d(pose.p.x, pose.p.y, pose.p.z);
    result_.clear();
    fcl::collide(part_.get(), at, obstacle_.get(), fcl::Transform3d::Identity(), request_, result_);
  }
  void contacts(std::vector<Contact>& all) const override {
    all.clear();
    for (std::size_t i = 0; i < result_.numContacts(); ++i) {
      const fcl::Contactd& c = result_.getContact(i);
      // Its normal leads from the first model into the second.
      all.push_back({{c.pos[0], c.pos[1], c.pos[2]},
                     {-c.normal[0], -c.normal[1], -c.normal[2]},
                     c.penetration_depth});
    }
  }

 private:
  std::shared_ptr<Tree> part_, obstacle_;
  fcl::CollisionRequestd request_{1u << 20, true};
  fcl::CollisionResultd result_;
};

}  // namespace

std::unique_ptr<Peer> make_fcl(const Task& task) { return std::make_unique<Fcl>(task); }

}  // namespace h6::peers
