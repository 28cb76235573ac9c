// SPDX-License-Identifier: Apache-2.0
// A frame never allocates, locks or calls the system, and has the same bits on any number of
// threads.
#include <doctest/doctest.h>

#include <dlfcn.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <pthread.h>
#include <signal.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include "hapsix/batch.h"
#include "runtime/frame/session_slabs.h"
#include "tests/support/ball_in_bowl.h"
#include "tests/support/bridge.h"
#include "tests/support/forced_target.h"
#include "tests/support/sanitized.h"

namespace {
// Counted on the stepping thread only, because the test runner may allocate; or on all threads.
thread_local bool watching = false;
std::atomic<bool> watching_all{false};
std::atomic<long> allocations{0}, locks{0}, calls{0};
void note(std::atomic<long>& counter) {
  if (watching || watching_all.load(std::memory_order_relaxed))
    counter.fetch_add(1, std::memory_order_relaxed);
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
int pthread_mutex_trylock(pthread_mutex_t* mutex) {
  note(locks);
  static const auto next =
      reinterpret_cast<int (*)(pthread_mutex_t*)>(dlsym(RTLD_NEXT, "pthread_mutex_trylock"));
  return next(mutex);
}
#endif
}

using namespace h6::test;

namespace {

constexpr double mm = 1e-3;

// Every rule, and every option of the Gauss rules.
struct Rule {
  h6Method method;
  std::uint32_t pieces;
};
constexpr Rule kRules[] = {{H6_METHOD_GLOBAL, 0},
                           {H6_METHOD_CLUSTER, 0},
                           {H6_METHOD_GAUSS3, H6_PIECE_CLUSTER | H6_PIECE_PRINTED},
                           {H6_METHOD_GAUSS3, 0},
                           {H6_METHOD_GAUSS6, 0},
                           {H6_METHOD_GAUSS6, H6_PIECE_HANDLES | H6_PIECE_GEODESIC},
                           {H6_METHOD_ROBUST, 0},
                           {H6_METHOD_ROBUST, H6_PIECE_CLUSTER},
                           {H6_METHOD_SERIES, 0},
                           {H6_METHOD_FIRM, 0}};
// Some rules are so soft here that the ball sinks in with a third of its points.
int points_for(const Rule& rule) {
  const bool soft = rule.pieces || rule.method == H6_METHOD_CLUSTER;
  return soft || rule.method == H6_METHOD_GAUSS3 ? 6000 : 30000;
}

// All other options of a frame.
struct Mode {
  const char* name;
  void (*set)(BallInBowl&);
  int points = 30000;
};
constexpr Mode kModes[] = {
    {"static coupling", [](BallInBowl& s) { s.hand.coupling.mode = H6_COUPLING_STATIC; }},
    {"direct coupling", [](BallInBowl& s) { s.hand.coupling.mode = H6_COUPLING_DIRECT; }, 2000},
    {"admittance", [](BallInBowl& s) { s.hand.mode = H6_ADMITTANCE; }},
    {"pseudo-admittance",
     [](BallInBowl& s) {
       s.hand.mode = H6_PSEUDO_ADMITTANCE;
       s.hand.driver_stiffness = 1e3, s.hand.driver_damping = 1;
     }},
    {"passivity", [](BallInBowl& s) { s.hand.passivity = s.def.contact.passivity = true; }},
    {"net stiffness", [](BallInBowl& s) { s.def.net_stiffness = true; }},
    {"friction",
     [](BallInBowl& s) {
       s.def.contact.friction = 0.3;
       s.def.gradient = H6_EXACT;
     }},
    {"friction of clusters",
     [](BallInBowl& s) {
       s.def.contact.friction = 0.3;
       s.def.contact.pieces = H6_PIECE_CLUSTER;
     },
     6000},
    {"filter",
     [](BallInBowl& s) {
       s.hand.filter.motion_scale = 1.2, s.hand.filter.force_scale = 0.9;
       s.hand.filter.relative = true, s.hand.filter.clutch_buttons = 1;
     }},
    {"relief of a tight fit", [](BallInBowl& s) { s.bodies[1].pose.p.x = 0.9 * mm; }},
    {"translation only", [](BallInBowl& s) { s.bodies[1].translation_only = true; }},
    {"substeps",
     [](BallInBowl& s) {
       s.def.max_substeps = 8;
       s.bodies[1].velocity = {{2, 1, 0}, {0, 50, 0}};
     }},
    {"explicit step",
     [](BallInBowl& s) { s.def.integrator = H6_EXPLICIT, s.def.contact.stiffness = 100; }}};

}  // namespace

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
namespace {

template <class Scene>
void check_quiet(Scene& scene, int frames, std::uint32_t touching) {
  scene.open();
  std::uint32_t most = 0;
  h6DeviceCommand command;
  for (int i = 0; i < frames; ++i) {
    const h6DeviceSample sample = scene.sample(i);
    watching = true;
    h6Step(scene.session, &sample, &command);
    watching = false;
    most = std::max(most, h6GetFrame(scene.session).contacts);
  }
  CHECK(most > touching);
  CHECK(allocations.exchange(0) == 0);
  CHECK(locks.exchange(0) == 0);
}

}  // namespace

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
  for (const unsigned threads : {1u, 2u}) {
    for (const Rule& rule : kRules)
      for (const h6Gradient gradient : {H6_SYMMETRIC, H6_EXACT}) {
        BallInBowl scene(threads, points_for(rule));
        scene.def.contact.method = rule.method;
        scene.def.contact.pieces = rule.pieces;
        scene.def.gradient = gradient;
        CAPTURE(std::string(h6MethodName(rule.method)));
        CAPTURE(rule.pieces);
        check_quiet(scene, rule.pieces ? 20 : 60, 200);
      }
    for (const Mode& mode : kModes)
      for (const h6Method method : {H6_METHOD_ROBUST, H6_METHOD_SERIES}) {
        BallInBowl scene(threads, mode.points);
        scene.def.contact.method = method;
        mode.set(scene);
        CAPTURE(std::string(mode.name));
        CAPTURE(std::string(h6MethodName(method)));
        check_quiet(scene, 40, 100);
      }
  }
}

