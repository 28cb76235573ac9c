// SPDX-License-Identifier: Apache-2.0
// winding_numbers_bench.cpp - winding numbers of 4 x 2 x 2 nodes, from n far clusters and n / 8
// leaves of eight triangles near by: about their shares in bakes of open meshes.
#include "kernels/bake/winding_numbers.h"

#include <algorithm>
#include <memory>
#include <vector>

#include "bench/kernels/kernel_bench.h"

namespace {

using namespace h6::kernels;
using namespace h6::kernels::bench;

struct Mesh {
  std::vector<WindingCluster> clusters;
  std::vector<WindingLeaf> leaves;
  std::vector<std::uint32_t> far, near;
  WindingPlaces places;
  float number[kWindingPlaces], want[kWindingPlaces];
};

// A strip of eight triangles has ten vertices.
WindingLeaf strip(Random& random) {
  WindingLeaf leaf{};
  leaf.vertices = 10, leaf.triangles = 8;
  for (double& o : leaf.origin) o = std::floor(random.uniform(0, 16));
  for (std::uint32_t v = 0; v < 10; ++v) {
    leaf.x[v] = float(v / 2) + float(random.uniform(0, 0.5));
    leaf.y[v] = float(v % 2) + float(random.uniform(0, 0.5));
    leaf.z[v] = float(random.uniform(0, 0.5));
  }
  for (std::uint32_t t = 0; t < 8; ++t)
    for (std::uint32_t c = 0; c < 3; ++c) leaf.corner[3 * t + c] = std::uint8_t(t + c);
  return leaf;
}

Case make(std::size_t n) {
  auto m = std::make_shared<Mesh>();
  Random random(3);
  for (std::uint32_t i = 0; i < n; ++i) {
    WindingCluster cluster{};
    for (float& v : cluster.middle) v = float(random.uniform(40, 200));
    for (float& v : cluster.dipole) v = float(random.uniform(-1, 1));
    m->clusters.push_back(cluster);
    m->far.push_back(i);
  }
  for (std::uint32_t i = 0; i < n / 8; ++i) {
    m->leaves.push_back(strip(random));
    m->near.push_back(i);
  }
  for (std::size_t i = 0; i < kWindingPlaces; ++i) {
    m->places.x[i] = float(i % 4), m->places.y[i] = float(i / 4 % 2);
    m->places.z[i] = float(i / 8);
  }
  const auto call = [](auto& function, Mesh& mesh, float(&out)[kWindingPlaces]) {
    const double base[3] = {6, 7, 8};
    function(mesh.clusters.data(), mesh.far.data(), mesh.far.size(), mesh.leaves.data(),
             mesh.near.data(), mesh.near.size(), base, mesh.places, out);
  };
  call(winding_numbers_ref, *m, m->want);
  return {[=] { call(winding_numbers, *m, m->number); },
          [=] { call(winding_numbers_ref, *m, m->number); },
          [=] { return std::equal(m->number, m->number + kWindingPlaces, m->want); }};
}

const bool registered = [] {
  for (std::size_t n : {256, 1024})
    add("kernels/winding_numbers/n:" + std::to_string(n), kWindingPlaces, [=] { return make(n); });
  return true;
}();

}  // namespace
