// SPDX-License-Identifier: Apache-2.0
// browser.h - shows the user's browser the way to the view.
//
// The address has the token, and every user of the machine can read a command line. So the browser
// gets a file that only this user can read, and the file leads to the address.
#pragma once
#include <string>

namespace h6::io::view {

class Browser {
 public:
  Browser() = default;
  ~Browser();  // removes the file; the browser stays
  Browser(const Browser&) = delete;
  Browser& operator=(const Browser&) = delete;

  // Opens the user's browser, which outlives this program and inherits no open file of it. False
  // when there is no screen, or when the file cannot be written.
  bool open(const std::string& address);

 private:
  std::string file_;
};

}  // namespace h6::io::view
