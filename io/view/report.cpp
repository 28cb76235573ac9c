// SPDX-License-Identifier: Apache-2.0
#include "io/view/report.h"

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "hapsix/vector.h"
#include "io/mesh/mesh_file.h"
#include "io/view/envelope.h"
#include "io/view/page.h"
#include "io/view/scene_drawing.h"

namespace h6::io::view {
namespace {

using nlohmann::ordered_json;

constexpr std::uint64_t kSpans = 3000, kReplaySamples = 4000;
constexpr std::size_t kContacts = 64, kLateFrames = 200, kEvents = 500, kTriangles = 60000;
constexpr double kReplayRate = 60;

double percentile(std::vector<float> v, double share) {
  if (v.empty()) return 0;
  const auto at =
      static_cast<std::size_t>(std::clamp(std::ceil(share * static_cast<double>(v.size())) - 1, 0.0,
                                          static_cast<double>(v.size() - 1)));
  std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(at), v.end());
  return v[at];
}

ordered_json spread(const std::vector<float>& v) {
  double sum = 0, most = 0;
  for (const float x : v) sum += x, most = std::max<double>(most, x);
  return {{"mean", v.empty() ? 0 : sum / static_cast<double>(v.size())},
          {"p50", percentile(v, 0.5)},
          {"p99", percentile(v, 0.99)},
          {"max", most}};
}

// In gzip format, which the page's DecompressionStream reads.
std::string gzip(const std::string& raw) {
  z_stream z{};
  deflateInit2(&z, 9, Z_DEFLATED, 15 + 16, 9, Z_DEFAULT_STRATEGY);
  std::string out(deflateBound(&z, raw.size()), '\0');
  z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(raw.data()));
  z.avail_in = static_cast<uInt>(raw.size());
  z.next_out = reinterpret_cast<Bytef*>(out.data());
  z.avail_out = static_cast<uInt>(out.size());
  deflate(&z, Z_FINISH);
  out.resize(z.total_out);
  deflateEnd(&z);
  return out;
}

std::string base64(const std::string& bytes) {
  static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k)
      word = word << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0);
    for (std::size_t k = 0; k < 4; ++k)
      out += i + k > bytes.size() ? '=' : digits[word >> (18 - 6 * k) & 63];
  }
  return out;
}

// Where and when a point first passed through the environment, or else was in a forbidden region
// [m, s], from the summary of `hapsix run`; null when none did or the summary does not say.
ordered_json popped_through(const ordered_json& summary) {
  try {
    ordered_json first = summary.at("pop_through").at("first");
    if (first.is_null()) first = summary.value("forbidden", ordered_json());
    const Result<Unit> unit = unit_from_name(summary.at("units"));
    if (first.is_null() || !unit) return nullptr;
    ordered_json place = ordered_json::array();
    for (const double p : first.at("place")) place.push_back(p * metres(*unit));
    return {{"t", first.at("time").get<double>()}, {"place", place}};
  } catch (const std::exception&) {
    return nullptr;
  }
}

ordered_json tightest_json(const std::optional<TightestPlace>& t) {
  if (!t) return nullptr;
  return {
      {"t", t->time}, {"place", t->place}, {"unit", t->unit}, {"part", t->part}, {"other", t->other}};
}

}  // namespace

ReportRun::ReportRun(std::string label, RecordingHead head, std::uint64_t frames)
    : label_(std::move(label)), head_(std::move(head)), frames_(frames), judge_(head_.rate) {
  span_frames_ = std::max<std::uint64_t>(1, (frames + kSpans - 1) / kSpans);
  const auto by_rate = static_cast<std::uint64_t>(std::max(1.0, head_.rate / kReplayRate));
  const std::uint64_t step = std::max(by_rate, (frames + kReplaySamples - 1) / kReplaySamples);
  for (std::uint64_t f = 0; f < frames; f += step) replay_frames_.push_back(f);
  contacts_.resize(replay_frames_.size());
}

void ReportRun::add(const std::vector<h6FrameRecord>& frames) {
  for (const h6FrameRecord& r : frames) row(r);
}

void ReportRun::row(const h6FrameRecord& r) {
  const h6Wrench& felt = r.command[0].wrench;
  const std::array<float, 5> now = {
      static_cast<float>(r.report.contacts), static_cast<float>(norm(felt.force)),
      1e3f * static_cast<float>(norm(felt.torque)), static_cast<float>(r.report.max_depth_voxels),
      static_cast<float>(r.report.frame_us)};
  if (span_.frames == 0) {
    span_.time = r.time;
    span_.low = span_.high = now;
  }
  for (std::size_t i = 0; i < now.size(); ++i) {
    span_.low[i] = std::min(span_.low[i], now[i]);
    span_.high[i] = std::max(span_.high[i], now[i]);
  }
  if (++span_.frames == span_frames_) close_span();
  const std::size_t shown = replay_t_.size();
  if (shown < replay_frames_.size() && replay_frames_[shown] == seen_) {
    replay_t_.push_back(static_cast<float>(r.time));
    append_pose(replay_body_, r.body[0].pose);
    append_pose(replay_hand_, r.hand[0].pose);
  }
  for (std::size_t s = 0; s < stage_us_.size(); ++s)
    stage_us_[s].push_back(static_cast<float>(r.report.stage_us[s]));
  frame_us_.push_back(static_cast<float>(r.report.frame_us));
  for (int k = 0; k < 3; ++k) late_[k] += (r.late & (1u << k)) != 0;
  judge_.row(r, [this](const LateFrame& late) { late_frame(late); });
  contacts_sum_ += r.report.contacts;
  contacts_max_ = std::max(contacts_max_, r.report.contacts);
  depth_max_ = std::max(depth_max_, r.report.max_depth_voxels);
  force_max_ = std::max<double>(force_max_, now[1]);
  hash_ = r.report.state_hash;
  end_ = r.time;
  ++seen_;
}

