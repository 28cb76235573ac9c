// SPDX-License-Identifier: Apache-2.0
// grid_peers.cpp - OpenVDB and NanoVDB: every point of the shell is sampled in a grid with the
// field's own nodes, trilinearly through an accessor. The points come in Morton order, which serves
// the accessors' caches.
#include <nanovdb/util/GridHandle.h>
#include <nanovdb/util/OpenToNanoVDB.h>
#include <nanovdb/util/SampleFromVoxels.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>

#include "bench/peers/peer.h"
#include "hapsix/vector.h"

namespace h6::peers {
namespace {

// Distances in metres at the field's nodes. Cells without a brick are tiles: positive outside,
// negative inside.
openvdb::FloatGrid::Ptr grid_of(const io::FieldData& field) {
  openvdb::initialize();
  const float band = static_cast<float>(field.band);
  auto grid = openvdb::FloatGrid::create(band);
  const int nx = field.bricks[0], ny = field.bricks[1], nz = field.bricks[2];
  const auto node = [&](int a, int b, int c) {
    return (std::size_t(c) * std::size_t(ny + 1) + std::size_t(b)) * std::size_t(nx + 1) +
           std::size_t(a);
  };
  for (int c = 0; c < nz; ++c)
    for (int b = 0; b < ny; ++b)
      for (int a = 0; a < nx; ++a) {
        const std::size_t cell =
            (std::size_t(c) * std::size_t(ny) + std::size_t(b)) * std::size_t(nx) + std::size_t(a);
        const openvdb::Coord low(8 * a, 8 * b, 8 * c);
        const std::int32_t row = field.brick_index[cell];
        if (row < 0) {
          if (field.far_grid[node(a, b, c)] < 0) grid->tree().addTile(1, low, -band, false);
          continue;
        }
        auto* leaf = grid->tree().touchLeaf(low);
        for (openvdb::Index i = 0; i < 512; ++i) {
          // A leaf counts along z first.
          const openvdb::Coord at = openvdb::FloatTree::LeafNodeType::offsetToLocalCoord(i);
          leaf->setValueOn(i, field.samples[std::size_t(row) * 512 +
                                            std::size_t(at.z() * 64 + at.y() * 8 + at.x())]);
        }
      }
  return grid;
}

// What both peers share: the points, the way to grid coordinates, and what was found.
class GridPeer : public Peer {
 public:
  explicit GridPeer(const Task& task)
      : points_(task.points), origin_(task.field.origin), voxel_(task.field.voxel_size) {}
  bool on_field() const override { return true; }
  void contacts(std::vector<Contact>& all) const override {
    all.clear();
    for (std::size_t i = 0; i < inside_.size(); ++i)
      all.push_back({place(pose_, points_[inside_[i]]), unit(out_[i]), depth_[i]});
  }
  const std::vector<std::uint32_t>* inside() const override { return &inside_; }

 protected:
  // The place in the grid is turned_[k] * p + moved_.
  void start(const h6Pose& pose) {
    pose_ = pose;
    inside_.clear(), depth_.clear(), out_.clear();
    const h6Vec3 x = rotate(pose.q, {1, 0, 0}), y = rotate(pose.q, {0, 1, 0}),
                 z = rotate(pose.q, {0, 0, 1});
    x_ = (1 / voxel_) * x, y_ = (1 / voxel_) * y, z_ = (1 / voxel_) * z;
    moved_ = (1 / voxel_) * (pose.p - origin_);
  }
  h6Vec3 in_grid(const h6Vec3& p) const { return moved_ + p.x * x_ + p.y * y_ + p.z * z_; }
  void keep(std::size_t point, double distance, const h6Vec3& gradient) {
    inside_.push_back(static_cast<std::uint32_t>(point));
    depth_.push_back(-distance);
    out_.push_back(gradient);
  }

  const std::vector<h6Vec3>& points_;
  h6Vec3 origin_;
  double voxel_;

 private:
  h6Pose pose_{};
  h6Vec3 x_{}, y_{}, z_{}, moved_{};
  std::vector<std::uint32_t> inside_;
  std::vector<double> depth_;
  std::vector<h6Vec3> out_;
};

class OpenVdb : public GridPeer {
 public:
  explicit OpenVdb(const Task& task)
      : GridPeer(task), grid_(grid_of(task.field)), values_(grid_->getConstAccessor()) {}
  const char* name() const override { return "OpenVDB, every point"; }
  void meet(const h6Pose& pose) override {
    start(pose);
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const h6Vec3 g = in_grid(points_[i]);
      const openvdb::Vec3d at(g.x, g.y, g.z);
      const float d = openvdb::tools::BoxSampler::sample(values_, at);
      if (d < 0) keep(i, static_cast<double>(d), gradient(at));
    }
  }

 private:
  // Of the trilinear cell, as our own.
  h6Vec3 gradient(const openvdb::Vec3d& at) const {
    const openvdb::Coord low = openvdb::Coord::floor(at);
    float v[2][2][2];
    openvdb::tools::BoxSampler::getValues(v, values_, low);
    const double x = at.x() - low.x(), y = at.y() - low.y(), z = at.z() - low.z();
    h6Vec3 g{};
    for (int a = 0; a < 2; ++a)
      for (int b = 0; b < 2; ++b)
        for (int c = 0; c < 2; ++c) {
          const double value = static_cast<double>(v[a][b][c]);
          const double wx = a ? x : 1 - x, wy = b ? y : 1 - y, wz = c ? z : 1 - z;
          g = g + value * h6Vec3{(a ? 1 : -1) * wy * wz, (b ? 1 : -1) * wx * wz,
                                 (c ? 1 : -1) * wx * wy};
        }
    return g;
  }

  openvdb::FloatGrid::Ptr grid_;
  openvdb::FloatGrid::ConstAccessor values_;
};

class NanoVdb : public GridPeer {
 public:
  explicit NanoVdb(const Task& task)
      : GridPeer(task),
        handle_(nanovdb::openToNanoVDB(*grid_of(task.field))),
        values_(handle_.grid<float>()->getAccessor()) {}
  const char* name() const override { return "NanoVDB, every point"; }
  void meet(const h6Pose& pose) override {
    start(pose);
    // Without its cache of the last cell: points of a shell stand about two voxels apart. In single
    // precision, which NanoVDB is made for.
    const auto sampler = nanovdb::createSampler<1, Accessor, false>(values_);
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const h6Vec3 g = in_grid(points_[i]);
      const nanovdb::Vec3f at(float(g.x), float(g.y), float(g.z));
      const float d = sampler(at);
      if (!(d < 0)) continue;
      const auto slope = sampler.gradient(at);
      keep(i, static_cast<double>(d), {double(slope[0]), double(slope[1]), double(slope[2])});
    }
  }

 private:
  using Accessor = nanovdb::NanoGrid<float>::AccessorType;
  nanovdb::GridHandle<> handle_;
  Accessor values_;
};

}  // namespace

std::unique_ptr<Peer> make_openvdb(const Task& task) { return std::make_unique<OpenVdb>(task); }
std::unique_ptr<Peer> make_nanovdb(const Task& task) { return std::make_unique<NanoVdb>(task); }

}  // namespace h6::peers
