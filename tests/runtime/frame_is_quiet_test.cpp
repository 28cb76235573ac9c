// A frame never allocates, locks or calls the system, and says the same with any number of threads.
#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

#include <dlfcn.h>
#include <pthread.h>

#include <array>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <new>
#include <string>
#include <utility>

#include "hapsix/hapsix.h"
#include "tests/support/analytic.h"

namespace {
// Counted on the stepping thread only: the test runner may do as it likes.
thread_local bool watching = false;
std::atomic<long> allocations{0}, locks{0};
void note(std::atomic<long>& counter) {
  if (watching) counter.fetch_add(1, std::memory_order_relaxed);
}
}  // namespace

// Every way to memory and to a lock goes through these.
extern "C" {
void* __libc_malloc(size_t);
void* __libc_calloc(size_t, size_t);
void* __libc_realloc(void*, size_t);
void* __libc_memalign(size_t, size_t);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
void* malloc(size_t n) {
  note(allocations);
  return __libc_malloc(n);
}
void* calloc(size_t n, size_t m) {
  note(allocations);
  return __libc_calloc(n, m);
}
void* realloc(void* p, size_t n) {
  note(allocations);
  return __libc_realloc(p, n);
}
void* aligned_alloc(size_t a, size_t n) {
  note(allocations);
  return __libc_memalign(a, n);
}
int pthread_mutex_lock(pthread_mutex_t* mutex) {
  note(locks);
  static const auto next =
      reinterpret_cast<int (*)(pthread_mutex_t*)>(dlsym(RTLD_NEXT, "pthread_mutex_lock"));
  return next(mutex);
}
#endif
}

using namespace h6::test;

namespace {

constexpr double mm = 1e-3;

// A ball pressed into a conforming bowl: hundreds of contacts in all directions, body rolling
// about.
struct BallInBowl {
  FieldArrays bowl = sample_analytic(
      [](double x, double y, double z) { return 20.2 * mm - std::sqrt(x * x + y * y + z * z); },
      {-32 * mm, -32 * mm, -32 * mm}, mm, 8, 8, 8);
  ShellArrays ball = sphere_points(20 * mm, 30000);
  Model model{{def_of(bowl)}, {ball.def()}};
  std::array<h6BodyDef, 2> bodies{h6DefaultBodyDef(), h6DefaultBodyDef()};
  h6HandDef hand = h6DefaultHandDef();
  h6SessionDef def = h6DefaultSessionDef();
  h6Session* session = nullptr;

  explicit BallInBowl(unsigned threads, h6Method method = H6_METHOD_ROBUST,
                      h6Gradient gradient = H6_SYMMETRIC, std::uint32_t pieces = 0) {
    bodies[0].fixed = true, bodies[0].field = 0;
    bodies[1].shell = 0;
    hand.body = 1;
    hand.coupling.max_depth_voxels = 3;  // pressed hard: many contacts
    def.bodies = bodies.data(), def.body_count = 2;
    def.hands = &hand, def.hand_count = 1;
    def.threads = threads;
    def.contact.method = method;
    def.contact.pieces = pieces;
    def.gradient = gradient;
    h6Error error;
    session = h6CreateSession(model.handle, &def, &error);
    REQUIRE_MESSAGE(session, error.message);
  }
  ~BallInBowl() { h6DestroySession(session); }
  h6DeviceSample sample(int i) const {
    h6DeviceSample s = hand_at(pose(2 * mm * std::sin(0.02 * i), 1.5 * mm * std::cos(0.013 * i),
                                    1 * mm * std::sin(0.05 * i)));
    const double a = 0.2 * std::sin(0.01 * i);
    s.pose.q = {std::cos(a), 0, std::sin(a), 0};
    return s;
  }
};

// Every rule, and every option of the Gauss ones.
constexpr std::pair<h6Method, std::uint32_t> kRules[] = {
    {H6_METHOD_GLOBAL, 0},
    {H6_METHOD_CLUSTER, 0},
    {H6_METHOD_GAUSS3, H6_PIECE_CLUSTER | H6_PIECE_PRINTED},
    {H6_METHOD_GAUSS3, 0},
    {H6_METHOD_GAUSS6, 0},
    {H6_METHOD_GAUSS6, H6_PIECE_HANDLES | H6_PIECE_GEODESIC},
    {H6_METHOD_ROBUST, 0},
    {H6_METHOD_ROBUST, H6_PIECE_CLUSTER},
    {H6_METHOD_SERIES, 0}};

}  // namespace

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
TEST_CASE("a thousand frames allocate nothing and take no lock, on one thread and on two") {
  {  // the counters count
    watching = true;
    std::free(std::malloc(3));
    pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
    pthread_mutex_lock(&mutex);
    pthread_mutex_unlock(&mutex);
    watching = false;
    CHECK(allocations.exchange(0) == 1);
    CHECK(locks.exchange(0) == 1);
  }
  for (const unsigned threads : {1u, 2u})
    for (const auto& [method, pieces] : kRules)
      for (const h6Gradient gradient : {H6_SYMMETRIC, H6_EXACT}) {
        BallInBowl scene(threads, method, gradient, pieces);
        CAPTURE(std::string(h6MethodName(method)));
        std::uint32_t most = 0;
        h6DeviceCommand command;
        for (int i = 0; i < (pieces ? 30 : 125); ++i) {
          const h6DeviceSample sample = scene.sample(i);
          watching = true;
          h6Step(scene.session, &sample, &command);
          watching = false;
          most = std::max(most, h6GetFrame(scene.session).contacts);
        }
        CHECK(most > 200);
        CHECK(allocations.exchange(0) == 0);
        CHECK(locks.exchange(0) == 0);
      }
}
#endif

