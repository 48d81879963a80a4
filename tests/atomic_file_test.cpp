#include "base/atomic_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "base/srgb.h"
#include "temp_folder.h"

namespace lumigrove {
namespace {

namespace fs = std::filesystem;

class AtomicFile : public testing::Test {
 protected:
  const TempFolder folder_;
};

TEST_F(AtomicFile, ReplacesTheFileAndLeavesNoTemporary) {
  const std::vector<std::uint8_t> first = {1, 2, 3}, second = {9, 8};
  write_file_atomically(folder_ / "a.bin", first);
  write_file_atomically(folder_ / "a.bin", second);
  std::ifstream in(folder_ / "a.bin", std::ios::binary);
  const std::vector<std::uint8_t> found{std::istreambuf_iterator<char>(in), {}};
  EXPECT_EQ(found, second);
  EXPECT_EQ(folder_.entries().size(), 1u);
}

TEST_F(AtomicFile, FailureNamesTheFileAndLeavesNothing) {
  const std::vector<std::uint8_t> bytes = {1};
  EXPECT_THROW(write_file_atomically(folder_ / "missing" / "a.bin", bytes), Error);
  fs::create_directories(folder_ / "taken" / "child");  // a folder cannot be replaced by a file
  try {
    write_file_atomically(folder_ / "taken", bytes);
    FAIL() << "replaced a folder";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("taken"), std::string::npos);
  }
  EXPECT_EQ(folder_.entries().size(), 1u);
}

TEST(Srgb, CurveAndItsInverseAgreeForAll8BitValues) {
  for (int i = 0; i < 256; ++i) {
    const float encoded = static_cast<float>(i) / 255;
    EXPECT_NEAR(linear_to_srgb(srgb_to_linear(encoded)), encoded, 2e-6);
  }
  EXPECT_NEAR(srgb_to_linear(0.5f), 0.21404, 1e-5);
}

}  // namespace
}  // namespace lumigrove
