// SPDX-License-Identifier: Apache-2.0
// main.cpp - the main function of every test program that does not define its own.
#include <doctest/doctest.h>

#include <cstdio>

#include "tests/support/forced_target.h"

namespace {

// A filter that matches no test must fail, because the file that it names may have been renamed.
unsigned matching = 0;
struct CountMatches : doctest::IReporter {
  explicit CountMatches(const doctest::ContextOptions&) {}
  void report_query(const doctest::QueryData&) override { matching = 1; }
  void test_run_start() override {}
  void test_run_end(const doctest::TestRunStats& stats) override {
    matching = stats.numTestCasesPassingFilters;
  }
  void test_case_start(const doctest::TestCaseData&) override {}
  void test_case_reenter(const doctest::TestCaseData&) override {}
  void test_case_end(const doctest::CurrentTestCaseStats&) override {}
  void test_case_exception(const doctest::TestCaseException&) override {}
  void subcase_start(const doctest::SubcaseSignature&) override {}
  void subcase_end() override {}
  void log_assert(const doctest::AssertData&) override {}
  void log_message(const doctest::MessageData&) override {}
  void test_case_skipped(const doctest::TestCaseData&) override {}
};

}  // namespace

REGISTER_LISTENER("matches", 1, CountMatches);

int main(int argc, char** argv) {
  if (const int code = h6::test::force_target_or_exit_code()) return code;
  const int failed = doctest::Context(argc, argv).run();
  if (failed == 0 && matching == 0) {
    std::fprintf(stderr, "No test matches this filter.\n");
    return 1;
  }
  return failed;
}
