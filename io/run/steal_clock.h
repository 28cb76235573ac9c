// SPDX-License-Identifier: Apache-2.0
// steal_clock.h - how long a hypervisor kept the cores of this machine from it.
#pragma once
#include <fstream>
#include <sstream>
#include <string>

namespace h6::cli {

// Milliseconds since the machine started, in steps of 10 ms, of one core or (core < 0) of all.
// Negative: the kernel does not tell. Always 0 on a machine that is not virtual, and on hypervisors
// that do not count.
inline double host_stole_ms(int core) {
  std::ifstream stat("/proc/stat");
  const std::string name = core < 0 ? "cpu" : "cpu" + std::to_string(core);
  for (std::string line; std::getline(stat, line);) {
    std::istringstream words(line);
    std::string first;
    double user, nice, system, idle, wait, irq, soft, steal;
    if (words >> first && first == name &&
        words >> user >> nice >> system >> idle >> wait >> irq >> soft >> steal)
      return 10 * steal;  // USER_HZ is 100 on every Linux that we build for
  }
  return -1;
}

}  // namespace h6::cli
