// SPDX-License-Identifier: Apache-2.0
#include "io/experiments/weighing.h"

#include <algorithm>
#include <cmath>

namespace h6::cli {
namespace {

using nlohmann::ordered_json;

constexpr const char *kOld = "robust", *kNew = "series";
constexpr double kEqual = 0.02;  // figures that differ by less than this share count as the same

class Weighing {
 public:
  enum class Good { low, high };

  void add(const std::string& what, double old_value, double new_value, Good good, int digits,
           const std::string& unit = "") {
    const double more = good == Good::high ? new_value - old_value : old_value - new_value;
    const double tie = kEqual * std::max(std::abs(old_value), std::abs(new_value)) + 1e-12;
    const std::string a = text(old_value, digits) + unit, b = text(new_value, digits) + unit;
    add_words(what, a, b, std::abs(more) <= tie || a == b ? 0 : more > 0 ? 1 : -1);
    json_[what] = {{kOld, old_value}, {kNew, new_value}};
  }
  // `better` is 1 when the new method is better, -1 when the old one is, 0 when neither is.
  void add_words(const std::string& what, const std::string& a, const std::string& b, int better) {
    table_.push_back({what, a, b, better == 0 ? "same" : better > 0 ? kNew : kOld});
    (better == 0 ? same_ : better > 0 ? wins_ : losses_).push_back(what);
  }
  void into(Study& out) const {
    out.table = {{"criterion", kOld, kNew, "better"}};
    out.table.insert(out.table.end(), table_.begin(), table_.end());
    out.json = {{"figures", json_}, {"better", wins_}, {"same", same_}, {"worse", losses_}};
  }
  const std::vector<std::string>& wins() const { return wins_; }
  const std::vector<std::string>& same() const { return same_; }
  const std::vector<std::string>& losses() const { return losses_; }

