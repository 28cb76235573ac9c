// SPDX-License-Identifier: Apache-2.0
// page.cpp - HAPSIX_PAGES is the folder with live.html, pick.html and report.html. The assembler
// copies the files: as a C++ array they would take seconds to compile.
#include "io/view/page.h"

#define H6_PAGE(name, file)              \
  __asm__(                               \
      ".section .rodata\n"               \
      ".global h6_page_" #name           \
      "\n"                               \
      "h6_page_" #name                   \
      ":\n"                              \
      ".incbin \"" HAPSIX_PAGES "/" file \
      "\"\n"                             \
      ".global h6_page_" #name           \
      "_end\n"                           \
      "h6_page_" #name                   \
      "_end:\n"                          \
      ".byte 0\n"                        \
      ".previous\n");                    \
  extern "C" const char h6_page_##name[], h6_page_##name##_end[];

H6_PAGE(live, "live.html")
H6_PAGE(pick, "pick.html")
H6_PAGE(report, "report.html")

namespace h6::io::view {

std::string_view live_page() {
  return {h6_page_live, static_cast<std::size_t>(h6_page_live_end - h6_page_live)};
}
std::string_view pick_page() {
  return {h6_page_pick, static_cast<std::size_t>(h6_page_pick_end - h6_page_pick)};
}
std::string_view report_page() {
  return {h6_page_report, static_cast<std::size_t>(h6_page_report_end - h6_page_report)};
}
std::string no_page() {
  return "this build has no view: install node and npm (Debian: nodejs npm), then build again "
         "('./dev demo' does both)";
}

}  // namespace h6::io::view
