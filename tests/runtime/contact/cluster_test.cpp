// SPDX-License-Identifier: Apache-2.0
// Clusters of contacts, and the options of the Gauss methods.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include "hapsix/hapsix.h"
#include "runtime/contact/weighing.h"
#include "tests/support/near.h"

using namespace h6;

namespace {

constexpr double mm = 1e-3;

struct Table {
  std::vector<char> memory;
  Contacts c{};
  std::vector<std::uint32_t> order, root;
  std::vector<std::uint64_t> cell;

  explicit Table(std::size_t capacity) : order(capacity), root(capacity), cell(capacity) {
    Arena count;
    take_columns(c, count, capacity);
    memory.resize(count.used() + 64);
    const auto at = reinterpret_cast<std::uintptr_t>(memory.data());
    Arena arena(memory.data() + (64 - at % 64) % 64, count.used());
    take_columns(c, arena, capacity);
  }
  void add(const Vec3& r, const Vec3& n, double depth) {
    const std::size_t i = c.count++;
    c.rx[i] = float(r.x()), c.ry[i] = float(r.y()), c.rz[i] = float(r.z());
    c.nx[i] = c.gx[i] = float(n.x()), c.ny[i] = c.gy[i] = float(n.y()),
    c.nz[i] = c.gz[i] = float(n.z());
    c.depth[i] = float(depth);
    c.point[i] = std::uint32_t(i);
  }
  std::size_t merge(double distance) {
    return c.count = cluster_contacts(c, 0, c.count, 0, distance,
                                      {order.data(), root.data(), cell.data()});
  }
  double net() const {
    double sum = 0;
    for (std::size_t i = 0; i < c.count; ++i) sum += c.weight[i];
    return sum;
  }
};

double unit(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }

h6ContactDef method(h6Method m, std::uint32_t pieces = 0) {
  h6ContactDef def = h6DefaultContactDef();
  def.method = m;
  def.pieces = pieces;
  return def;
}

}  // namespace

TEST_CASE("clusters are connected by links shorter than the threshold") {
  std::mt19937_64 random(5);
  for (const double spread : {1.0, 5.0, 20.0, 1000.0})
    for (const std::size_t n : {1u, 2u, 50u, 400u}) {
      std::vector<Vec3> r;
      for (std::size_t i = 0; i < n; ++i)
        r.push_back(spread * mm * Vec3(unit(random), unit(random), unit(random) * 0.1));
      Table t(n);
      for (const Vec3& p : r) t.add(p, {0, 0, 1}, mm);
      // In float, as the columns hold them.
      for (std::size_t i = 0; i < n; ++i) r[i] = Vec3(t.c.rx[i], t.c.ry[i], t.c.rz[i]);
      t.merge(0.5 * mm);
      std::vector<std::size_t> label(n);
      for (std::size_t i = 0; i < n; ++i) label[i] = i;
      for (bool changed = true; changed;) {  // by brute force
        changed = false;
        for (std::size_t i = 0; i < n; ++i)
          for (std::size_t j = 0; j < i; ++j)
            if (label[i] != label[j] && (r[i] - r[j]).norm() < 0.5 * mm) {
              label[i] = label[j] = std::min(label[i], label[j]);
              changed = true;
            }
      }
      std::map<std::size_t, std::uint32_t> row;
      for (std::size_t i = 0; i < n; ++i) {
        const auto [at, fresh] = row.emplace(label[i], t.root[i]);
        REQUIRE(at->second == t.root[i]);
      }
      CHECK(row.size() == t.c.count);
    }
}

TEST_CASE("a cluster is one contact: means weighted by depth, the deepest point") {
  Table t(4);
  t.add({0, 0, 0}, {0, 0, 1}, 1 * mm);
  t.add({9 * mm, 0, 0}, {0, 1, 0}, 0.5 * mm);
  t.add({0.4 * mm, 0, 0}, {0, 0.6, 0.8}, 3 * mm);
  t.add({0.8 * mm, 0, 0}, {0, 0, 1}, 1 * mm);  // linked by the one between
  REQUIRE(t.merge(0.5 * mm) == 2);
  CHECK(t.c.depth[0] == h6::test::near((1 + 9 + 1) / 5.0 * mm).epsilon(1e-5));
  CHECK(t.c.rx[0] == h6::test::near((1.2 + 0.8) / 5 * mm).epsilon(1e-5));
  const Vec3 n = (2 * Vec3(0, 0, 1) + 3 * Vec3(0, 0.6, 0.8)).normalized();
  CHECK(t.c.ny[0] == h6::test::near(n.y()).epsilon(1e-5));
  CHECK(t.c.nz[0] == h6::test::near(n.z()).epsilon(1e-5));
  CHECK(t.c.point[0] == 2);
  CHECK(t.c.point[1] == 1);
  CHECK(t.root[0] == t.root[3]);
}

TEST_CASE("a cluster whose normals cancel has no direction and is left out") {
  Table t(3);
  t.add({0, 0, 0}, {0, 0, 1}, mm);
  t.add({0, 0, 0.1 * mm}, {0, 0, -1}, mm);
  t.add({9 * mm, 0, 0}, {0, 0, 1}, mm);
  REQUIRE(t.merge(0.5 * mm) == 1);
  CHECK(t.root[0] == kNoCluster);
  CHECK(t.root[1] == kNoCluster);
  CHECK(t.root[2] == 0);
  CHECK(t.c.point[0] == 2);
}

