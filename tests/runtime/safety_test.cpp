// Whatever is asked for, what reaches a device is finite, inside the rating, slow enough,
// explained.
#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>
#include "tests/support/near.h"

#include <cmath>
#include <limits>
#include <random>

#include "runtime/safety.h"

using namespace h6;

namespace {

double norm(const h6Vec3& v) { return std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z); }

h6DeviceCapabilities rating(double force, double torque) {
  h6DeviceCapabilities c{};
  c.max_force = force;
  c.max_torque = torque;
  return c;
}

}  // namespace

TEST_CASE("nothing but safe commands comes out of any stream of wrenches") {
  std::mt19937_64 random(11);
  const double specials[] = {
      0, -0.0, 1e300, -1e300, 1e-310, HUGE_VAL, -HUGE_VAL, NAN, std::numeric_limits<double>::max()};
  for (int script = 0; script < 1000; ++script) {
    OutputGuard guard;
    const SafetyLimits limits = limits_of(rating(8, 0.5));
    guard.set_limits(limits);
    h6Wrench last{};
    bool faulted = false;
    for (int frame = 0; frame < 50; ++frame) {
      h6Wrench wanted;
      double* values[] = {&wanted.force.x,  &wanted.force.y,  &wanted.force.z,
                          &wanted.torque.x, &wanted.torque.y, &wanted.torque.z};
      for (double* v : values) {
        const std::uint64_t r = random();
        *v = r % 50 == 0 ? specials[(r >> 8) % 9]
                         : std::ldexp(static_cast<double>(r >> 40), -20) - 8;
      }
      h6Status status = 0;
      const h6DeviceCommand out = guard.pass(wanted, 1e-3, &status);
      REQUIRE(std::isfinite(norm(out.wrench.force)));
      REQUIRE(norm(out.wrench.force) <= limits.force * (1 + 1e-12));
      REQUIRE(norm(out.wrench.torque) <= limits.torque * (1 + 1e-12));
      bool finite = true;
      for (double* v : values) finite = finite && std::isfinite(*v);
      faulted = faulted || !finite;
      if (faulted) {
        REQUIRE(out.cause == H6_CAUSE_NOT_FINITE);
        REQUIRE(norm(out.wrench.force) == 0);
        REQUIRE((status & H6_OUTPUT_FAULT) != 0);
      } else {
        const h6Vec3 df{out.wrench.force.x - last.force.x, out.wrench.force.y - last.force.y,
                        out.wrench.force.z - last.force.z};
        REQUIRE(norm(df) <= limits.force_rate * 1e-3 * (1 + 1e-9));
        const bool changed =
            out.wrench.force.x != wanted.force.x || out.wrench.torque.y != wanted.torque.y;
        REQUIRE((!changed || out.cause != H6_CAUSE_NONE));
      }
      last = out.wrench;
    }
  }
}

TEST_CASE("a wrench inside the limits passes untouched") {
  OutputGuard guard;
  h6Status status = 0;
  const h6Wrench wanted{{1, -2, 0.5}, {0.1, 0.2, 0}};
  const h6DeviceCommand out = guard.pass(wanted, 1e-3, &status);
  CHECK(out.wrench.force.y == -2);
  CHECK(out.wrench.torque.x == 0.1);
  CHECK(out.cause == H6_CAUSE_NONE);
  CHECK(status == 0);
}

TEST_CASE(
    "a fault stays until it is re-armed, and the output then starts from zero at the slew limit") {
  OutputGuard guard;
  guard.set_limits(limits_of(rating(10, 1)));  // 10 N in 5 ms: 2 N a frame
  h6Status status = 0;
  const h6Wrench wanted{{10, 0, 0}, {0, 0, 0}};
  for (int i = 0; i < 10; ++i) guard.pass(wanted, 1e-3, &status);
  CHECK(guard.pass(wanted, 1e-3, &status).wrench.force.x == h6::test::near(10));
  guard.fault(H6_CAUSE_DEVICE_LOST);
  guard.fault(H6_CAUSE_STOPPED);  // the first cause is the one that is kept
  for (int i = 0; i < 5; ++i) {
    const h6DeviceCommand out = guard.pass(wanted, 1e-3, &status);
    CHECK(out.wrench.force.x == 0);
    CHECK(out.cause == H6_CAUSE_DEVICE_LOST);
  }
  guard.rearm();
  CHECK(guard.pass(wanted, 1e-3, &status).wrench.force.x == h6::test::near(2));
  CHECK(guard.pass(wanted, 1e-3, &status).wrench.force.x == h6::test::near(4));
}

TEST_CASE("no rating raises the engine's own ceiling, and a senseless one renders nothing") {
  const SafetyLimits ceiling;
  CHECK(limits_of(rating(1e9, 1e9)).force == ceiling.force);
  CHECK(limits_of(rating(1e9, 1e9)).torque_rate == ceiling.torque_rate);
  CHECK(limits_of(rating(NAN, -1)).force == 0);
  CHECK(limits_of(rating(NAN, -1)).torque == 0);
  CHECK(limits_of(rating(3, 0.2)).force == 3);
}