TEST_CASE("frames with a body that bends allocate nothing and take no lock") {
  for (const unsigned threads : {1u, 2u})
    for (const h6Method method : {H6_METHOD_FIRM, H6_METHOD_ROBUST, H6_METHOD_SERIES})
      for (const h6Gradient gradient : {H6_SYMMETRIC, H6_EXACT})
        for (const h6CouplingMode mode :
             {H6_COUPLING_DYNAMIC, H6_COUPLING_STATIC, H6_COUPLING_DIRECT})
          for (const std::size_t modes : {std::size_t{6}, std::size_t{64}}) {
            if (modes == 64 && (method != H6_METHOD_FIRM || mode != H6_COUPLING_DYNAMIC)) continue;
            BallOnBridge scene(modes == 64 ? 3000 : 20000, modes);
            scene.def.threads = threads;
            scene.def.contact.method = method;
            scene.def.gradient = gradient;
            scene.hand.coupling.mode = mode;
            CAPTURE(std::string(h6MethodName(method)));
            CAPTURE(modes);
            check_quiet(scene, 150, modes == 64 ? 0 : 5);
          }
}

TEST_CASE("a slab of many sessions is one piece of the heap, and its tables stand in it") {
  if (kSanitized) return;  // the heap is the sanitizer's then
  h6::SessionSlabs slabs;
  std::vector<void*> pieces(150);
  watching = true;
  for (void*& piece : pieces) piece = slabs.take(100000);
  for (std::size_t i = 0; i < pieces.size(); i += 2) slabs.give_back(pieces[i], 100000);
  for (std::size_t i = 0; i < pieces.size(); i += 2) pieces[i] = slabs.take(100000);
  watching = false;
  CHECK(allocations.exchange(0) == 1);
  for (void* piece : pieces) slabs.give_back(piece, 100000);
  locks = 0;
}

TEST_CASE("stepping many sessions in one call allocates nothing and takes no lock") {
  BallInBowl scene(1, 6000);
  for (const unsigned threads : {1u, 2u}) {
    h6WorkersDef def = h6DefaultWorkersDef();
    def.threads = threads;
    h6Workers* workers = h6CreateWorkers(&def, nullptr);
    std::vector<h6Session*> sessions;
    for (int i = 0; i < 16; ++i) {  // every other one shares the scratch of the workers
      scene.def.workers = i % 2 ? workers : nullptr;
      sessions.push_back(h6CreateSession(scene.model.handle, &scene.def, nullptr));
    }
    std::vector<h6Pose> where(sessions.size());
    std::vector<h6Wrench> felt(sessions.size());
    h6StepArrays arrays = h6DefaultStepArrays();
    arrays.sessions = sessions.data(), arrays.count = sessions.size();
    arrays.pose = where.data(), arrays.command = felt.data();
    for (int i = 0; i < 60; ++i) {
      for (h6Pose& p : where) p = scene.sample(i).pose;
      watching_all = true;  // the workers too
      h6StepMany(workers, &arrays);
      watching_all = false;
    }
    CHECK(h6GetFrame(sessions[0]).contacts > 50);
    CHECK(allocations.exchange(0) == 0);
    CHECK(locks.exchange(0) == 0);
    for (h6Session* session : sessions) h6DestroySession(session);
    h6DestroyWorkers(workers);
  }
}

