// SPDX-License-Identifier: Apache-2.0
#include "io/view/pick.h"

#include <chrono>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "io/view/browser.h"
#include "io/view/page.h"
#include "io/view/pick_request.h"
#include "io/view/view_server.h"

namespace h6::io::view {
namespace {

using nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

constexpr auto kReload = std::chrono::seconds(3);  // between a page that closes and the next
constexpr auto kDelivery = std::chrono::milliseconds(300);  // of the last message

// Carries what the page says from the server's thread.
class Answers {
 public:
  explicit Answers(std::size_t count) : count_(count) {}
  void add(std::string_view text) {
    Result<Picked> picked = parse_picked(text, count_);
    const std::lock_guard<std::mutex> lock(mutex_);
    if (picked && !picked_)
      picked_ = std::move(*picked);
    else if (!picked)
      refused_ = picked.error();
  }
  std::optional<Picked> take(std::string& refused) {
    const std::lock_guard<std::mutex> lock(mutex_);
    refused.swap(refused_);
    refused_.clear();
    return std::move(picked_);
  }

 private:
  const std::size_t count_;
  std::mutex mutex_;
  std::optional<Picked> picked_;
  std::string refused_;
};

Message only_head(ordered_json head) { return Envelope().message(std::move(head)); }

}  // namespace

Message solid_message(const Pickable& model) {
  h6Vec3 low{}, high{};
  if (!model.vertices.empty()) low = high = model.vertices[0];
  for (const h6Vec3& p : model.vertices) low = min(low, p), high = max(high, p);
  const h6Vec3 middle = 0.5 * (low + high);
  const double size = 0.5 * norm(high - low), radius = size > 0 ? size : 1;
  std::vector<float> position;
  position.reserve(3 * model.vertices.size());
  for (const h6Vec3& p : model.vertices)
    for (const double x : {p.x - middle.x, p.y - middle.y, p.z - middle.z})
      position.push_back(static_cast<float>(x / radius));
  Envelope envelope;
  envelope.add("position", position);
  envelope.add("index", model.triangles);
  envelope.add("fixed", model.marked);
  return envelope.message({{"kind", "solid"},
                           {"name", model.name},
                           {"unit", model.unit},
                           {"metres", model.metres},
                           {"origin", {middle.x, middle.y, middle.z}},
                           {"radius", radius},
                           {"vertices", model.vertices.size()}});
}

Result<std::vector<std::uint32_t>> pick_vertices(const Pickable& model,
                                                 const PickOptions& options) {
  const std::string_view page = pick_page();
  if (page.empty()) return Failure{no_page()};
  Answers answers(model.vertices.size());
  ServerOptions serve;
  serve.port = options.port;
  serve.max_request = 4096 + 12 * model.vertices.size();  // every vertex by its number
  Result<std::unique_ptr<ViewServer>> server =
      ViewServer::open(serve, std::string(page), [&](std::string_view text) { answers.add(text); });
  if (!server) return server.failure();
  (*server)->greet(solid_message(model));
  Browser browser;
  const bool shown = options.open && browser.open((*server)->address());
  options.say("choose the fixed vertices: " + (*server)->address() +
              (shown ? "" : "  (open it in a browser here)"));
  bool seen = false;
  for (Clock::time_point left = Clock::now();; std::this_thread::sleep_for(kDelivery / 10)) {
    std::string refused;
    if (std::optional<Picked> picked = answers.take(refused)) {
      if (!picked->use) break;
      (*server)->say(only_head({{"kind", "done"}}));
      std::this_thread::sleep_for(kDelivery);
      return std::move(picked->vertices);
    }
    if (!refused.empty()) (*server)->say(only_head({{"kind", "note"}, {"text", refused}}));
    if ((*server)->clients() > 0) seen = true, left = Clock::now();
    if (seen && Clock::now() - left > kReload) break;
    if (options.stop()) return Failure{"interrupted before vertices were chosen"};
  }
  return Failure{"the page was closed before 'Use these' was pressed, so nothing was written"};
}

}  // namespace h6::io::view
