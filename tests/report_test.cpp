#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "bias_map.h"
#include "compand.h"
#include "html.h"
#include "page.h"
#include "pictures.h"
#include "plot.h"
#include "regions.h"
#include "report/report_fixtures.h"
#include "summary_tables.h"
#include "table.h"
#include "temp_folder.h"

namespace lumigrove {
namespace {

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

int count_of(const std::string& text, const std::string& part) {
  int count = 0;
  for (std::size_t at = text.find(part); at != text.npos; at = text.find(part, at + part.size())) ++count;
  return count;
}

// The names of elements that are closed by another than the last opened, or never; empty when the text is well-formed.
std::string malformed(const std::string& xml) {
  std::vector<std::string> open;
  for (std::size_t at = xml.find('<'); at != xml.npos; at = xml.find('<', at + 1)) {
    const std::size_t end = xml.find('>', at);
    if (end == xml.npos) return "an open tag";
    const std::string tag = xml.substr(at + 1, end - at - 1);
    if (tag.find('<') != tag.npos || std::count(tag.begin(), tag.end(), '"') % 2 != 0) return tag;
    const std::string name = tag.substr(0, tag.find_first_of(" \n/", 1));
    if (tag.back() == '/') continue;
    if (tag[0] != '/') {
      open.push_back(name);
    } else if (open.empty() || "/" + open.back() != tag) {
      return tag;
    } else {
      open.pop_back();
    }
  }
  return open.empty() ? "" : open.back();
}

Table two_rows() {
  Table table{"t", "A caption", {{"name", "name", "who", false}, {"value", "value", "how much", true, false}}, 0, {}};
  table.rows = {{{{"short"}, number_cell(2, "2.0", "+- 0.1", true)}, "a note"},
                {{{"rather long"}, {"-"}}},
                {{{"broken"}, {}}, {}, "nothing to show"}};
  return table;
}

// --- numbers -------------------------------------------------------------------------------------------------------

TEST(ReportNumbers, HaveSignificantDigitsAndUnits) {
  EXPECT_EQ(number_text(0.012345), "0.0123");
  EXPECT_EQ(number_text(1.5), "1.50");
  EXPECT_EQ(number_text(1234.4), "1,234");
  EXPECT_EQ(number_text(1e-7), "1.00e-07");
  EXPECT_EQ(number_text(0), "0");
  EXPECT_EQ(number_text(kNotMeasured), "-");
  EXPECT_EQ(seconds_text(0.0123), "12.3 ms");
  EXPECT_EQ(seconds_text(10), "10 s");
  EXPECT_EQ(seconds_text(200), "3 min 20 s");
  EXPECT_EQ(count_text(1234567), "1.23 M");
  EXPECT_EQ(count_text(950), "950");
  EXPECT_EQ(bytes_text(12'300'000), "12.3 MB");
}

TEST(ReportNumbers, Base64HasThePaddingOfTheStandard) {
  const std::vector<std::uint8_t> bytes = {'f', 'o', 'o', 'b', 'a', 'r'};
  const auto first = [&](std::size_t count) { return base64(std::span(bytes).first(count)); };
  EXPECT_EQ(first(0), "");
  EXPECT_EQ(first(1), "Zg==");
  EXPECT_EQ(first(2), "Zm8=");
  EXPECT_EQ(first(3), "Zm9v");
  EXPECT_EQ(first(6), "Zm9vYmFy");
}

// --- tables --------------------------------------------------------------------------------------------------------

TEST(ReportTable, AlignsTextLeftAndNumbersRight) {
  EXPECT_EQ(to_text(two_rows()),
            "A caption\n"
            "name             value\n"
            "short       2.0 +- 0.1\n"
            "a note\n"
            "rather long          -\n"
            "broken      nothing to show\n");
}

TEST(ReportTable, PrintsRowByRowWhatItPrintsAtOnce) {
  Table table = two_rows();
  table.columns[0].width = 20;
  table.columns[1].width = 12;
  const std::vector<int> widths = text_widths(table);
  std::string streamed = table.caption + "\n" + heading_text(table, widths);
  for (const Row& row : table.rows) streamed += row_text(table, row, widths);
  EXPECT_EQ(streamed, to_text(table));
}

TEST(ReportTable, IsARealTableInAPage) {
  const std::string html = to_html(two_rows());
  EXPECT_EQ(malformed(html), "");
  for (const char* part : {"<caption id=\"t-caption\">A caption</caption>", "scope=\"col\" aria-sort=\"none\"", "<th scope=\"row\">short",
                           "data-first=\"descending\"", "data-value=\"2\"", "± 0.1", "colspan=\"1\">nothing to show"})
    EXPECT_TRUE(contains(html, part)) << part << " in\n" << html;
  EXPECT_EQ(count_of(html, "data-value"), 1) << "what is no number has no value";
}

TEST(ReportTable, EscapesWhatPeopleWrote) {
  Table table = two_rows();
  table.caption = "a < b & \"c\"";
  table.rows[0].cells[0].text = "<script>";
  const std::string html = to_html(table);
  EXPECT_TRUE(contains(html, "a &lt; b &amp; &quot;c&quot;"));
  EXPECT_FALSE(contains(html, "<script>"));
}

TEST(ReportTable, GivesValuesAsJson) {
  const nlohmann::ordered_json json = to_json(two_rows());
  EXPECT_EQ(json[0]["name"], "short");
  EXPECT_EQ(json[0]["value"], 2);
  EXPECT_EQ(json[0]["note"], "a note");
  EXPECT_TRUE(json[1]["value"].is_null());
  EXPECT_EQ(json[2]["message"], "nothing to show");
}

TEST(ReportTable, ShowsBestMethodFirstAndFailuresLast) {
  const TempFolder folder;
  Results results = fixtures::still(folder.path());
  results.methods[0].failure = "it broke";
  std::erase_if(results.runs, [](const lumigrove::Run& run) { return run.method == 0; });
  const Table table = summary_table(results, Budget::kTime);
  ASSERT_EQ(table.rows.size(), 3u);
  EXPECT_EQ(table.rows[0].cells[1].text, "same");
  EXPECT_EQ(table.rows[1].cells[1].text, "red");
  EXPECT_EQ(table.rows[2].message, "it broke");
  EXPECT_EQ(table.rows[0].cells[0].text, "1");
  for (const Row& row : table.rows) EXPECT_EQ(row.cells.size(), table.columns.size());
  EXPECT_EQ(cost_table(results).rows.size(), 2u);
}

// --- plots ---------------------------------------------------------------------------------------------------------

TEST(ReportPlot, DrawsEverySeriesWithItsBandAndName) {
  const TempFolder folder;
  const Results results = fixtures::still(folder.path());
  for (const Budget against : kBudgets) {
    const Plot plot = convergence_plot(results, "all light", Measure::kRmse, against);
    ASSERT_EQ(plot.series.size(), 3u);
    const std::string svg = plot_svg(plot);
    EXPECT_EQ(malformed(svg), "");
    for (const char* name : fixtures::kMethodNames) {
      EXPECT_TRUE(contains(svg, fmt::format("data-series=\"{}\"", name)));
      EXPECT_TRUE(contains(svg, fmt::format(">{}</text>", name)));
    }
    EXPECT_EQ(count_of(svg, "class=\"band\""), 3);
    for (const char* part : {"role=\"img\"", "<title", "<desc", "class=\"rule\"", "class=\"guide\"", "class=\"floor\""})
      EXPECT_TRUE(contains(svg, part)) << part;
    EXPECT_FALSE(contains(svg, "nan"));
    EXPECT_FALSE(contains(svg, "inf"));
  }
}

TEST(ReportPlot, StandsAloneWithItsStyleAndLegend) {
  const TempFolder folder;
  const std::string svg = standalone_svg(convergence_plot(fixtures::still(folder.path()), "all light", Measure::kRelMse, Budget::kTime));
  EXPECT_EQ(malformed(svg), "");
  EXPECT_TRUE(contains(svg, "xmlns=\"http://www.w3.org/2000/svg\""));
  EXPECT_TRUE(contains(svg, "prefers-color-scheme:dark"));
  EXPECT_EQ(count_of(svg, ">dark</text>"), 2) << "at the line and in the legend";
}

TEST(ReportPlot, KeepsNamesApart) {
  Plot plot;
  plot.key = "p";
  for (int i = 0; i < 9; ++i) plot.series.push_back({fmt::format("m{}", i), i, {{1, 1}, {10, 0.1 * (1 + 1e-3 * i)}}});
  const std::string svg = plot_svg(plot);
  std::vector<double> heights;
  for (int i = 0; i < 9; ++i) {
    const std::size_t end = svg.find(fmt::format("\">m{}</text>", i));
    ASSERT_NE(end, svg.npos);
    heights.push_back(std::stod(svg.substr(svg.rfind("y=\"", end) + 3)));
  }
  std::sort(heights.begin(), heights.end());
  for (std::size_t i = 1; i < heights.size(); ++i) EXPECT_GE(heights[i] - heights[i - 1], 13.5);
}

TEST(ReportPlot, TakesWhatCannotBeDrawn) {
  Plot plot;
  plot.key = "p";
  plot.floor = 0;
  plot.series = {{"empty", 0, {}}, {"bad", 1, {{0, 1}, {1, kNotMeasured}, {1, -1}}}, {"one", 2, {{1, 1, -1, 3}}}};
  const std::string svg = plot_svg(plot);
  EXPECT_EQ(malformed(svg), "");
  EXPECT_FALSE(contains(svg, "nan"));
}

// --- pictures ------------------------------------------------------------------------------------------------------

TEST(ReportPictures, CompandingKeepsAWideRange) {
  for (const float gain : {0.25f, 1.0f, 8.0f})
    for (float value = 0.01f / gain; value < 60 / gain; value *= 1.1f) {
      const float back = expand(compand(value, gain), gain);
      const float step = expand(static_cast<std::uint8_t>(compand(value, gain) + 1), gain) - back;
      EXPECT_NEAR(back, value, 0.55f * std::abs(step) + 1e-5f) << value;
    }
  EXPECT_EQ(compand(0, 1), 0);
  EXPECT_EQ(compand(-1, 1), 0);
  EXPECT_EQ(compand(std::nanf(""), 1), 0);
  EXPECT_EQ(compand(HUGE_VALF, 1), 255);
  EXPECT_EQ(expand(0, 1), 0);
}

TEST(ReportPictures, JpegKeepsColoursOfSinglePixels) {
  Picture picture{64, 64, 3, {}};
  for (int i = 0; i < 64 * 64; ++i)
    for (const int c : {0, 1, 2}) picture.pixels.push_back((i + i / 64) % 2 == (c == 0 ? 0 : 1) ? 220 : 30);
  const EncodedPicture jpeg = encode_picture(picture, {92, 1});
  EXPECT_STREQ(jpeg.type, "image/jpeg");
  ASSERT_GE(jpeg.bytes.size(), 4u);
  EXPECT_EQ(jpeg.bytes[0], 0xff);
  EXPECT_EQ(jpeg.bytes[1], 0xd8);
  // Start of frame: sampling factors 1x1 of all three components say 4:4:4.
  for (std::size_t at = 2; at + 19 < jpeg.bytes.size(); ++at)
    if (jpeg.bytes[at] == 0xff && (jpeg.bytes[at + 1] == 0xc0 || jpeg.bytes[at + 1] == 0xc2)) {
      for (const std::size_t component : {0u, 1u, 2u}) EXPECT_EQ(jpeg.bytes[at + 11 + 3 * component], 0x11);
      return;
    }
  FAIL() << "no start of frame";
}

TEST(ReportPictures, ReducesByMeans) {
  const Picture picture{3, 1, 1, {10, 20, 200}};
  const Picture half = reduced(picture, 2);
  EXPECT_EQ(half.width, 2);
  EXPECT_EQ(half.pixels, (std::vector<std::uint8_t>{15, 200}));
}

TEST(ReportPictures, FitTheirLimit) {
  std::mt19937 random(1);
  Picture noise{200, 100, 3, {}};
  for (int i = 0; i < 3 * 200 * 100; ++i) noise.pixels.push_back(static_cast<std::uint8_t>(random()));
  const std::vector<Picture> pictures(4, noise);
  std::size_t before = std::numeric_limits<std::size_t>::max();
  for (const std::size_t limit : {400'000u, 150'000u, 40'000u, 8'000u}) {
    const EncodedPictures encoded = encode_within(pictures, limit);
    ASSERT_EQ(encoded.pictures.size(), 4u) << limit;
    EXPECT_LE(encoded.bytes, limit);
    EXPECT_LT(encoded.bytes, before);
    before = encoded.bytes;
  }
  EXPECT_EQ(encode_within(pictures, 400'000).encoding.quality, 0) << "PNG when it fits";
  EXPECT_TRUE(encode_within(pictures, 10).pictures.empty());
}

// --- regions and bias ----------------------------------------------------------------------------------------------

TEST(ReportRegions, FindsTheWorstAndTheMostDifferentSquare) {
  constexpr int kWidth = 320, kHeight = 160;
  std::vector<std::vector<float>> maps(2, std::vector<float>(kWidth * kHeight, 0.1f));
  const auto paint = [&](std::size_t map, int x0, int y0, float value) {
    for (int y = y0; y < y0 + 32; ++y)
      for (int x = x0; x < x0 + 32; ++x) maps[map][static_cast<std::size_t>(y * kWidth + x)] = value;
  };
  paint(0, 64, 32, 0.9f);
  paint(1, 64, 32, 0.9f);
  paint(0, 200, 96, 0.5f);
  const std::vector<Region> regions = find_regions(maps, kWidth, kHeight, 1);
  ASSERT_EQ(regions.size(), 2u);
  EXPECT_EQ(regions[0].x, 64);
  EXPECT_EQ(regions[0].y, 32);
  EXPECT_NEAR(regions[0].flip[0], 0.9, 1e-5);
  EXPECT_EQ(regions[1].x, 200);
  EXPECT_EQ(regions[1].y, 96);
  EXPECT_NEAR(regions[1].flip[0] - regions[1].flip[1], 0.4, 1e-5);
  EXPECT_TRUE(find_regions({}, kWidth, kHeight, 4).empty());
}

TEST(ReportRegions, DoNotOverlap) {
  std::mt19937 random(2);
  std::vector<float> map(200 * 100);
  for (float& value : map) value = static_cast<float>(random() % 1000) / 1000;
  const std::vector<Region> regions = find_regions({map}, 200, 100, 4);
  ASSERT_EQ(regions.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < i; ++j)
      EXPECT_TRUE(std::abs(regions[i].x - regions[j].x) >= 20 || std::abs(regions[i].y - regions[j].y) >= 20);
}

// Means of `count` seeds, around 1 in the left half and 1 + bias in the right one.
std::vector<BlockMeans> noisy_means(int count, double bias) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0, 0.1);
  std::vector<BlockMeans> seeds;
  for (int s = 0; s < count; ++s) {
    BlockMeans means{40, 20, {}};
    for (int i = 0; i < 800; ++i) means.values.push_back(1 + normal(random) + (i % 40 < 20 ? 0 : bias));
    seeds.push_back(std::move(means));
  }
  return seeds;
}

TEST(ReportBias, ColoursAboutOneBlockInTwentyByChanceAndMostBiasedOnes) {
  const BlockMeans reference{40, 20, std::vector<double>(800, 1)};
  const std::vector<double> bias = bias_of(noisy_means(8, 0.3), reference, kNotMeasured);
  int left = 0, right = 0;
  for (std::size_t i = 0; i < bias.size(); ++i) (i % 40 < 20 ? left : right) += bias[i] != 0;
  EXPECT_GE(left, 6);   // of 400, 20 expected; binomial bounds of 1e-4
  EXPECT_LE(left, 40);
  EXPECT_GT(right, 390);
}

TEST(ReportBias, CountsTheNoiseOfTheReference) {
  const BlockMeans reference{40, 20, std::vector<double>(800, 1)};
  // Blocks of the reference off by 0.3 with a standard error of as much say nothing.
  const double rel_mse = std::pow(0.3 * kBiasBlock, 2) / 1.01;
  const std::vector<double> bias = bias_of(noisy_means(8, 0.3), reference, rel_mse);
  EXPECT_EQ(std::count_if(bias.begin(), bias.end(), [](double value) { return value != 0; }), 0);
}

TEST(ReportBias, HasCodesForNothingAndForFaintBias) {
  const std::vector<std::uint8_t> codes = bias_codes({kNotMeasured, 0, 1e-9, -1e-9, 0.1, -5}, 0.1);
  EXPECT_EQ(codes, (std::vector<std::uint8_t>{0, 128, 129, 127, 255, 1}));
  EXPECT_EQ(bias_scale({0.004, -0.003}), 0.01);
  EXPECT_EQ(bias_scale({0.3, kNotMeasured}), 0.5);
}

// --- files ---------------------------------------------------------------------------------------------------------

TEST(ReportResults, SurviveAFile) {
  const TempFolder folder;
  Results written = fixtures::sequence(folder.path());
  written.runs[0].stages[0].errors[2] = kNotMeasured;
  written.references[0].errors = kNoErrors;
  write_results(written, folder.path());
  const Results read = read_results(folder.path());
  EXPECT_EQ(read.scene, written.scene);
  EXPECT_EQ(read.frames, written.frames);
  ASSERT_EQ(read.runs.size(), written.runs.size());
  EXPECT_TRUE(std::isnan(read.runs[0].stages[0].errors[2]));
  EXPECT_EQ(read.runs[0].stages[0].errors[0], written.runs[0].stages[0].errors[0]);
  EXPECT_EQ(read.runs[3].stages[1].file, written.runs[3].stages[1].file);
  EXPECT_EQ(read.methods[2].why, written.methods[2].why);
  EXPECT_TRUE(std::isnan(read.references[0].errors[0]));
  ASSERT_EQ(read.changes.size(), written.changes.size());
  EXPECT_EQ(read.changes[1].budget, Budget::kSamples);
  // What is written again is the same, bit for bit.
  const std::string first = read_text(folder / "results.json");
  write_results(read, folder.path());
  EXPECT_EQ(read_text(folder / "results.json"), first);
}

TEST(ReportPage, HoldsEverythingInItself) {
  const TempFolder folder;
  write_report(fixtures::still(folder.path()), folder.path());
  std::string page = read_text(folder / "report.html");
  for (const char* reference : {"http://", "https://", "src=", "@import", "<link", "url(\"", "url('"})
    EXPECT_FALSE(contains(page, reference)) << reference;
  EXPECT_EQ(count_of(page, "url("), count_of(page, "url(#"));
  EXPECT_TRUE(contains(page, "scene &lt;of&gt; &quot;tests&quot; &amp; co"));
  for (const char* part : {"it paints everything red", "0123456789abcdef", "PNG", "lumigrove render scene.glb --preset red --spp 4"})
    EXPECT_TRUE(contains(page, part)) << part;
}

TEST(ReportPage, KeepsItsSizeWithNoise) {
  const TempFolder folder;
  Results results = fixtures::still(folder.path());
  std::mt19937 random(4);
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    Image image{fixtures::kWidth, fixtures::kHeight, {{"", {"R", "G", "B"}, {}, {}}}, {}};
    for (int i = 0; i < 3 * fixtures::kWidth * fixtures::kHeight; ++i)
      image.layers[0].values.push_back(static_cast<float>(random() % 4096) / 1024);
    write_image(image, entry.path());
  }
  for (const std::size_t limit : {600'000u, 300'000u}) {
    write_report(results, folder.path(), limit);
    EXPECT_LE(std::filesystem::file_size(folder / "report.html"), limit);
    EXPECT_TRUE(contains(read_text(folder / "report.html"), "id=\"picture-12\"")) << "7 pictures and 6 FLIP maps";
  }
}

TEST(ReportPage, SaysWhatIsMissing) {
  const TempFolder folder;
  write_report(fixtures::partial(folder.path()), folder.path());
  const std::string page = read_text(folder / "report.html");
  EXPECT_TRUE(contains(page, "dark-0-0-samples.exr is missing"));
  EXPECT_TRUE(contains(page, "it needs a light that the scene does not have"));
  EXPECT_TRUE(contains(page, "has not reached equal time"));
  EXPECT_TRUE(contains(page, "at least two seeds"));
}

TEST(ReportPage, ShowsOneTableToo) {
  const TempFolder folder;
  write_table_page(folder / "table.html", "Title", "One & two.", two_rows());
  const std::string page = read_text(folder / "table.html");
  EXPECT_TRUE(contains(page, "<title>Title</title>"));
  EXPECT_TRUE(contains(page, "One &amp; two."));
  EXPECT_TRUE(contains(page, "rather long"));
}

}  // namespace
}  // namespace lumigrove
