// SPDX-License-Identifier: Apache-2.0
// through_watch.h - keeps the motion of a run and then finds the first point that popped through.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hapsix/hapsix.h"
#include "io/file/progress.h"
#include "io/scene/load_scene.h"
#include "io/scene/pop_through.h"

namespace h6::cli {

// The first shell point that passed through an environment's mesh (io/scene/pop_through.h).
struct PopThrough {
  std::uint64_t frame = 0;  // in which its way out first lay behind the triangle
  double time = 0;          // of that frame [s]
  double free_time = 0;     // when it was free on the other side [s]
  std::string body, obstacle;
  std::uint32_t point = 0, triangle = 0;  // of the body's shell, of the obstacle's mesh
  std::string part;                       // of the obstacle's mesh; may be empty
  h6Vec3 place{};                         // of the crossing, world frame [m]
};

struct PopThroughReport {
  std::optional<PopThrough> first;
  std::vector<std::string> left_out;  // a sentence for each pair of bodies that was not judged
  bool interrupted = false;           // by the user; then no pair was judged
};

// Its memory is bounded: a motion that is too long is kept in longer steps.
class ThroughWatch {
 public:
  explicit ThroughWatch(const io::LoadedScene& loaded);
  void frame(const h6FrameRecord& record);
  PopThroughReport judge(const io::Progress& progress = {}) const;

 private:
  struct Moment {
    std::uint64_t frame;
    double time;
    h6Pose shell, field;  // of the bodies, in the world
  };
  // A shell that may meet a field. `hand` is -1 for a fixed body.
  struct Pair {
    std::size_t shell, field;  // bodies
    int shell_hand, field_hand;
    double voxel, step;  // [m]
    io::PopThroughSearch search;
    std::vector<Moment> moments;
  };
  enum class Moves { fixed, with_hand, alone };

  Moves moves(std::size_t body, int& hand) const;
  std::string not_computed(std::size_t shell, std::size_t field, const std::string& why) const;
  void add_pair(std::size_t shell, std::size_t field);
  Result<std::optional<PopThrough>> judge(Pair pair, const io::Progress& progress) const;

  const io::LoadedScene& loaded_;
  std::vector<Pair> pairs_;
  std::vector<std::string> left_out_;
};

// Tells a person about it in one sentence.
std::string sentence(const PopThrough& found);

}  // namespace h6::cli
