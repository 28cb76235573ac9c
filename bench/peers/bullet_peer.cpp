// SPDX-License-Identifier: Apache-2.0
// bullet_peer.cpp - Bullet's algorithm for two GImpact meshes, called by itself: its world would
// keep four contacts of a pair, and would add its broad phase and its solver to the time.
#include <BulletCollision/Gimpact/btGImpactCollisionAlgorithm.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>
#include <btBulletCollisionCommon.h>

#include "bench/peers/peer.h"

namespace h6::peers {
namespace {

constexpr double kMm = 1e-3;  // Bullet's tolerances suit bodies larger than 1

class GImpactMesh {
 public:
  explicit GImpactMesh(const io::Mesh& mesh) {
    for (const h6Vec3& v : mesh.vertices)
      for (const double x : {v.x, v.y, v.z}) corners_.push_back(static_cast<btScalar>(x / kMm));
    for (const auto& t : mesh.triangles)
      for (const std::uint32_t v : t) indices_.push_back(static_cast<int>(v));
    arrays_ = std::make_unique<btTriangleIndexVertexArray>(
        static_cast<int>(mesh.triangles.size()), indices_.data(), 3 * int{sizeof(int)},
        static_cast<int>(mesh.vertices.size()), corners_.data(), 3 * int{sizeof(btScalar)});
    shape_ = std::make_unique<btGImpactMeshShape>(arrays_.get());
    shape_->setMargin(0);  // so that it touches where the triangles do
    shape_->updateBound();
    object_.setCollisionShape(shape_.get());
  }
  btCollisionObject& object() { return object_; }

 private:
  std::vector<btScalar> corners_;
  std::vector<int> indices_;
  std::unique_ptr<btTriangleIndexVertexArray> arrays_;
  std::unique_ptr<btGImpactMeshShape> shape_;
  btCollisionObject object_;
};

// Keeps every contact, where Bullet's own result would merge them into four.
class AllContacts : public btManifoldResult {
 public:
  AllContacts(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b)
      : btManifoldResult(a, b) {}
  void start(std::vector<Contact>& all) { all_ = &all, all_->clear(); }
  void addContactPoint(const btVector3& normal, const btVector3& place,
                       btScalar distance) override {
    all_->push_back({kMm * h6Vec3{place.x(), place.y(), place.z()},
                     {normal.x(), normal.y(), normal.z()},
                     -kMm * distance});
  }

 private:
  std::vector<Contact>* all_ = nullptr;
};

class Bullet : public Peer {
 public:
  explicit Bullet(const Task& task)
      : part_(task.part), obstacle_(task.obstacle), dispatcher_(&configuration_) {
    btGImpactCollisionAlgorithm::registerAlgorithm(&dispatcher_);
    algorithm_ = dispatcher_.findAlgorithm(&a_, &b_, nullptr, BT_CONTACT_POINT_ALGORITHMS);
  }
  ~Bullet() override {
    algorithm_->~btCollisionAlgorithm();
    dispatcher_.freeCollisionAlgorithm(algorithm_);
  }
  const char* name() const override { return "Bullet GImpact"; }
  bool on_field() const override { return false; }
  void meet(const h6Pose& pose) override {
    const auto f = [](double x) { return static_cast<btScalar>(x); };
    part_.object().setWorldTransform(
        btTransform(btQuaternion(f(pose.q.x), f(pose.q.y), f(pose.q.z), f(pose.q.w)),
                    btVector3(f(pose.p.x / kMm), f(pose.p.y / kMm), f(pose.p.z / kMm))));
    const btCollisionObjectWrapper a(nullptr, part_.object().getCollisionShape(), &part_.object(),
                                     part_.object().getWorldTransform(), -1, -1);
    AllContacts result(&a, &b_);
    result.start(found_);
    algorithm_->processCollision(&a, &b_, dispatch_, &result);
  }
  void contacts(std::vector<Contact>& all) const override { all = found_; }

 private:
  GImpactMesh part_, obstacle_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btCollisionObjectWrapper a_{nullptr,
                              part_.object().getCollisionShape(),
                              &part_.object(),
                              part_.object().getWorldTransform(),
                              -1,
                              -1},
      b_{nullptr,
         obstacle_.object().getCollisionShape(),
         &obstacle_.object(),
         obstacle_.object().getWorldTransform(),
         -1,
         -1};
  btCollisionAlgorithm* algorithm_;
  btDispatcherInfo dispatch_;
  std::vector<Contact> found_;
};

}  // namespace

std::unique_ptr<Peer> make_bullet(const Task& task) { return std::make_unique<Bullet>(task); }

}  // namespace h6::peers
