// Checks 12 and 13 of the reproduction of real-time stochastic lightcuts: what cuts gain and cost.
#include <cmath>

#include "bench.h"
#include "rtslc_checks.h"
#include "rtslc_study.h"

namespace lumigrove::bench {
namespace {

constexpr int kCutImages = 8;

std::string value_text(double value) { return fmt::format("{:.2f}", value); }

// A relation of two entries: missing when either is.
struct PairReport {
  int check;
  const Subject& subject;
  Variant variant;
  const Report& report;

  template <class Value>
  void add(const std::string& what, const std::string& published, const Measured& a, const Measured& b,
           const Value& value, std::optional<double> at_least, std::optional<double> at_most,
           const std::string& more = "") const {
    const std::string title = fmt::format("{} ({})", what, variant_name(variant));
    for (const Measured* side : {&a, &b})
      if (!side->ok()) {
        report(missing_relation(check, subject.scene, title, published, side->missing));
        return;
      }
    const Estimate ours = value();
    std::string note = fmt::format("{}: {}; {}: {}", a.entry.method.name, measured_text(a),
                                   b.entry.method.name, measured_text(b));
    if (!more.empty()) note += "; " + more;
    report({check, subject.scene, title, published, ours.value, ours.error, at_least, at_most, note});
  }