 private:
  static std::string text(double value, int digits) {
    if (std::abs(value) < 1e4) return number(value, digits);
    char out[32];
    std::snprintf(out, sizeof out, "%.1e", value);
    return out;
  }
  TextTable table_;
  ordered_json json_ = ordered_json::object();
  std::vector<std::string> wins_, same_, losses_;
};

using Good = Weighing::Good;

struct Both {
  double old_value = 0, new_value = 0;
  void most(double a, double b) {
    old_value = std::max(old_value, a), new_value = std::max(new_value, b);
  }
};
// The figures of both methods in an object that has one entry for each column. The JSON pointer
// names the figure in an entry.
Both both(const ordered_json& row, const char* pointer = "") {
  const ordered_json::json_pointer at(pointer);
  return {row.at(kOld).at(at).get<double>(), row.at(kNew).at(at).get<double>()};
}

void weigh_scenes(const std::vector<SceneRow>& rows, const std::vector<MethodColumn>& columns,
                  Weighing& w) {
  for (const SceneRow& row : rows) {
    const RunFigures *a = nullptr, *b = nullptr;
    for (std::size_t m = 0; m < columns.size(); ++m) {
      if (columns[m].name == kOld) a = &row.runs[m];
      if (columns[m].name == kNew) b = &row.runs[m];
    }
    if (!a || !b) continue;
    const std::string what = std::string("deepest contact, ") + row.scene->name;
    if (a->moved_on() && b->moved_on())
      w.add(what, a->max_depth_voxels, b->max_depth_voxels, Good::low, 2);
    else
      w.add_words(what, cell(*a), cell(*b), b->moved_on() - a->moved_on());
  }
}

void weigh_force(const ordered_json& json, Weighing& w) {
  for (const auto& [scene, row] : json.items()) {
    const Both v = both(row);
    w.add("held up to, " + scene, v.old_value, v.new_value, Good::high, 1, "×");
  }
}

void weigh_sampling(const ordered_json& json, Weighing& w) {
  const Both failing = both(json.at("scenes_with_a_failure"));
  w.add("other samplings: scenes with a failure", failing.old_value, failing.new_value, Good::low,
        0);
  for (const auto& [scene, row] : json.at("scenes").items()) {
    const Both low = both(row, "/low"), high = both(row, "/high");
    w.add("spread of depth, " + scene, high.old_value - low.old_value,
          high.new_value - low.new_value, Good::low, 2);
  }
}

void weigh_stability(const ordered_json& json, Weighing& w) {
  for (const auto& [scene, settings] : json.items())
    for (const auto& [setting, row] : settings.items()) {
      const Both v = both(row);
      w.add("largest k, " + scene + ", " + setting, v.old_value, v.new_value, Good::high, 0);
    }
}

void weigh_paths(const ordered_json& json, Weighing& w) {
  for (const auto& [path, row] : json.items())
    for (const char* step : {"1ms", "0.1ms"}) {
      const Both v = both(row, (std::string("/") + step).c_str());
      w.add("force jump, " + path + ", " + step, v.old_value, v.new_value, Good::low, 4);
    }
}

void weigh_ripple(const ordered_json& json, Weighing& w) {
  for (const auto& [surface, row] : json.items()) {
    const Both force = both(row, "/force"), torque = both(row, "/torque");
    const Both mean = both(row, "/mean_force");
    w.add("force ripple over mean, " + surface, 1e3 * force.old_value / mean.old_value,
          1e3 * force.new_value / mean.new_value, Good::low, 2, " ‰");
    w.add("torque ripple over mean, " + surface, 1e3 * torque.old_value / mean.old_value,
          1e3 * torque.new_value / mean.new_value, Good::low, 2, " ‰");
  }
}

void weigh_net_stiffness(const ordered_json& json, Weighing& w) {
  Both most;
  for (const auto& [patch, row] : json.items()) {
    const Both v = both(row, "/derivative");
    most.most(v.old_value, v.new_value);
  }
  w.add("largest net stiffness, k", most.old_value, most.new_value, Good::low, 1);
}

void weigh_pushes(const ordered_json& json, Weighing& w) {
  for (const auto& [force, row] : json.items()) {
    const Both through = both(row, "/through"), deepest = both(row, "/greatest");
    w.add("alpha, " + force + ": through, of 20", through.old_value, through.new_value, Good::low,
          0);
    w.add("alpha, " + force + ": deepest", deepest.old_value, deepest.new_value, Good::low, 2);
  }
}

void weigh_share(const ordered_json& json, Weighing& w) {
  int held[2] = {};
  Both deepest;
  for (const auto& [share, row] : json.items()) {
    held[0] += row.at(kOld).at("verdict") == "held";
    held[1] += row.at(kNew).at("verdict") == "held";
    const Both v = both(row, "/final_depth_mm");
    deepest.most(v.old_value, v.new_value);
  }
  w.add("Fig. 7, shares held", held[0], held[1], Good::high, 0);
  w.add("Fig. 7, deepest of all shares", deepest.old_value, deepest.new_value, Good::low, 2);
}

void weigh_voxels(const ordered_json& json, Weighing& w) {
  int held[2] = {};
  for (const auto& [scene, voxels] : json.items())
    for (const auto& [voxel, row] : voxels.items()) {
      held[0] += row.at(kOld).at("verdict") == "held";
      held[1] += row.at(kNew).at("verdict") == "held";
    }
  w.add("thin parts in finer fields, held", held[0], held[1], Good::high, 0);
}

void weigh_energy(const ordered_json& json, Weighing& w) {
  for (const auto& [path, row] : json.items()) {
    const Both v = both(row);
    const bool cycle = path.rfind("cycle", 0) == 0;
    w.add("energy, " + path, cycle ? std::abs(v.old_value) : v.old_value,
          cycle ? std::abs(v.new_value) : v.new_value, Good::low, 3);
  }
}

void weigh_time(const ordered_json& json, Weighing& w) {
  for (const char* n : {"1000", "10000"}) {
    if (!json.contains(n) || !json[n].contains(kOld) || !json[n].contains(kNew)) continue;
    const Both weights = both(json[n], "/weights_us"), system = both(json[n], "/system_us");
    w.add(std::string("weights and system, n = ") + n, weights.old_value + system.old_value,
          weights.new_value + system.new_value, Good::low, 0, " µs");
  }
}

std::string listed(const std::vector<std::string>& words) {
  std::string out;
  for (const std::string& word : words) out += (out.empty() ? "" : "; ") + word;
  return out;
}

std::string verdict(const Weighing& w) {
  std::string out = "`series` is better in " + std::to_string(w.wins().size()) + ", the same in " +
                    std::to_string(w.same().size()) + ", worse in " +
                    std::to_string(w.losses().size()) + ".";
  if (w.losses().empty()) return out + " Nothing gets worse: it can be the default.";
  return out + " Worse: " + listed(w.losses()) +
         ".\n\n"
         "What speaks for `series`: its net stiffness has a bound that no sampling breaks; its "
         "derivatives are those of its force; it makes next to no energy in a closed cycle; its "
         "cost grows with the contacts and not with their square; thin parts, few contacts and the"
         " alpha's gap push back at less depth, so most scenes hold more force. What speaks "
         "against it: it is a joint solve, so noise in one depth moves load between points, which "
         "a hand feels as torque; where contacts conform all around, or face each other across a "
         "narrow gap, it goes deeper than a rule that stiffens with every new direction; in some "
         "scenes its depth varies more with the sampling; its force changes faster as contacts "
         "come and go; and at its bound of c k it leaves an explicit integrator less room on a "
         "flat contact, and an implicit one in a tight fit. All of these are small: `series` holds"
         " what `robust` holds, stays under half a voxel in the same scenes, and its implicit "
         "limits are at least fifty times the stiffness in use. But the default should change only"
         " when nothing gets worse, and something does. The default stays `robust`; one word in a "
         "scene selects `series`.";
}

}  // namespace

Study weigh_series(const std::vector<SceneRow>& rows, const std::vector<MethodColumn>& columns,
                   const std::vector<Study>& studies) {
  using Weigh = void (*)(const ordered_json&, Weighing&);
  const std::pair<const char*, Weigh> kinds[] = {{"push-harder", weigh_force},
                                                 {"resampling", weigh_sampling},
                                                 {"voxel-size", weigh_voxels},
                                                 {"plate-share", weigh_share},
                                                 {"alpha-pushes", weigh_pushes},
                                                 {"stability", weigh_stability},
                                                 {"smoothness", weigh_paths},
                                                 {"ripple", weigh_ripple},
                                                 {"net-stiffness", weigh_net_stiffness},
                                                 {"energy", weigh_energy},
                                                 {"time", weigh_time}};
  Weighing w;
  weigh_scenes(rows, columns, w);
  for (const auto& [name, weigh] : kinds)
    for (const Study& study : studies)
      if (study.name == name && !study.json.empty()) weigh(study.json, w);
  Study out;
  out.name = "series-beside-robust";
  out.title = "`series` beside `robust`";
  out.about =
      "Every figure above that differs between the two, and which of them is better. Figures "
      "within 2 % of each other, or that print alike, count as the same. Depths are in voxels "
      "(Fig. 7's shares in mm), forces in the units of the studies.";
  w.into(out);
  if (out.table.size() > 1) out.after = verdict(w);
  return out;
}

}  // namespace h6::cli