namespace {

// ---- a process whose stepping thread may not call the system at all

struct Counts {
  long allocations = 0, locks = 0, calls = 0, frames = 0;
  long worth_sharing = 0, shared = 0;  // frames with work for a helper, and with a helper's work
};

// From now on every system call of this thread is counted instead of made. The exceptions are the
// ends of signal handlers and of the process, write for the result, and the monotonic clock where
// it is a system call.
bool forbid_calls() {
  struct sigaction action {};
  action.sa_sigaction = [](int, siginfo_t*, void*) { calls.fetch_add(1); };
  action.sa_flags = SA_SIGINFO;
  sigaction(SIGSYS, &action, nullptr);
  const auto allow = [](unsigned number) {
    return std::array<sock_filter, 2>{sock_filter{BPF_JMP | BPF_JEQ | BPF_K, 0, 1, number},
                                      sock_filter{BPF_RET | BPF_K, 0, 0, SECCOMP_RET_ALLOW}};
  };
  std::vector<sock_filter> filter{
      {BPF_LD | BPF_W | BPF_ABS, 0, 0, static_cast<unsigned>(offsetof(seccomp_data, nr))}};
  for (const unsigned number : {SYS_rt_sigreturn, SYS_exit_group, SYS_write, SYS_clock_gettime}) {
    const auto pair = allow(number);
    filter.insert(filter.end(), pair.begin(), pair.end());
  }
  filter.push_back({BPF_RET | BPF_K, 0, 0, SECCOMP_RET_TRAP});
  const sock_fprog program{static_cast<unsigned short>(filter.size()), filter.data()};
  return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0;
}

// Runs in a process of its own and ends it, because destructors would call the system. `break_it`:
// shows that the counters count.
[[noreturn]] void run_forbidden(int result, unsigned threads, long frames, bool break_it) {
  BallInBowl scene(threads, 24000);
  scene.hand.passivity = scene.def.contact.passivity = true;
  scene.def.contact.friction = 0.3;
  scene.open();
  std::vector<h6DeviceSample> samples;
  for (int i = 0; i < 1000; ++i) samples.push_back(scene.sample(i));
  std::vector<h6DeviceCommand> commands(1);
  // The helper works once its thread has started, which may take long on a busy machine.
  bool helper_came = threads == 1;
  for (int i = 0; i < 50 || (!helper_came && i < 20000); ++i) {
    h6Step(scene.session, &samples[0], commands.data());
    helper_came = helper_came || h6GetFrame(scene.session).helper_slices > 0;
  }
  Counts counts;
  if (!forbid_calls()) counts.frames = frames = -1;
  watching_all = true;
  for (long i = 0; i < frames; ++i) {
    const auto k = static_cast<std::size_t>(i % 1000);
    // Every tenth frame is coarse, so that both kinds of traversal run.
    if (i % 10 == 9) h6SetCoarse(scene.session, 1, 1u << i / 10 % 5 & 15u);
    h6Step(scene.session, &samples[k], commands.data());
    const h6FrameReport report = h6GetFrame(scene.session);
    counts.worth_sharing += report.contacts >= 256;
    counts.shared += report.helper_slices > 0;
  }
  if (break_it && frames > 0) {
    std::free(std::malloc(3));
    pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
    pthread_mutex_lock(&mutex);
    syscall(SYS_getppid);
  }
  watching_all = false;
  counts.allocations = allocations, counts.locks = locks, counts.calls = calls;
  counts.frames = frames;
  (void)!write(result, &counts, sizeof counts);
  for (;;) syscall(SYS_exit_group, 0);
}

constexpr const char* kForbidden = "--frames-without-calls";

// Starts this program again: a mere fork would have TBB's state without its threads, and wait for
// them.
Counts in_a_process(unsigned threads, long frames, bool break_it) {
  int ends[2];
  REQUIRE(pipe(ends) == 0);
  std::string words[] = {"/proc/self/exe",        kForbidden,
                         std::to_string(ends[1]), std::to_string(threads),
                         std::to_string(frames),  std::to_string(int{break_it})};
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  pid_t pid = 0;
  REQUIRE(posix_spawn(&pid, words[0].c_str(), nullptr, nullptr, arguments.data(), environ) == 0);
  close(ends[1]);
  Counts counts;
  const bool told = read(ends[0], &counts, sizeof counts) == sizeof counts;
  close(ends[0]);
  waitpid(pid, nullptr, 0);
  REQUIRE(told);
  return counts;
}

}  // namespace

