// The tool as its users meet it, inside the tests' own process: starting one loads some 250 libraries.
#pragma once

#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "temp_folder.h"
#include "tool.h"

namespace lumigrove {

struct Outcome {
  int status = -1;  // exit status
  std::string out, err;
};

// `lumigrove ARGUMENTS` in a folder.
inline Outcome run_tool_in(const std::filesystem::path& folder, const std::vector<std::string>& arguments) {
  std::vector<std::string> words{"lumigrove"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  const std::filesystem::path before = std::filesystem::current_path();
  std::filesystem::current_path(folder);
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  Outcome outcome;
  outcome.status = run_tool(static_cast<int>(words.size()), pointers.data());
  std::fflush(nullptr);
  outcome.err = ::testing::internal::GetCapturedStderr();
  outcome.out = ::testing::internal::GetCapturedStdout();
  std::filesystem::current_path(before);
  return outcome;
}

// Every test works in an empty folder of its own.
class ToolTest : public ::testing::Test {
 protected:
  Outcome run(const std::vector<std::string>& arguments) const { return run_tool_in(folder_.path(), arguments); }

  const TempFolder folder_;
};

}  // namespace lumigrove