TEST_CASE("coincident contacts by the thousand are one cluster, quickly") {
  Table t(16384);
  for (int i = 0; i < 16384; ++i) t.add({mm, 2 * mm, 3 * mm}, {0, 0, 1}, mm);
  CHECK(t.merge(0.5 * mm) == 1);
  CHECK(t.c.nz[0] == h6::test::near(1));
}

TEST_CASE("each cluster keeps k; with Gauss weights on top, all of one direction keep k together") {
  const auto heaps = [] {
    Table t(100);
    for (int i = 0; i < 90; ++i) t.add({0.001 * mm * i, 0, 0}, {0, 0, 1}, mm);
    for (int i = 0; i < 10; ++i) t.add({9 * mm, 0.01 * mm * i, 0}, {0, 0, 1}, mm);
    t.merge(0.5 * mm);
    return t;
  };
  Table alone = heaps();
  weigh_columns(alone.c, method(H6_METHOD_CLUSTER), mm, 0.01, nullptr, nullptr);
  CHECK(alone.net() == h6::test::near(2));
  Table gauss = heaps();
  weigh_columns(gauss.c, method(H6_METHOD_GAUSS3, H6_PIECE_CLUSTER), mm, 0.01, nullptr, nullptr);
  CHECK(gauss.net() == h6::test::near(1).epsilon(1e-5));
  CHECK(gauss.c.weight[0] ==
        h6::test::near(0.5).epsilon(1e-5));  // clusters count, not their points
  CHECK(uses_clusters(method(H6_METHOD_ROBUST, H6_PIECE_CLUSTER)));
  CHECK_FALSE(uses_clusters(method(H6_METHOD_SERIES, H6_PIECE_CLUSTER)));
}

TEST_CASE("Eq. 8 as printed inverts the weights: the denser, the stiffer") {
  const auto weights = [](std::uint32_t pieces) {
    Table t(11);
    for (int i = 0; i < 10; ++i) t.add({0, 0, 0}, {0, 0, 1}, mm);
    t.add({mm, 0, 0}, {0, 1, 0}, mm);
    weigh_columns(t.c, method(H6_METHOD_GAUSS3, pieces), mm, 0.01, nullptr, nullptr);
    return std::pair{t.c.weight[0], t.c.weight[10]};
  };
  const auto settled = weights(0), printed = weights(H6_PIECE_PRINTED);
  CHECK(settled.first == h6::test::near(0.1).epsilon(1e-5));
  CHECK(settled.second == h6::test::near(1).epsilon(1e-5));
  CHECK(printed.first == h6::test::near(1).epsilon(1e-5));
  CHECK(printed.second == h6::test::near(0.1).epsilon(1e-5));
}

TEST_CASE("geodesic distance is the angle: a hat of 1 rad ends at 1 rad, one over chords beyond") {
  const auto weight = [](double angle, std::uint32_t pieces, h6Method m) {
    Table t(2);
    t.add({0, 0, 0}, {0, 0, 1}, mm);
    t.add({0, 0, 0}, {0, std::sin(angle), std::cos(angle)}, mm);
    h6ContactDef def = method(m, pieces);
    def.epsilon = def.epsilon_normal = 1;
    weigh_columns(t.c, def, mm, 0.01, nullptr, nullptr);
    return double{t.c.weight[0]};
  };
  for (const h6Method m : {H6_METHOD_GAUSS3, H6_METHOD_ROBUST}) {
    CHECK(weight(1.01, H6_PIECE_GEODESIC, m) == h6::test::near(1).epsilon(1e-6));
    CHECK(weight(1.01, 0, m) < 0.99);  // a chord of 0.97
    CHECK(weight(0.5, H6_PIECE_GEODESIC, m) == h6::test::near(1 / 1.75).epsilon(1e-5));
    const double chord = 2 * std::sin(0.25);
    CHECK(weight(0.5, 0, m) == h6::test::near(1 / (2 - chord * chord)).epsilon(1e-5));
  }
}

TEST_CASE("torque handles keep the length of the arm, which directions lose") {
  // Equal normals, torques of one direction, arms of 1 and 9 mm on a body of 10 mm radius.
  const auto columns = [](std::uint32_t pieces) {
    Table t(2);
    t.add({1 * mm, 0, 0}, {0, 0, 1}, mm);
    t.add({9 * mm, 0, 0}, {0, 0, 1}, mm);
    h6ContactDef def = method(H6_METHOD_GAUSS6, pieces);
    def.epsilon = 0.5;
    weigh_columns(t.c, def, mm, 10 * mm, nullptr, nullptr);
    return t;
  };
  const Table directions = columns(0), handles = columns(H6_PIECE_HANDLES);
  CHECK(directions.c.ty[0] == h6::test::near(-1).epsilon(1e-6));
  CHECK(handles.c.ty[0] == h6::test::near(-0.1).epsilon(1e-6));
  CHECK(handles.c.ty[1] == h6::test::near(-0.9).epsilon(1e-6));
  CHECK(directions.c.weight[0] == h6::test::near(0.5).epsilon(1e-6));   // 2/(2 + 2)
  CHECK(handles.c.weight[0] == h6::test::near(2.0 / 3).epsilon(1e-6));  // 2/(2 + 1)
}