TEST_CASE("ten thousand frames call neither allocator, lock nor system, on one thread and on two") {
  const Counts broken = in_a_process(1, 10, true);
  if (broken.frames < 0) {
    MESSAGE("this machine does not let a process forbid itself system calls: skipped");
    return;
  }
  CHECK(broken.allocations == 1);
  CHECK(broken.locks == 1);
  CHECK(broken.calls == 1);
  for (const unsigned threads : {1u, 2u}) {
    CAPTURE(threads);
    const Counts counts = in_a_process(threads, 10000, false);
    CHECK(counts.frames == 10000);
    CHECK(counts.worth_sharing > 5000);
    if (threads == 1) CHECK(counts.shared == 0);
    if (threads == 2 && counts.shared == 0) MESSAGE("the helper got no core: it was not watched");
    CHECK(counts.allocations == 0);
    CHECK(counts.locks == 0);
    CHECK(counts.calls == 0);
  }
}
#endif

namespace {

constexpr int kFrames = repeated(60, 16);

void check_same_bits(BallInBowl& one, BallInBowl& two, int frames, std::uint32_t touching) {
  one.open();
  two.open();
  h6DeviceCommand a{}, b{};
  std::uint32_t most = 0;
  for (int i = 0; i < frames; ++i) {
    const h6DeviceSample sample = one.sample(i);
    h6Step(one.session, &sample, &a);
    h6Step(two.session, &sample, &b);
    REQUIRE(h6GetFrame(one.session).state_hash == h6GetFrame(two.session).state_hash);
    REQUIRE(a.wrench.torque.x == b.wrench.torque.x);
    REQUIRE(a.pose.p.x == b.pose.p.x);
    most = std::max(most, h6GetFrame(one.session).contacts);
  }
  CHECK(most > touching);
}

}  // namespace

TEST_CASE("one thread and two give the same bits, frame by frame") {
  for (const Rule& rule : kRules) {
    BallInBowl one(1, points_for(rule)), two(2, points_for(rule));
    for (BallInBowl* scene : {&one, &two}) {
      scene->def.contact.method = rule.method;
      scene->def.contact.pieces = rule.pieces;
    }
    CAPTURE(std::string(h6MethodName(rule.method)));
    CAPTURE(rule.pieces);
    // Enough contacts for the helper: 256, where weights are sums over all pairs.
    const bool pairs = rule.method == H6_METHOD_GAUSS6 || rule.method == H6_METHOD_ROBUST;
    check_same_bits(one, two, kFrames, pairs && !rule.pieces ? 300 : 200);
  }
  for (const Mode& mode : kModes) {
    BallInBowl one(1, mode.points), two(2, mode.points);
    mode.set(one);
    mode.set(two);
    CAPTURE(std::string(mode.name));
    check_same_bits(one, two, std::max(kFrames, 40), 100);  // some modes take longer to touch
  }
}