void ReportRun::late_frame(LateFrame late) {
  if (const auto again = again_us_.find(late.frame); again != again_us_.end())
    late.stepped_again(again->second, 1e6 / head_.rate);
  if (late_frames_.size() < kLateFrames)
    late_frames_.push_back(late);
  else
    ++late_left_out_;
}

void ReportRun::close_span() {
  const auto put = [&](double time, const std::array<float, 5>& values) {
    rows_.push_back(static_cast<float>(time));
    rows_.insert(rows_.end(), values.begin(), values.end());
  };
  put(span_.time, span_.low);
  const double half = 0.5 * static_cast<double>(span_.frames) / head_.rate;
  if (span_.frames > 1) put(span_.time + half, span_.high);
  span_ = {};
}

void ReportRun::events(std::vector<RecordingEvent> events, std::string summary_json) {
  events_ = std::move(events);
  summary_ = std::move(summary_json);
  if (span_.frames > 0) close_span();
  judge_.finish([this](const LateFrame& late) { late_frame(late); });
}

void ReportRun::contacts(std::size_t sample, std::vector<ReportContact> all) {
  const auto deeper = [](const ReportContact& a, const ReportContact& b) {
    return a.depth > b.depth;
  };
  if (all.size() > kContacts) {
    std::nth_element(all.begin(), all.begin() + kContacts, all.end(), deeper);
    all.resize(kContacts);
  }
  contacts_[sample] = std::move(all);
}

void ReportRun::bend(std::size_t sample, const std::vector<float>& q) {
  replay_bends_.resize(sample * q.size());
  replay_bends_.insert(replay_bends_.end(), q.begin(), q.end());
}

// Fills the envelope with the report's head and arrays.
class ReportWriter {
 public:
  ReportWriter(const LoadedScene* scene, Envelope& envelope, std::vector<std::string>& remarks)
      : envelope_(envelope) {
    head_ = {{"kind", "report"}};
    ordered_json drawn{{"name", ""},
                       {"unit", "m"},
                       {"voxel", 1e-3},
                       {"hand_body", -1},
                       {"bodies", ordered_json::array()}};
    if (scene) drawn = draw_scene(*scene, {kTriangles}, envelope, remarks);
    voxel_ = drawn["voxel"];
    head_.update(drawn);
  }

  void run(const ReportRun& r, std::size_t number, const std::array<double, 3>& origin,
           double step) {
    const std::string n = std::to_string(number);
    envelope_.add("rows" + n, r.rows_);
    envelope_.add("replay_t" + n, r.replay_t_);
    envelope_.add("replay_body" + n, r.replay_body_);
    envelope_.add("replay_hand" + n, r.replay_hand_);
    envelope_.add("replay_bends" + n, r.replay_bends_);
    contacts(r, n, origin, step);
    const double frames = static_cast<double>(std::max<std::uint64_t>(1, r.seen_));
    const ordered_json summary = ordered_json::parse(r.summary_, nullptr, false);
    const auto said = [&](const char* key) {
      return summary.is_object() && summary.contains(key) && summary[key].is_string()
                 ? summary[key].get<std::string>()
                 : std::string("unknown");
    };
    ordered_json stages = ordered_json::array();
    for (int s = 0; s < H6_STAGE_COUNT; ++s) {
      ordered_json stage = spread(r.stage_us_[static_cast<std::size_t>(s)]);
      stage["name"] = h6StageName(static_cast<h6Stage>(s));
      stages.push_back(stage);
    }
    ordered_json late = ordered_json::array(), events = ordered_json::array();
    for (const auto& l : r.late_frames_)
      late.push_back({{"t", l.time},
                      {"frame", l.frame},
                      {"cause", late_cause_name(l.cause)},
                      {"frame_us", l.frame_us},
                      {"again_us", l.again_us < 0 ? ordered_json() : ordered_json(l.again_us)},
                      {"wakeup_us", l.wakeup_us}});
    for (std::size_t i = 0; i < std::min(kEvents, r.events_.size()); ++i)
      events.push_back(
          {{"t", r.events_[i].time}, {"what", r.events_[i].what}, {"detail", r.events_[i].detail}});
    if (r.events_.size() > kEvents)
      events.push_back({{"t", r.end_},
                        {"what", "more"},
                        {"detail", std::to_string(r.events_.size() - kEvents) +
                                       " more events are in the recording"}});
    char hash[20];
    std::snprintf(hash, sizeof hash, "%016llx", static_cast<unsigned long long>(r.hash_));
    runs_.push_back(
        {{"label", r.label_},
         {"method", said("method")},
         {"verdict", said("verdict")},
         {"through", popped_through(summary)},
         {"frames", r.seen_},
         {"contacts_mean", r.contacts_sum_ / frames},
         {"contacts_max", r.contacts_max_},
         {"depth_max", r.depth_max_},
         {"tightest", tightest_json(r.tightest_)},
         {"force_max", r.force_max_},
         {"frame_us", spread(r.frame_us_)},
         {"stages", stages},
         {"late", {{"compute", r.late_[0]}, {"wakeup", r.late_[1]}, {"stolen", r.late_[2]}}},
         {"late_frames", late},
         {"late_left_out", r.late_left_out_},
         {"events", events},
         {"state_hash", hash},
         {"program", r.head_.program},
         {"simd_target", r.head_.simd_target},
         {"asset_hashes", r.head_.asset_hashes},
         {"config", r.head_.scene_json}});
    duration_ = std::max(duration_, r.end_);
  }

