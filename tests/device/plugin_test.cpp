// SPDX-License-Identifier: Apache-2.0
// plugin_test.cpp - devices from shared libraries: the template, and every way to fail.
#include <doctest/doctest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "device/plugin.h"
#include "tests/support/near.h"

using namespace h6;
using namespace h6::device;
using h6::test::near;

namespace {

const h6Pose home{{0.1, 0.2, 0.3}, {0.6, 0, 0.8, 0}};

std::string in(const std::string& name) { return HAPSIX_PLUGIN_FOLDER "/" + name + ".so"; }

std::string sentence(const std::string& name, double patience = 10) {
  auto opened = PluginDevice::open({in(name), {}}, home, {}, patience);
  CHECK_MESSAGE(!opened, name);
  return opened ? "" : opened.error();
}
bool says(const std::string& text, const std::string& part) {
  const bool found = text.find(part) != std::string::npos;
  CHECK_MESSAGE(found, "'", text, "' lacks '", part, "'");
  return found;
}

}  // namespace

TEST_CASE("the template is opened where the body begins, yields to a force, and springs back") {
  auto opened = PluginDevice::open({in("template_device"), {{"stiffness", "200"}}}, home, {});
  REQUIRE_MESSAGE(opened, (opened ? "" : opened.error()));
  h6Device d = (*opened)->device();
  CHECK(std::string(d.capabilities.name) == "a handle on a spring");
  CHECK(d.capabilities.max_force == 10);
  CHECK((*opened)->about().find("stiffness") != std::string::npos);
  h6DeviceSample s{};
  CHECK(d.read(d.self, 0, &s) == 0);
  CHECK(s.pose.p.x == home.p.x);
  CHECK(s.pose.q.y == home.q.y);
  h6DeviceCommand c{};
  c.wrench.force.z = 4;  // 4 N against 200 N/m: 20 mm
  CHECK(d.write(d.self, 0, &c) == 0);
  for (int i = 1; i <= 3000; ++i) CHECK(d.read(d.self, 1e-3 * i, &s) == 0);
  CHECK(s.pose.p.z == near(home.p.z + 0.02).epsilon(1e-3));
  d.stop(d.self);  // no force from now on, for any command
  CHECK(d.write(d.self, 3, &c) == 0);
  for (int i = 3001; i <= 6000; ++i) CHECK(d.read(d.self, 1e-3 * i, &s) == 0);
  CHECK(s.pose.p.z == near(home.p.z).epsilon(1e-3));
  CHECK((*opened)->arm() == 0);
  for (int i = 6001; i <= 9000; ++i) CHECK(d.read(d.self, 1e-3 * i, &s) == 0);
  CHECK(s.pose.p.z == near(home.p.z + 0.02).epsilon(1e-3));
}

TEST_CASE("the template has less than 80 lines, and its own build line builds it") {
  const std::string file = HAPSIX_SOURCE_DIR "/device/plugins/template_device.c";
  std::ifstream text(file);
  int lines = 0;
  std::string command;
  for (std::string line; std::getline(text, line); ++lines)
    if (const std::size_t at = line.find("cc -shared"); at != std::string::npos)
      command = line.substr(at);
  CHECK(lines < 80);
  REQUIRE(!command.empty());
  const std::string out =
      (std::filesystem::temp_directory_path() / "hapsix-template-XXXXXX").string();
  std::vector<char> name(out.begin(), out.end());
  name.push_back('\0');
  REQUIRE(mkdtemp(name.data()) != nullptr);
  const std::string built = std::string(name.data()) + "/template.so";
  command.replace(command.find("template.so"), 11, built);
  if (std::system("command -v cc >/dev/null") != 0) {
    MESSAGE("skipped: no cc");
    return;
  }
  CHECK(std::system(("cd " HAPSIX_SOURCE_DIR " && " + command + " -Wall -Werror").c_str()) == 0);
  CHECK(PluginDevice::open({built, {}}, home, {}));
  std::filesystem::remove_all(name.data());
}

TEST_CASE("a file that is no plug-in, or one for another version, is refused with the reason") {
  says(sentence("absent"), "there is no such file");
  says(sentence("bad_symbol"), "h6_device_plugin_v1");
  says(sentence("bad_abi"), "is for version 7");
  says(sentence("bad_size"), "another device_plugin.h");
  says(sentence("bad_no_read"), "lacks one of");
  auto text = PluginDevice::open({HAPSIX_SOURCE_DIR "/README.md", {}}, home, {});
  REQUIRE(!text);
  says(text.error(), "cannot be loaded");
}

TEST_CASE("an open that crashes, ends the process or hangs costs a sentence and nothing else") {
  says(sentence("bad_crash"), "while it was opened");
  says(sentence("bad_leaves"), "exit code 7");
  says(sentence("bad_hang", 0.3), "did not end within 0.3 s");
  says(sentence("bad_asleep", 0.3), "did not end within 0.3 s");
}

TEST_CASE("a plug-in that hangs when it is opened again is left alone after its time") {
  const std::string mark = std::filesystem::temp_directory_path() / "hapsix-opened-once";
  std::filesystem::remove(mark);
  const auto opened = PluginDevice::open({in("bad_again"), {{"mark", mark}}}, home, {}, 0.3);
  std::filesystem::remove(mark);
  REQUIRE(!opened);
  says(opened.error(), "the second time");
}

TEST_CASE(
    "a failed open is quoted, cut to what fits; one that gives no reason is reported as such") {
  says(sentence("bad_refuses"), "the cable is not plugged in");
  CHECK(sentence("bad_refuses").size() < 600);
  says(sentence("bad_silent"), "did not say why");
  auto option = PluginDevice::open({in("template_device"), {{"colour", "red"}}}, home, {});
  REQUIRE(!option);
  says(option.error(), "the only option is stiffness");
}

TEST_CASE("ratings and modes that make no sense are refused by name") {
  says(sentence("bad_modes"), "modes");
  says(sentence("bad_rating"), "ratings");
}
