#include "../bench/reproduce.h"

#include <gtest/gtest.h>

#include <cmath>

namespace lumigrove::bench {
namespace {

Relation relation(double ours, double error, std::optional<double> at_least, std::optional<double> at_most) {
  return {6, "colonnade", "RMSE sst / slc", "0.79", ours, error, at_least, at_most};
}

TEST(Reproduction, HoldsWithinItsLimits) {
  EXPECT_EQ(relation(0.9, 0, {}, 1).verdict(), Verdict::kHolds);
  EXPECT_EQ(relation(1, 0, {}, 1).verdict(), Verdict::kHolds);
  EXPECT_EQ(relation(1.1, 0, {}, 1).verdict(), Verdict::kFails);
  EXPECT_EQ(relation(1.1, 0, 1, {}).verdict(), Verdict::kHolds);
  EXPECT_EQ(relation(0.9, 0, 1, {}).verdict(), Verdict::kFails);
  EXPECT_EQ(relation(1.05, 0, 0.88, 1.12).verdict(), Verdict::kHolds);
  EXPECT_EQ(relation(1.2, 0, 0.88, 1.12).verdict(), Verdict::kFails);
}

TEST(Reproduction, CallsNoiseNoise) {
  EXPECT_EQ(relation(1.02, 0.01, {}, 1).verdict(), Verdict::kWithinError);
  EXPECT_EQ(relation(1.04, 0.01, {}, 1).verdict(), Verdict::kFails);
  EXPECT_EQ(relation(0.98, 0.01, 1, 1).verdict(), Verdict::kWithinError);
  EXPECT_EQ(relation(0.96, 0.01, 1, 1).verdict(), Verdict::kFails);
}

TEST(Reproduction, NeverHoldsForWhatIsNoNumber) {
  EXPECT_EQ(relation(std::nan(""), 0, {}, 1).verdict(), Verdict::kFails);
  EXPECT_EQ(relation(1, std::nan(""), {}, 0).verdict(), Verdict::kFails);
  EXPECT_EQ(relation(HUGE_VAL, 0, 1, {}).verdict(), Verdict::kFails);
}

TEST(Reproduction, ReportsNumbersWithoutLimits) {
  EXPECT_EQ(relation(3, 0, {}, {}).verdict(), Verdict::kReported);
  EXPECT_EQ(count_verdicts({relation(3, 0, {}, {}), relation(3, 0, {}, 1), relation(3, 0, 1, {})}, Verdict::kHolds), 1);
}

TEST(Reproduction, PrintsOneLineARelationAndItsNoteBelow) {
  Relation r = relation(0.8517, 0.004, {}, 1);
  r.note = "RMSE 0.1 and 0.12";
  const Table table = relation_table();
  const std::string text = row_text(table, relation_row(r), text_widths(table));
  for (const char* part : {"6 ", "colonnade", "RMSE sst / slc", "0.79", "0.8517 +- 0.004", "<= 1", "holds"})
    EXPECT_NE(text.find(part), text.npos) << part << " in\n" << text;
  EXPECT_GT(text.find("RMSE 0.1 and 0.12"), text.find('\n'));
  EXPECT_EQ(limit_text(relation(1, 0, 0.88, 1.12)), "0.88 to 1.12");
  EXPECT_EQ(limit_text(relation(1, 0, 1, 1)), "1");
}

TEST(Reproduction, WritesLimitsAndVerdictAsJson) {
  const nlohmann::ordered_json json = to_json(relation(1.5, 0.25, {}, 1));
  EXPECT_EQ(json["check"], 6);
  EXPECT_EQ(json["ours"], 1.5);
  EXPECT_EQ(json["error"], 0.25);
  EXPECT_EQ(json["at_most"], 1);
  EXPECT_FALSE(json.contains("at_least"));
  EXPECT_EQ(json["verdict"], "within error");
}

}  // namespace
}  // namespace lumigrove::bench
