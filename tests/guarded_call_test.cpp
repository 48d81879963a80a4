#include "base/guarded_call.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>

#include "base/archive.h"
#include "temp_folder.h"

namespace lumigrove {
namespace {

using Bytes = std::vector<std::uint8_t>;

TEST(GuardedCall, ReturnsWhatTheChildReturns) {
  const Bytes bytes = call_guarded("work", {}, [] { return Bytes(3'000'000, 7); });
  EXPECT_EQ(bytes, Bytes(3'000'000, 7));
  EXPECT_TRUE(call_guarded("work", {}, [] { return Bytes(); }).empty());
}

TEST(GuardedCall, PassesErrorsOnWithTheirSentence) {
  EXPECT_EQ(error_of([] { call_guarded("work", {}, []() -> Bytes { throw Error("a.obj: no faces"); }); }),
            "a.obj: no faces");
}

TEST(GuardedCall, TurnsCrashesIntoErrors) {
  EXPECT_EQ(error_of([] { call_guarded("the reader", {}, []() -> Bytes { abort(); }); }),
            "the reader crashed (signal 6)");
  EXPECT_EQ(error_of([] { call_guarded("the reader", {}, []() -> Bytes { _exit(1); }); }),
            "the reader crashed");
}

TEST(GuardedCall, EndsEndlessWork) {
  const GuardLimits limits{.cpu_seconds = 1};
  EXPECT_EQ(error_of([&] {
              call_guarded("the reader", limits, []() -> Bytes {
                volatile int i = 0;
                while (true) i = 1 - i;
              });
            }),
            "the reader did not come to an end");
}

TEST(GuardedCall, LimitsMemory) {
  const GuardLimits limits{.memory_bytes = std::size_t{1} << 28};
#if defined(__SANITIZE_ADDRESS__)
  GTEST_SKIP() << "AddressSanitizer ends the process itself when memory runs out";
#endif
  EXPECT_EQ(error_of([&] { call_guarded("the reader", limits, [] { return Bytes(std::size_t{1} << 30); }); }),
            "the reader ran out of memory");
}

TEST(GuardedCall, LeavesThisProcessUnchanged) {
  int value = 1;
  call_guarded("work", {}, [&] {
    value = 2;
    return Bytes();
  });
  EXPECT_EQ(value, 1);
}

TEST(Archive, RestoresNestedValues) {
  std::vector<std::string> texts = {"", "a", std::string("b\0c", 3)};
  std::vector<float> numbers = {1.5f, -2};
  ArchiveWriter writer;
  writer(texts, numbers);
  const Bytes bytes = writer.take();
  std::vector<std::string> texts_again;
  std::vector<float> numbers_again;
  ArchiveReader reader(bytes);
  reader(texts_again, numbers_again);
  EXPECT_EQ(texts_again, texts);
  EXPECT_EQ(numbers_again, numbers);
  EXPECT_TRUE(reader.at_end());
}

TEST(Archive, RefusesEveryTruncation) {
  std::vector<std::string> texts = {"first", "second"};
  ArchiveWriter writer;
  writer(texts);
  const Bytes bytes = writer.take();
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    std::vector<std::string> again;
    ArchiveReader reader(std::span<const std::uint8_t>(bytes).first(size));
    EXPECT_THROW(reader(again), Error) << size;
  }
}

}  // namespace
}  // namespace lumigrove
