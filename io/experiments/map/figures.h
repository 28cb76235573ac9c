// SPDX-License-Identifier: Apache-2.0
// figures.h - what the runs of a map say about a method: in one scene or in all of them.
#pragma once
#include "io/experiments/map/map.h"
#include "io/experiments/map/statistics.h"

namespace h6::cli {

inline constexpr double kGentlePush = 4;  // pushes up to this are counted apart from harder ones

// Kinds of runs. Each variation has one run of the first two kinds, and one of the last two.
enum MapGroup { kAtHalfVoxelForce, kAtSceneForce, kGentlyPushed, kHardPushed };
inline constexpr int kGroups = 4;

struct GroupFigures {
  std::size_t runs = 0, held = 0, chatters = 0, through = 0, unstable = 0, stuck = 0, failed = 0;
  std::size_t shallow = 0;  // held, and never deeper than half a voxel
  bool torque_noise = false;
  std::vector<double> depths;  // sorted [voxel]
};

// A method beside the first one, variation by variation: pairs are independent of each other.
struct PairFigures {
  // Of three forces a variation is held under more by this method, or under fewer.
  std::size_t pairs = 0, holds_more = 0, holds_fewer = 0;
  // The same; and where both hold as many, at the scene's force, this one is shallower or deeper
  // by more than 1 %.
  std::size_t better = 0, worse = 0;
  std::vector<double> depth_ratios;  // at the scene's force where both hold; sorted
};

// The scenes that have runs, and among them those with implicit steps.
std::vector<const MapScene*> run_scenes(const std::vector<MapScene>& scenes);
std::vector<const MapScene*> implicit_scenes(const std::vector<const MapScene*>& scenes);

GroupFigures group_figures(const std::vector<const MapScene*>& scenes, int table, MapGroup group,
                           std::size_t method);
PairFigures pair_figures(const std::vector<const MapScene*>& scenes, int table, std::size_t method);

// The verdict of an interval: whether it lies above a half (or a ratio of one), below it, or
// around.
enum class Sign { fewer, open, more };
Sign sign_of(std::size_t more, std::size_t fewer);
Sign sign_of_ratio(const std::vector<double>& ratios);

// The sentences that the figures support, such as that a method holds more than the first one. One
// that is not supported is absent.
std::vector<std::string> map_conclusions(const std::vector<MapScene>& scenes,
                                         const std::vector<MethodColumn>& methods);

}  // namespace h6::cli