  void mse(const std::string& what, const std::string& published, const Measured& a, const Measured& b,
           std::optional<double> at_least, std::optional<double> at_most,
           const std::string& more = "") const {
    add(
        what, published, a, b, [&] { return mse_ratio(a, b); }, at_least, at_most, more);
  }
  // Bright samples, however rare, rule the squared error of linear colours, not this.
  void ssim(const std::string& what, const std::string& published, const Measured& a, const Measured& b,
            std::optional<double> at_least) const {
    add(what, published, a, b, [&] { return mean_difference(a.ssim, b.ssim); }, at_least, {});
  }
  void time(const std::string& what, const std::string& published, const Measured& a, const Measured& b,
            std::optional<double> at_least, std::optional<double> at_most) const {
    add(
        what, published, a, b,
        [&] {
          return Estimate{a.ms_median() / b.ms_median(), 0};
        },
        at_least, at_most);
  }
};

// --- 12: shared cuts ---------------------------------------------------------------------------------------------

// At the samples of figure 9.
constexpr int kSharingSpp = 32, kSharingImages = 3;

// Blocks of so many pixels' edge; a cut for each pixel comes first, then larger and larger ones.
std::vector<int> shares_of(Variant variant) {
  return variant == Variant::kPaper ? std::vector{1, 2, 4, 8, 16, 32} : std::vector{1, 8, 32};
}

double share_of_cuts(const Measured& m) { return m.ok() ? median(m.cut_share) : 0; }

void report_sharing(const Subject& subject, Variant variant, const Report& report) {
  const std::vector<int> shares = shares_of(variant);
  std::vector<Entry> entries;
  for (const int share : shares)
    entries.push_back({with(perfect_cut(variant, false), fmt::format("k = {}", share),
                            {{"cut_share", std::to_string(share)}}),
                       kSharingSpp});
  const std::vector<Measured> all = SubjectStudy::of(subject).measure(entries, kSharingImages);
  const Measured &per_pixel = all.front(), &eight = all[variant == Variant::kPaper ? 3 : 1],
                 &largest = all.back();
  const PairReport pair{12, subject, variant, report};
  for (std::size_t i = 1; i < all.size(); ++i)
    pair.mse(fmt::format("32 spp: MSE of a cut for {0}x{0} pixels / for each", shares[i]), "", all[i],
             per_pixel, {}, {},
             fmt::format("selection of cuts: {:.2g} % of the time and {:.2g} %", 100 * share_of_cuts(all[i]),
                         100 * share_of_cuts(per_pixel)));
  pair.mse("32 spp: MSE k = 32 / k = 8", "above 1", largest, eight, 1, {});
  pair.time("32 spp: time k = 8 / a cut for each pixel", value_text(31.3 / 37.8), eight, per_pixel, {}, 1);
  pair.add(
      "32 spp, k = 8: selection of cuts / sampling", "below 0.02", eight, eight,
      [&] {
        return Estimate{share_of_cuts(eight), 0};
      },
      {}, 0.03);
}

// --- 12: weights -------------------------------------------------------------------------------------------------

void report_weights(const Subject& subject, Variant variant, const Report& report) {
  const std::vector<std::pair<std::string, std::string>> yuksel = {{"weights", "yuksel"}};
  const Method root = perfect_root(variant, false), cut = perfect_cut(variant, false);
  const std::vector<Measured> all =
      SubjectStudy::of(subject).measure({{root, 8},
                                         {with(root, "Yuksel's weights", yuksel), 8},
                                         {cut, 8},
                                         {with(cut, "Yuksel's weights, cuts", yuksel), 8}},
                                        kCutImages);
  const PairReport pair{12, subject, variant, report};
  pair.mse("8 spp, from the root: MSE min-max / Yuksel's weights", "below 1", all[0], all[1], {}, 1);
  pair.mse("8 spp, cuts: MSE min-max / Yuksel's weights", "below 1", all[2], all[3], {}, 1);
  pair.ssim("8 spp, from the root: SSIM min-max - Yuksel's weights", "above 0", all[0], all[1], 0);
  pair.ssim("8 spp, cuts: SSIM min-max - Yuksel's weights", "above 0", all[2], all[3], 0);
}

// --- 12: two levels ----------------------------------------------------------------------------------------------

// `sparse`: lights of the character that two levels are said to be for.
void report_two_levels(const Subject& subject, Variant variant, bool sparse, const Report& report) {
  const auto named = [&](const Method& method, bool two) {
    return with(method, two ? "two levels" : "one level", {});
  };
  SubjectStudy& study = SubjectStudy::of(subject);
  const std::vector<Measured> all = study.measure({{named(perfect_cut(variant, true), true), 8},
                                                   {named(perfect_cut(variant, false), false), 8},
                                                   {named(perfect_root(variant, true), true), 8},
                                                   {named(perfect_root(variant, false), false), 8}},
                                                  kCutImages);
  const PairReport pair{12, subject, variant, report};
  const World& world = study.world(subject_settings(subject, perfect_root(variant, true), 8));
  const std::string parts =
      fmt::format("{} lights in {} meshes", study.lights(world), world.two_level.top().view().count);
  const std::optional<double> gain = sparse ? std::optional<double>(1) : std::nullopt;
  const std::optional<double> price = sparse ? std::optional<double>(1.1) : std::nullopt;
  pair.mse("8 spp, cuts: MSE two levels / one", sparse ? "below 1" : "", all[0], all[1], {}, gain, parts);
  pair.ssim("8 spp, cuts: SSIM two levels - one", sparse ? "above 0" : "", all[0], all[1],
            sparse ? std::optional<double>(0) : std::nullopt);
  pair.time("8 spp, cuts: time two levels / one", sparse ? value_text(18.7 / 17.4) : "", all[0], all[1], {},
            price);
  pair.mse("8 spp, from the root: MSE two levels / one", "", all[2], all[3], {}, {});
  pair.time("8 spp, from the root: time two levels / one", "", all[2], all[3], {}, {});
}

// --- 13: interleaving --------------------------------------------------------------------------------------------

std::string block_text(const Measured& m) { return fmt::format("{:.4g}", mean_of(m.squared_block).value); }

// The filter is the mean of the 2x2 pixels that share out a cut.
void report_interleaving(const Subject& subject, Variant variant, const Report& report) {
  const Method cut = perfect_cut(variant, false);
  const std::vector<Measured> all =
      SubjectStudy::of(subject).measure({{with(cut, "plain", {}), 8},
                                         {with(cut, "interleaved, nodes", {{"cut_interleave", "2"}}), 32},
                                         {with(cut, "plain", {}), 32}},
                                        kCutImages);
  const Measured &eight = all[0], &interleaved = all[1], &many = all[2];
  const PairReport pair{13, subject, variant, report};
  const std::string blocks = eight.ok() && interleaved.ok() && many.ok()
                                 ? fmt::format("of 2x2 means: 8 spp {}, interleaved {}, 32 spp {}",
                                               block_text(eight), block_text(interleaved), block_text(many))
                                 : "";
  pair.add(
      "MSE of 2x2 means, interleaved / 8 spp", "below 1", interleaved, eight,
      [&] { return ratio_of_means(interleaved.squared_block, eight.squared_block); }, {}, 1, blocks);
  pair.add(
      "MSE of 2x2 means, interleaved / 32 spp", "near 1, above", interleaved, many,
      [&] { return ratio_of_means(interleaved.squared_block, many.squared_block); }, 1, {}, blocks);
  pair.time("time interleaved / 8 spp", value_text(21.0 / 18.7), interleaved, eight, {}, {});
  pair.time("time interleaved / 32 spp", value_text(21.0 / 56.1), interleaved, many, {}, 1);
}

}  // namespace

void check_cut_sharing(const Report& report) {
  for (const Subject& subject : kSubjects)
    for (const Variant variant : kVariants) report_sharing(subject, variant, report);
}

void check_distance_weights(const Report& report) {
  for (const Subject& subject : kSubjects)
    for (const Variant variant : kVariants) report_weights(subject, variant, report);
}

void check_two_levels(const Report& report) {
  for (const Subject& subject : kSubjects) {
    if (subject.vpls) continue;
    const bool sparse = subject.two_level || subject.scene == std::string("cornell-lights");
    for (const Variant variant : kVariants) report_two_levels(subject, variant, sparse, report);
  }
}

void check_interleaving(const Report& report) {
  for (const Subject& subject : kSubjects)
    for (const Variant variant : kVariants) report_interleaving(subject, variant, report);
}

}  // namespace lumigrove::bench
