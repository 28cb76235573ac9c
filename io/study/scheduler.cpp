// SPDX-License-Identifier: Apache-2.0
#include "io/study/scheduler.h"

#include <filesystem>

#include "hapsix/hapsix.h"
#include "io/study/cluster.h"

namespace h6::study {

void use_scheduler(const std::string& address, const std::vector<std::string>& job, Work& work) {
  // "hapsix 0.1.0" of "hapsix 0.1.0, 12.2.0, SIMD AVX3 AVX2", and "AVX3".
  const std::string info = h6BuildInfo(), simd = info.substr(info.find("SIMD ") + 5);
  std::error_code error;
  work.program = "python3";
  work.command = {"python3",
                  "-c",
                  kClusterProgram,
                  address,
                  std::filesystem::read_symlink("/proc/self/exe", error).string(),
                  info.substr(0, info.find(',')),
                  simd.substr(0, simd.find(' '))};
  work.command.insert(work.command.end(), job.begin(), job.end());
  work.processes = 1;
  work.ahead = 4096;  // their numbers fit into a pipe; the scheduler knows what each worker has
}

}  // namespace h6::study
