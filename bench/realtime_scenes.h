// SPDX-License-Identifier: Apache-2.0
// realtime_scenes.h - the scenes of the real-time benchmarks: sessions and a hand.
#pragma once
#include <cmath>
#include <memory>
#include <string>

#include "io/scene/load_scene.h"
#include "io/scenes/scenes.h"
#include "tests/support/frame_scenes.h"

namespace h6::bench {

struct SessionDeleter {
  void operator()(h6Session* s) const { h6DestroySession(s); }
};
struct LoopDeleter {
  void operator()(h6Loop* l) const { h6DestroyLoop(l); }
};
using Session = std::unique_ptr<h6Session, SessionDeleter>;
using Loop = std::unique_ptr<h6Loop, LoopDeleter>;

class Scene {
 public:
  virtual ~Scene() = default;
  virtual Session session(double rate, unsigned threads, bool budget) = 0;
  virtual h6Device hand() = 0;
  virtual double least_contacts() const = 0;
};

class Alpha : public Scene {
 public:
  Alpha() : loaded_(io::load_scene(*io::make_scene("alpha-shortcut"))) {}
  Session session(double rate, unsigned threads, bool) override {
    h6SessionDef def = (*loaded_)->session_def();
    def.rate = rate, def.threads = threads;
    return Session(h6CreateSession((*loaded_)->model.get(), &def, nullptr));
  }
  h6Device hand() override {
    h6Device device{};
    device.self = this;
    device.read = [](void* self, double t, h6DeviceSample* out) {
      const io::LoadedScene& scene = **static_cast<Alpha*>(self)->loaded_;
      const io::Path& path = scene.scene.hands[0].path;
      const double whole = path.back().t, at = std::fmod(t, 2 * whole);
      *out = {};
      out->pose = io::sample_path(path, at < whole ? at : 2 * whole - at);
      return 0;
    };
    device.write = [](void*, double, const h6DeviceCommand*) { return 0; };
    return device;
  }
  double least_contacts() const override { return 10; }

 private:
  Result<std::unique_ptr<io::LoadedScene>> loaded_;
};

// A part in a socket that fits it, pushed in until 10,000 of its points touch. It trembles by 0.02
// voxel.
class Socket : public Scene {
 public:
  Socket() : model_(make_model(true)) {
    const Session probe = session(1000, 1, false);
    double low = 0, high = 8;
    for (int i = 0; i < 20; ++i) {
      push_ = 0.5 * (low + high);
      const h6DeviceSample sample = at(push_);
      h6Step(probe.get(), &sample, nullptr);
      (h6GetFrame(probe.get()).contacts < 10000 ? low : high) = push_;
    }
  }
  ~Socket() override { h6DestroyModel(model_); }
  Session session(double rate, unsigned threads, bool budget) override {
    h6BodyDef bodies[2] = {h6DefaultBodyDef(), h6DefaultBodyDef()};
    bodies[0].fixed = true, bodies[0].field = 0;
    bodies[1].shell = 0;
    h6HandDef hand = h6DefaultHandDef();
    hand.body = 1;
    hand.coupling.mode = H6_COUPLING_DIRECT;
    h6SessionDef def = h6DefaultSessionDef();
    def.bodies = bodies, def.body_count = 2;
    def.hands = &hand, def.hand_count = 1;
    def.rate = rate, def.threads = threads;
    def.frame_budget_us = budget ? 0.8e6 / rate : 0;
    return Session(h6CreateSession(model_, &def, nullptr));
  }
  h6Device hand() override {
    h6Device device{};
    device.self = this;
    device.read = [](void* self, double t, h6DeviceSample* out) {
      const Socket& s = *static_cast<Socket*>(self);
      return *out = s.at(s.push_ + 0.01 * std::sin(30 * t)), 0;
    };
    device.write = [](void*, double, const h6DeviceCommand*) { return 0; };
    return device;
  }
  double least_contacts() const override { return 500; }

 private:
  h6DeviceSample at(double push) const {
    h6DeviceSample sample{};
    const double v = kVoxel * push;
    sample.pose = {{0.7 * v, 0.6 * v, -0.387 * v}, {1, 0, 0, 0}};
    return sample;
  }
  h6Model* model_;
  double push_ = 0;
};

// Keeps one scene at a time, because the socket's field takes hundreds of megabytes.
inline Scene& scene_named(const std::string& name) {
  static std::unique_ptr<Scene> scene;
  static std::string held;
  if (held != name) {
    scene.reset();
    if (name == "alpha")
      scene = std::make_unique<Alpha>();
    else
      scene = std::make_unique<Socket>();
    held = name;
  }
  return *scene;
}

}  // namespace h6::bench
