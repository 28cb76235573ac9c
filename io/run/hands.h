// SPDX-License-Identifier: Apache-2.0
// hands.h - opens the devices of a scene's hands.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "device/steering.h"
#include "hapsix/result.h"
#include "io/run/open_device.h"
#include "io/scene/load_scene.h"

namespace h6::cli {

// The devices of a run and the objects that own them.
struct Hands {
  std::vector<h6Device> devices;
  std::vector<std::shared_ptr<void>> alive;
  std::string real_time;  // name of a device that follows the machine's clock; empty if none does
};

// Opens the device that each of `hands` names (open_device.h) and tells the session its ratings.
// The device `arm` takes its mode from `def` and its figures from `arm`. `hands` may differ from
// the scene's, but each `def` must be the one that the session was made with. `steering` may take
// the first hand off its path.
Result<Hands> open_hands(const io::LoadedScene& loaded, const std::vector<io::SceneHand>& hands,
                         h6Session* session, std::shared_ptr<device::Steering> steering = nullptr);

}  // namespace h6::cli
