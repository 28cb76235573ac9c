// SPDX-License-Identifier: Apache-2.0
// Holds the text of device/udev/70-hapsix.rules, for users who have only the program. A test
// compares them.
#include "device/hid_port.h"

namespace h6::device {

const char* udev_rules() {
  return R"(# SPDX-License-Identifier: Apache-2.0
# The person who sits at this machine may use its 3Dconnexion devices.
KERNEL=="hidraw*", ATTRS{idVendor}=="256f", TAG+="uaccess"
KERNEL=="hidraw*", ATTRS{idVendor}=="046d", ATTRS{idProduct}=="c603|c605|c606|c621|c623|c625|c626|c627|c628|c629|c62b", TAG+="uaccess"
# Over Bluetooth there is no USB device above them.
KERNEL=="hidraw*", KERNELS=="*:256F:*", TAG+="uaccess"
)";
}

}  // namespace h6::device