  ordered_json head(const std::string& about, const std::array<double, 3>& origin, double step) {
    const std::string name = head_["name"];
    head_["title"] = "hapsix report" + (name.empty() ? "" : ": " + name);
    head_["about"] = std::to_string(runs_.size()) +
                     (runs_.size() == 1 ? " recording" : " recordings, drawn over one another");
    head_["replay_about"] = about;
    head_["duration"] = duration_;
    head_["contact_origin"] = {origin[0], origin[1], origin[2]};
    head_["contact_step"] = step;
    head_["runs"] = runs_;
    return head_;
  }

 private:
  void contacts(const ReportRun& r, const std::string& n, const std::array<double, 3>& origin,
                double step) {
    std::vector<std::uint32_t> at{0};
    std::vector<std::int16_t> all;
    const auto cell = [](double value) {
      return static_cast<std::int16_t>(std::lround(std::clamp(value, -32768.0, 32767.0)));
    };
    for (std::size_t i = 0; i < r.replay_t_.size(); ++i) {
      for (const ReportContact& c : r.contacts_[i]) {
        for (std::size_t a = 0; a < 3; ++a) all.push_back(cell((c.position[a] - origin[a]) / step));
        for (std::size_t a = 0; a < 3; ++a) all.push_back(cell(32767.0 * c.normal[a]));
        for (std::size_t a = 0; a < 3; ++a) all.push_back(cell(32767.0 * c.torque_direction[a]));
        all.push_back(cell(32767.0 * c.weight));
        all.push_back(cell(1000.0 * c.depth / voxel_));
      }
      at.push_back(static_cast<std::uint32_t>(all.size() / 11));
    }
    envelope_.add("contact_at" + n, at);
    envelope_.add("contacts" + n, all);
  }

  Envelope& envelope_;
  ordered_json head_, runs_ = ordered_json::array();
  double duration_ = 0, voxel_ = 1e-3;
};

Result<std::string> make_report(const std::vector<ReportRun>& runs, const LoadedScene* scene,
                                const std::string& why) {
  const std::string_view page = report_page();
  if (page.empty()) return Failure{no_page()};
  if (runs.empty()) return Failure{"a report needs a recording"};
  Envelope envelope;
  std::vector<std::string> remarks;
  ReportWriter writer(scene, envelope, remarks);
  // All contacts share one 16-bit grid.
  double low[3] = {1e30, 1e30, 1e30}, high[3] = {-1e30, -1e30, -1e30}, side = 1e-3;
  for (const ReportRun& run : runs)
    for (const auto& sample : run.contacts_)
      for (const ReportContact& c : sample)
        for (std::size_t a = 0; a < 3; ++a) {
          low[a] = std::min<double>(low[a], c.position[a]);
          high[a] = std::max<double>(high[a], c.position[a]);
        }
  std::array<double, 3> origin{};
  for (std::size_t a = 0; a < 3; ++a)
    if (low[a] <= high[a]) {
      origin[a] = 0.5 * (low[a] + high[a]);
      side = std::max(side, high[a] - low[a]);
    }
  const double step = side / 65000;
  for (std::size_t i = 0; i < runs.size(); ++i) writer.run(runs[i], i, origin, step);
  std::string about = why;
  for (const std::string& remark : remarks) about += (about.empty() ? "" : "; ") + remark;
  const std::string data = base64(gzip(envelope.pack(writer.head(about, origin, step))));
  const std::size_t at = page.find("@data@");
  std::string html(page.substr(0, at));
  return html.append(data).append(page.substr(at + 6));
}

}  // namespace h6::io::view