TEST_CASE("many fields and two hands: pairs shared between threads give the same bits") {
  // 24 bowls, one into the other, and two balls in each of them.
  struct Bowls : BallInBowl {
    std::vector<h6BodyDef> many;
    std::array<h6HandDef, 2> two{h6DefaultHandDef(), h6DefaultHandDef()};
    Bowls(unsigned threads, std::size_t most) : BallInBowl(threads, 3000) {
      for (int i = 0; i < 26; ++i) {
        h6BodyDef body = h6DefaultBodyDef();
        body.fixed = i >= 2;
        (i < 2 ? body.shell : body.field) = 0;
        if (i >= 2) body.pose = pose(0.05 * mm * (i % 5), 0.04 * mm * (i % 7), 0.03 * mm * i);
        many.push_back(body);
      }
      for (std::size_t i = 0; i < 2; ++i) two[i] = hand, two[i].body = static_cast<int>(i);
      def.bodies = many.data(), def.body_count = many.size();
      def.hands = two.data(), def.hand_count = 2;
      def.max_contacts = most;
    }
  };
  for (const std::size_t most : {72000u, 700u, 60u}) {
    CAPTURE(most);
    Bowls one(1, most), two(2, most);
    one.open();
    two.open();
    std::uint32_t contacts = 0;
    bool dropped = false;
    for (int i = 0; i < std::min(50, 2 * kFrames); ++i) {
      const h6DeviceSample samples[] = {one.sample(i), one.sample(i + 40)};
      if (i % 10 == 9) h6SetCoarse(one.session, 17, 2), h6SetCoarse(two.session, 17, 2);
      h6Step(one.session, samples, nullptr);
      h6Step(two.session, samples, nullptr);
      const h6FrameReport a = h6GetFrame(one.session), b = h6GetFrame(two.session);
      REQUIRE(a.state_hash == b.state_hash);
      REQUIRE(a.contacts == b.contacts);
      REQUIRE(a.missed_depth_voxels == b.missed_depth_voxels);
      REQUIRE(a.status == b.status);
      for (int body = 0; body < 2; ++body) {
        const h6Contacts c = h6GetContacts(one.session, body), d = h6GetContacts(two.session, body);
        REQUIRE(c.count == d.count);
        for (std::size_t k = 0; k < c.count; ++k) {
          if (c.point[k] == d.point[k] && c.field_body[k] == d.field_body[k]) continue;
          REQUIRE(c.point[k] == d.point[k]);
          REQUIRE(c.field_body[k] == d.field_body[k]);
        }
      }
      contacts = std::max(contacts, a.contacts);
      dropped = dropped || (a.status & H6_CONTACTS_DROPPED);
    }
    CHECK(contacts >= std::min<std::size_t>(most, 800));
    CHECK(dropped == (most < 1000));
  }
}

TEST_CASE("a changed input changes the hash") {
  BallInBowl one(1), two(1);
  one.open();
  two.open();
  for (int i = 0; i < 50; ++i) {
    h6DeviceSample sample = one.sample(i);
    h6Step(one.session, &sample, nullptr);
    if (i == 20) sample.pose.p.x = std::nextafter(sample.pose.p.x, 1.0);
    h6Step(two.session, &sample, nullptr);
    CHECK((h6GetFrame(one.session).state_hash == h6GetFrame(two.session).state_hash) == (i < 20));
  }
}

TEST_CASE(
    "too many contacts: as many as fit are kept, the deepest first, and the frame reports it") {
  BallInBowl all(1);
  BallInBowl few(1);
  few.def.max_contacts = 100;
  all.open();
  few.open();
  const h6BodyState pushed{pose(0.8 * mm, 0, 0), {}};
  h6SetBody(all.session, 1, &pushed);
  h6SetBody(few.session, 1, &pushed);
  const h6DeviceSample sample = hand_at(pushed.pose);
  CHECK((h6Step(all.session, &sample, nullptr) & H6_CONTACTS_DROPPED) == 0);
  CHECK((h6Step(few.session, &sample, nullptr) & H6_CONTACTS_DROPPED) != 0);
  const h6Contacts a = h6GetContacts(all.session, 1), f = h6GetContacts(few.session, 1);
  REQUIRE(a.count > 200);
  REQUIRE(f.count == 100);
  const auto deepest = std::max_element(a.depth, a.depth + a.count) - a.depth;
  CHECK(std::find(f.point, f.point + f.count, a.point[deepest]) != f.point + f.count);
  for (std::size_t i = 0; i < f.count; ++i)
    CHECK(std::find(a.point, a.point + a.count, f.point[i]) != a.point + a.count);
}

int main(int argc, char** argv) {
  if (const int code = h6::test::force_target_or_exit_code()) return code;
  doctest::Context context(argc, argv);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  if (argc == 6 && std::string(argv[1]) == kForbidden) {
    context.setAsDefaultForAssertsOutOfTestCases();
    context.setAssertHandler([](const doctest::AssertData&) { std::abort(); });
    run_forbidden(std::atoi(argv[2]), static_cast<unsigned>(std::atoi(argv[3])), std::atol(argv[4]),
                  std::atoi(argv[5]) != 0);
  }
#endif
  return context.run();
}
