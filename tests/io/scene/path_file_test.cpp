// SPDX-License-Identifier: Apache-2.0
// path_file_test.cpp - hand paths: writing and reading CSV, refused files, and interpolation.
#include <doctest/doctest.h>
#include "tests/support/near.h"

#include <cmath>
#include <random>
#include <string>

#include "tests/io/scene/scene_samples.h"

using namespace h6;
using namespace h6::io;

TEST_CASE("a path comes back to the bit in metres, to 1e-12 in other units") {
  const Folder folder;
  Path path;
  std::mt19937_64 random(3);
  const auto real = [&] { return static_cast<double>(random() >> 11) * 0x1p-53 * 2 - 1; };
  for (int i = 0; i < 200; ++i) {
    double q[4] = {real(), real(), real(), real() + 0.01};
    const double n = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    path.push_back(
        {i * 0.001 + 1e-4 * (real() + 1) / 2,
         {{real(), real() * 1e-7, real() * 1e3}, {q[0] / n, q[1] / n, q[2] / n, q[3] / n}}});
  }
  for (const Unit unit : {Unit::m, Unit::mm, Unit::in}) {
    REQUIRE(write_path(folder.path / "p.csv", path, unit));
    const Result<Path> back = read_path(folder.path / "p.csv", unit);
    REQUIRE_MESSAGE(back, back.error());
    REQUIRE(back->size() == path.size());
    for (std::size_t i = 0; i < path.size(); ++i) {
      CHECK((*back)[i].t == path[i].t);
      check_same((*back)[i].pose, path[i].pose);
      if (unit == Unit::m) CHECK((*back)[i].pose.p.x == path[i].pose.p.x);
    }
  }
}

TEST_CASE("header, comments, blank lines, spaces and carriage returns are skipped in a path") {
  const Folder folder;
  const Result<Path> path = read_path(
      folder.write("p.csv",
                   "# made by hand\r\n\r\nt,x,y,z,qw,qx,qy,qz\r\n 0 , 1,2,+3, 1,0,0,0 \r\n"
                   "# pause\n0.5,1,2,3,1,0,0,0"),
      Unit::mm);
  REQUIRE_MESSAGE(path, path.error());
  REQUIRE(path->size() == 2);
  check_same((*path)[0].pose.p, h6Vec3{1e-3, 2e-3, 3e-3});
}

TEST_CASE("a bad path row is refused with file and line") {
  const Folder folder;
  const std::string head = "t,x,y,z,qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n";
  const auto error = [&](const std::string& text) {
    const Result<Path> path = read_path(folder.write("p.csv", text), Unit::m);
    REQUIRE(!path);
    return path.error();
  };
  CHECK(says(error(head + "1,0,0,0,1,0,0\n"), "p.csv:3: 7 columns"));
  CHECK(says(error(head + "1,0,0,0,1,0,0,0,9\n"), "p.csv:3: 9 columns"));
  CHECK(says(error(head + "1,0,x,0,1,0,0,0\n"), "p.csv:3: column 3 is not a number"));
  CHECK(says(error(head + "1,0,nan,0,1,0,0,0\n"), "column 3"));
  CHECK(says(error(head + "1,0,inf,0,1,0,0,0\n"), "column 3"));
  CHECK(says(error(head + "1,0,1e999,0,1,0,0,0\n"), "column 3"));
  CHECK(says(error(head + "1,0,,0,1,0,0,0\n"), "column 3"));
  CHECK(says(error(head + "0,0,0,0,1,0,0,0\n"), "p.csv:3: the time does not increase"));
  CHECK(says(error("-1,0,0,0,1,0,0,0\n"), "p.csv:1: the time"));
  CHECK(says(error(head + "1,0,0,0,0,0,0,0\n"), "p.csv:3: qw,qx,qy,qz is not a unit quaternion"));
  CHECK(says(error(head + "1,0,0,0,1.1,0,0,0\n"), "unit quaternion"));
  CHECK(says(error(head + "1,1e7,0,0,1,0,0,0\n"), "p.csv:3: a position beyond"));
  CHECK(says(error(head + head), "p.csv:3: column 1"));  // a second header is a bad row
  CHECK(says(error("nan,0,0,0,1,0,0,0\n"), "p.csv:1: column 1"));
  CHECK(says(error(""), "p.csv: no row"));
  CHECK(says(error("t,x,y,z,qw,qx,qy,qz\n"), "p.csv: no row"));
  CHECK(says(read_path(folder.path / "none.csv", Unit::m).error(), "none.csv: no such file"));
  const Bench bench;
  bench.write("hand.csv", head + "oops\n");
  const std::string in_scene = bench.error(small_scene());
  CHECK(says(in_scene, "hands[0].path"));
  CHECK(says(in_scene, "hand.csv:3"));
}

TEST_CASE("between rows a path moves evenly, turns the shorter way and stands still outside") {
  const double h = std::sqrt(0.5);
  // A quarter turn about z. The second quaternion has the opposite sign.
  const Path path = {{1, {{0, 0, 0}, {1, 0, 0, 0}}}, {3, {{4, 0, -2}, {-h, 0, 0, -h}}}};
  check_same(sample_path(path, 0), path[0].pose);
  check_same(sample_path(path, 1), path[0].pose);
  check_same(sample_path(path, 9).p, path[1].pose.p);
  const h6Pose half = sample_path(path, 2);
  check_same(half.p, h6Vec3{2, 0, -1});
  check_close(std::abs(half.q.w), std::cos(3.14159265358979323846 / 8));
  check_close(half.q.z / half.q.w, std::tan(3.14159265358979323846 / 8));
  const h6Velocity v = sample_path_velocity(path, 2);
  check_same(v.linear, h6Vec3{2, 0, -1});
  check_same(v.angular, h6Vec3{0, 0, 3.14159265358979323846 / 4});
  for (const double t : {0.5, 3.0, 3.5}) {
    CHECK(sample_path_velocity(path, t).linear.x == 0);
    CHECK(sample_path_velocity(path, t).angular.z == 0);
  }
}

TEST_CASE("a path's velocity is the derivative of its pose") {
  const Path path = {{0, {{0, 0, 0}, {0.5, 0.5, 0.5, 0.5}}},
                     {0.5, {{0.1, 0.2, 0.3}, {0.6, 0, 0.8, 0}}}};
  const double t = 0.2, e = 1e-6;
  const h6Pose a = sample_path(path, t - e), b = sample_path(path, t + e);
  const h6Velocity v = sample_path_velocity(path, t);
  CHECK(v.linear.y == h6::test::near((b.p.y - a.p.y) / (2 * e)).epsilon(1e-6));
  // dq/dt = (0, w) q / 2, world frame.
  const h6Quat q = sample_path(path, t).q;
  const h6Vec3& w = v.angular;
  CHECK((b.q.w - a.q.w) / (2 * e) ==
        h6::test::near(0.5 * (-w.x * q.x - w.y * q.y - w.z * q.z)).epsilon(1e-6));
  CHECK((b.q.x - a.q.x) / (2 * e) ==
        h6::test::near(0.5 * (w.x * q.w + w.y * q.z - w.z * q.y)).epsilon(1e-6));
  CHECK((b.q.z - a.q.z) / (2 * e) ==
        h6::test::near(0.5 * (w.x * q.y - w.y * q.x + w.z * q.w)).epsilon(1e-6));
}
