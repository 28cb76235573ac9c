// SPDX-License-Identifier: Apache-2.0
// hands.h - the devices of a scene's hands, by name.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "device/steering.h"
#include "hapsix/result.h"
#include "io/run/open_device.h"
#include "io/scene/load_scene.h"

namespace h6::cli {

// Devices and what they live in.
struct Hands {
  std::vector<h6Device> devices;
  std::vector<std::shared_ptr<void>> alive;
  std::string real_time;  // a device that lives on the machine's clock; empty: none
};

// Opens what `hands` names (open_device.h), one for each hand of the session, and tells the session
// their ratings. The device `arm` is in the mode of `def` and has the figures of `arm`.
// `hands` are the scene's, changed at will; their `def` must be what the session was made of.
// `steering` may take the first hand off its path.
Result<Hands> open_hands(const io::LoadedScene& loaded, const std::vector<io::SceneHand>& hands,
                         h6Session* session, std::shared_ptr<device::Steering> steering = nullptr);

}  // namespace h6::cli