TEST_CASE("one thread and two give the same bits, frame by frame") {
  for (const auto& [method, pieces] : kRules) {
    BallInBowl one(1, method, H6_SYMMETRIC, pieces), two(2, method, H6_SYMMETRIC, pieces);
    CAPTURE(std::string(h6MethodName(method)));
    CAPTURE(pieces);
    // Enough frames for contacts enough that the helper is asked, in those two.
    const bool shared = (method == H6_METHOD_GAUSS6 || method == H6_METHOD_ROBUST) && !pieces;
    h6DeviceCommand a{}, b{};
    std::uint32_t most = 0;
    for (int i = 0; i < (shared ? 300 : 100); ++i) {
      const h6DeviceSample sample = one.sample(i);
      h6Step(one.session, &sample, &a);
      h6Step(two.session, &sample, &b);
      REQUIRE(h6GetFrame(one.session).state_hash == h6GetFrame(two.session).state_hash);
      REQUIRE(a.wrench.torque.x == b.wrench.torque.x);
      most = std::max(most, h6GetFrame(one.session).contacts);
    }
    CHECK(most > (shared ? 300 : 200));
  }
}

TEST_CASE("a changed input changes the hash") {
  BallInBowl one(1), two(1);
  for (int i = 0; i < 50; ++i) {
    h6DeviceSample sample = one.sample(i);
    h6Step(one.session, &sample, nullptr);
    if (i == 20) sample.pose.p.x = std::nextafter(sample.pose.p.x, 1.0);
    h6Step(two.session, &sample, nullptr);
    CHECK((h6GetFrame(one.session).state_hash == h6GetFrame(two.session).state_hash) == (i < 20));
  }
}

TEST_CASE("too many contacts: the deepest are kept, the frame says so") {
  BallInBowl all(1);
  BallInBowl few(1);
  h6DestroySession(few.session);
  few.def.max_contacts = 100;
  few.session = h6CreateSession(few.model.handle, &few.def, nullptr);
  REQUIRE(few.session);
  const h6BodyState pushed{pose(0.8 * mm, 0, 0), {}};
  h6SetBody(all.session, 1, &pushed);
  h6SetBody(few.session, 1, &pushed);
  const h6DeviceSample sample = hand_at(pushed.pose);
  CHECK((h6Step(all.session, &sample, nullptr) & H6_CONTACTS_DROPPED) == 0);
  CHECK((h6Step(few.session, &sample, nullptr) & H6_CONTACTS_DROPPED) != 0);
  const h6Contacts a = h6GetContacts(all.session, 1), f = h6GetContacts(few.session, 1);
  REQUIRE(a.count > 200);
  REQUIRE(f.count == 100);
  std::vector<float> depths(a.depth, a.depth + a.count);
  std::sort(depths.rbegin(), depths.rend());
  for (std::size_t i = 0; i < f.count; ++i) CHECK(f.depth[i] >= depths[99]);
}
