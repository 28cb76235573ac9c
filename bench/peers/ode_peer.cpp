// SPDX-License-Identifier: Apache-2.0
// ode_peer.cpp - ODE's collider of two triangle meshes.
#include <ode/ode.h>

#include "bench/peers/peer.h"

namespace h6::peers {
namespace {

constexpr int kMostContacts = 32768;  // dCollide counts in 16 bits
constexpr double kMm = 1e-3;          // ODE's tolerances suit bodies larger than 1

class Mesh {
 public:
  explicit Mesh(const io::Mesh& mesh) : data_(dGeomTriMeshDataCreate()) {
    for (const h6Vec3& v : mesh.vertices)
      corners_.insert(corners_.end(), {v.x / kMm, v.y / kMm, v.z / kMm});
    for (const auto& t : mesh.triangles) indices_.insert(indices_.end(), t.begin(), t.end());
    dGeomTriMeshDataBuildDouble(data_, corners_.data(), 3 * sizeof(double),
                                static_cast<int>(mesh.vertices.size()), indices_.data(),
                                static_cast<int>(indices_.size()), 3 * sizeof(std::uint32_t));
    geom_ = dCreateTriMesh(nullptr, data_, nullptr, nullptr, nullptr);
  }
  ~Mesh() { dGeomDestroy(geom_), dGeomTriMeshDataDestroy(data_); }
  Mesh(const Mesh&) = delete;
  Mesh& operator=(const Mesh&) = delete;
  dGeomID geom() const { return geom_; }

 private:
  dTriMeshDataID data_;
  dGeomID geom_;
  std::vector<double> corners_;
  std::vector<std::uint32_t> indices_;
};

// Without a handler ODE prints a message for each pair of triangles that it gives up on, and the
// time would be that of the terminal.
void ignore(int, const char*, va_list) {}

class Ode : public Peer {
 public:
  explicit Ode(const Task& task)
      : part_((dInitODE(), task.part)), obstacle_(task.obstacle), found_(kMostContacts) {
    dSetMessageHandler(ignore);
  }
  const char* name() const override { return "ODE trimesh"; }
  bool on_field() const override { return false; }
  void meet(const h6Pose& pose) override {
    const dQuaternion q = {pose.q.w, pose.q.x, pose.q.y, pose.q.z};
    dGeomSetPosition(part_.geom(), pose.p.x / kMm, pose.p.y / kMm, pose.p.z / kMm);
    dGeomSetQuaternion(part_.geom(), q);
    count_ = dCollide(part_.geom(), obstacle_.geom(), kMostContacts, found_.data(),
                      sizeof(dContactGeom));
  }
  void contacts(std::vector<Contact>& all) const override {
    all.clear();
    for (int i = 0; i < count_; ++i) {
      const dContactGeom& c = found_[static_cast<std::size_t>(i)];
      all.push_back({kMm * h6Vec3{c.pos[0], c.pos[1], c.pos[2]},
                     {c.normal[0], c.normal[1], c.normal[2]},
                     kMm * c.depth});
    }
  }

 private:
  Mesh part_, obstacle_;
  std::vector<dContactGeom> found_;
  int count_ = 0;
};

}  // namespace

std::unique_ptr<Peer> make_ode(const Task& task) { return std::make_unique<Ode>(task); }

}  // namespace h6::peers
