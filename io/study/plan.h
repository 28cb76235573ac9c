// SPDX-License-Identifier: Apache-2.0
// plan.h - STUDY.json: a scene or several, the settings that vary, and what is drawn at random; one
// scene a run.
//
//   { "hapsix_study": 1, "scene": "peg-in-hole",
//     "vary":    { "contact.method": ["firm", "global"],
//                  "bodies.block.field.offset": { "from": 0, "to": 0.4, "count": 5 } },
//     "draw":    { "bodies.peg.pose.p.x": { "low": -0.2, "high": 0.2 } },
//     "repeats": 20, "seed": 1 }
//
// A key is the way to a setting of the scene file, its words joined by dots; bodies go by their
// name, hands by their body or number, members of a vector by x, y, z, w or number. Values are in
// the scene's unit. Every combination of `vary` runs `repeats` times; repeat r has the same draws
// in each of them. "scene" may be a list: then each scene has all of these runs, and every key must
// be one of each scene.
#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "hapsix/result.h"
#include "io/scene/scene.h"

namespace h6::study {

class Plan {
 public:
  // Reads a study. A generated scene is exported to `folder`/scenes/NAME first, unless it stands
  // there. Every value is checked in one run of each scene; the sentence of a mistake names the key
  // and that run.
  static Result<Plan> read(const std::filesystem::path& file, const std::filesystem::path& folder,
                           bool outside);
  Plan(Plan&&) noexcept;
  Plan& operator=(Plan&&) noexcept;
  ~Plan();

  std::size_t runs() const;
  // "scene" where there is a list, then those of `vary`, then of `draw`.
  const std::vector<std::string>& keys() const;
  Result<io::Scene> scene(std::size_t run) const;
  std::vector<std::string> values(std::size_t run) const;  // one for each key, as JSON
  std::size_t repeat(std::size_t run) const;
  const std::filesystem::path& scene_file(std::size_t run) const;  // also of a generated scene
  std::vector<std::filesystem::path> scene_files() const;          // of each scene, in their order
  double unit(std::size_t run) const;  // metres in the scene's unit of length
  // All that decides what the runs give: study, scenes, content of their files, version.
  const std::string& identity() const;

 private:
  struct Parts;
  explicit Plan(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace h6::study
