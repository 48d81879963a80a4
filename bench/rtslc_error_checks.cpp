// Check 10 of the reproduction of real-time stochastic lightcuts: ways to sample lights at equal samples and at equal time.
#include <algorithm>
#include <array>
#include <cmath>

#include "rtslc_checks.h"
#include "rtslc_study.h"

namespace lumigrove::bench {
namespace {

constexpr int kErrorImages = 8, kEqualTimeImages = 6;
constexpr int kSpp = 8;            // of table 3
constexpr int kEqualTimeSpp = 16;  // of the perfect tree with cuts, where times are equal
constexpr int kMostCutNodes = 32;

// --- published -------------------------------------------------------------------------------------------------

// In the order of figures 7 and 8: of kPlaces.
enum Place { kUniform, kUnbalancedRoot, kUnbalancedCut, kPerfectRoot, kPerfectCut, kPlaces };

struct Table {
  std::array<double, kPlaces> spp, mse, ssim;  // at equal time
  std::array<double, kPlaces> ms8, mse8, ssim8;
  bool unbalanced_quieter;  // at equal samples
  bool unbalanced_first;    // at equal time
};
constexpr Table kTables[] = {{{12, 6, 9, 7, 17},
                              {.108, .098, .078, .097, .050},
                              {.181, .194, .222, .195, .285},
                              {20.8, 39.3, 26.1, 33.4, 17.4},
                              {.119, .088, .093, .092, .085},
                              {.170, .208, .205, .201, .214},
                              false,
                              false},
                             {{30, 9, 14, 16, 23},
                              {.055, .048, .028, .036, .023},
                              {.181, .178, .217, .193, .238},
                              {7.7, 25.7, 18.6, 14.8, 11.8},
                              {.123, .053, .048, .070, .065},
                              {.155, .173, .179, .162, .165},
                              true,
                              false},
                             {{35, 12, 17, 19, 29},
                              {.046, .021, .011, .033, .019},
                              {.439, .484, .534, .457, .503},
                              {6.4, 19.9, 15.1, 12.4, 9.8},
                              {.107, .030, .039, .063, .065},
                              {.369, .451, .436, .403, .401},
                              true,
                              true},
                             {{13, 6, 9, 8, 16},
                              {.033, .025, .023, .028, .022},
                              {.160, .210, .222, .194, .235},
                              {18.1, 41.0, 26.9, 29.2, 18.7},
                              {.035, .022, .025, .028, .028},
                              {.149, .232, .208, .195, .188},
                              true,
                              false}};

struct SplittingTable {
  double spp_ats, spp_ours, mse_ats, mse_ours;  // at equal time
  double mse_ats_equal_spp, ms_ats, ms_ours;    // at the samples of ours
};
constexpr SplittingTable kSplitting[] = {{5, 11, .090, .064, .058, 48.1, 22.1},
                                         {4, 13, .084, .040, .033, 58.9, 18.1}};

std::string ratio_text(double a, double b) { return fmt::format("{:.2f}", a / b); }

// --- measured --------------------------------------------------------------------------------------------------

// Of one variant, or of both where they do not differ.
using Row = std::array<Measured, kPlaces>;

std::array<Method, kPlaces> methods_of(const Subject& subject, Variant variant) {
  return {uniform_method(), unbalanced_root(), unbalanced_cut(variant),
          perfect_root(variant, subject.two_level), perfect_cut(variant, subject.two_level)};
}

int samples_in(double budget_ms, const Measured& at_8) {
  const int spp = static_cast<int>(std::lround(budget_ms / at_8.ms_median() * at_8.entry.spp));
  return std::clamp(spp, 1, at_8.entry.uses_cuts() ? kMostCutNodes : 4096);
}

struct Rows {
  Row at_8, at_equal_time;
};

// Those of both variants take turns; what does not differ between them is measured once.
std::array<Rows, 2> measure_rows(const Subject& subject) {
  constexpr std::array<std::array<std::size_t, kPlaces>, 2> kNumbers = {{{0, 1, 2, 3, 4}, {0, 1, 5, 6, 7}}};
  SubjectStudy& study = SubjectStudy::of(subject);
  std::vector<Entry> entries(8);
  for (std::size_t v = 0; v < 2; ++v) {
    const auto methods = methods_of(subject, kVariants[v]);
    for (std::size_t p = 0; p < kPlaces; ++p) entries[kNumbers[v][p]] = {methods[p], kSpp};
  }
  const std::vector<Measured> at_8 = study.measure(entries, kErrorImages);
  const Measured& reference = at_8[kPerfectCut];
  std::vector<Measured> later = at_8;
  if (reference.ok()) {
    const double budget = reference.ms_median() * kEqualTimeSpp / kSpp;
    for (std::size_t i = 0; i < entries.size(); ++i)
      if (at_8[i].ok()) entries[i].spp = samples_in(budget, at_8[i]);
    later = study.measure(entries, kEqualTimeImages);
  }
  std::array<Rows, 2> rows;
  for (std::size_t v = 0; v < 2; ++v)
    for (std::size_t p = 0; p < kPlaces; ++p) {
      rows[v].at_8[p] = at_8[kNumbers[v][p]];
      rows[v].at_equal_time[p] = later[kNumbers[v][p]];
    }
  return rows;
}

// --- relations -------------------------------------------------------------------------------------------------

class StrategyReport {
 public:
  StrategyReport(const Subject& subject, const Table& table, Variant variant, const Rows& rows,
                 const Report& report)
      : scene_(subject.scene), table_(table), variant_(variant), rows_(rows), report_(report) {}

  void run() {
    tables();
    equal_samples();
    equal_time();
  }

 private:
  // Numbers to be read.
  void tables() {
    for (std::size_t p = first(); p < kPlaces; ++p) {
      const Measured& at_8 = rows_.at_8[p];
      add(
          at_8.entry.method.name + ", 8 spp: MSE", fmt::format("{:.3f}", table_.mse8[p]), {&at_8},
          [&] { return mean_of(at_8.squared); }, {}, {},
          fmt::format("published: SSIM {:.3f}, {} ms", table_.ssim8[p], table_.ms8[p]));
    }
    for (std::size_t p = first(); p < kPlaces; ++p) {
      const Measured& later = rows_.at_equal_time[p];
      add(
          later.entry.method.name + ", equal time: MSE", fmt::format("{:.3f}", table_.mse[p]), {&later},
          [&] { return mean_of(later.squared); }, {}, {},
          fmt::format("published: {} spp, SSIM {:.3f}", table_.spp[p], table_.ssim[p]));
    }
  }

  void equal_samples() {
    for (const Place p : {kUnbalancedRoot, kUnbalancedCut, kPerfectRoot, kPerfectCut})
      if (p >= first()) mse8(fmt::format("8 spp: MSE {} / uniform", name(p)), p, kUniform, {}, 1);
    const auto noisier = table_.unbalanced_quieter ? std::optional<double>(1) : std::nullopt;
    mse8("8 spp, from the root: MSE perfect / unbalanced", kPerfectRoot, kUnbalancedRoot, noisier, {});
    mse8("8 spp, cuts: MSE perfect / unbalanced", kPerfectCut, kUnbalancedCut, noisier, {});
    time8("8 spp, from the root: time perfect / unbalanced", kPerfectRoot, kUnbalancedRoot);
    time8("8 spp, cuts: time perfect / unbalanced", kPerfectCut, kUnbalancedCut);
    time8("8 spp, perfect tree: time cuts / from the root", kPerfectCut, kPerfectRoot);
  }

  void equal_time() {
    at_equal_time("equal time, unbalanced tree: MSE cuts / from the root", kUnbalancedCut, kUnbalancedRoot,
                  {}, 1);
    for (const Place p : {kUniform, kUnbalancedRoot, kUnbalancedCut, kPerfectRoot}) {
      const bool second = p == kUnbalancedCut && table_.unbalanced_first;
      at_equal_time(fmt::format("equal time: MSE perfect tree, cuts / {}", name(p)), kPerfectCut, p,
                    second ? std::optional<double>(1) : std::nullopt,
                    second ? std::nullopt : std::optional<double>(1));
    }
    ssim();
  }

  // Uniform sampling and the unbalanced tree without cuts are the same in both variants: told of once.
  std::size_t first() const { return variant_ == kVariants[0] ? 0 : kUnbalancedCut; }

  std::string name(Place p) const { return rows_.at_8[p].entry.method.name; }

  void mse8(const std::string& what, Place a, Place b, std::optional<double> at_least,
            std::optional<double> at_most) {
    const Measured &x = rows_.at_8[a], &y = rows_.at_8[b];
    add(
        what, ratio_text(table_.mse8[a], table_.mse8[b]), {&x, &y}, [&] { return mse_ratio(x, y); }, at_least,
        at_most);
  }
  void time8(const std::string& what, Place a, Place b) {
    const Measured &x = rows_.at_8[a], &y = rows_.at_8[b];
    add(
        what, ratio_text(table_.ms8[a], table_.ms8[b]), {&x, &y},
        [&] {
          return Estimate{x.ms_median() / y.ms_median(), 0};
        },
        {}, 1);
  }
  void at_equal_time(const std::string& what, Place a, Place b, std::optional<double> at_least,
                     std::optional<double> at_most) {
    const Measured &x = rows_.at_equal_time[a], &y = rows_.at_equal_time[b];
    add(
        what, ratio_text(table_.mse[a], table_.mse[b]), {&x, &y}, [&] { return equal_time_ratio(x, y); },
        at_least, at_most);
  }

  // Against the best of the others, but where the paper has one ahead.
  void ssim() {
    std::size_t best = kUniform;
    for (const std::size_t p : {kUnbalancedRoot, kUnbalancedCut, kPerfectRoot}) {
      const Measured& other = rows_.at_equal_time[p];
      if (p == kUnbalancedCut && table_.unbalanced_first) continue;
      const Measured& known = rows_.at_equal_time[best];
      if (other.ok() && known.ok() && mean_of(other.ssim).value > mean_of(known.ssim).value) best = p;
    }
    double published = 0;
    for (std::size_t p = 0; p < kPerfectCut; ++p)
      if (!(p == kUnbalancedCut && table_.unbalanced_first)) published = std::max(published, table_.ssim[p]);
    const Measured &x = rows_.at_equal_time[kPerfectCut], &y = rows_.at_equal_time[best];
    add("equal time: SSIM perfect tree, cuts - best other",
        fmt::format("{:+.3f}", table_.ssim[kPerfectCut] - published), {&x, &y},
        [&] { return mean_difference(x.ssim, y.ssim); }, 0, {});
  }

  template <class Value>
  void add(const std::string& what, const std::string& published, std::vector<const Measured*> sides,
           const Value& value, std::optional<double> at_least, std::optional<double> at_most,
           const std::string& more = "") {
    const bool varies = std::any_of(sides.begin(), sides.end(), [&](const Measured* side) {
      return side != &rows_.at_8[kUniform] && side != &rows_.at_8[kUnbalancedRoot] &&
             side != &rows_.at_equal_time[kUniform] && side != &rows_.at_equal_time[kUnbalancedRoot];
    });
    const std::string title = varies ? fmt::format("{} ({})", what, variant_name(variant_)) : what;
    std::string note;
    for (const Measured* side : sides) {
      if (!side->ok()) {
        report_(missing_relation(10, scene_, title, published, side->missing));
        return;
      }
      note += (note.empty() ? "" : "; ") + (sides.size() > 1 ? side->entry.method.name + ": " : "") +
              measured_text(*side);
    }
    if (!more.empty()) note += "; " + more;
    const Estimate ours = value();
    report_({10, scene_, title, published, ours.value, ours.error, at_least, at_most, note});
  }

  std::string scene_;
  const Table& table_;
  Variant variant_;
  const Rows& rows_;
  const Report& report_;
};

// --- table 2 -----------------------------------------------------------------------------------------------------

void report_splitting(const Subject& subject, const SplittingTable* published, const Report& report) {
  SubjectStudy& study = SubjectStudy::of(subject);
  std::vector<Entry> entries = {{ats(false), kSpp}, {ats(true), 1}};
  for (const Variant variant : kVariants) entries.push_back({perfect_cut(variant, false), kSpp});
  const std::vector<Measured> all = study.measure(entries, kErrorImages);
  const Measured &saoh = all[0], &split = all[1];
  for (std::size_t v = 0; v < 2; ++v) {
    const Measured& ours = all[2 + v];
    const auto add = [&](const Measured& theirs, const std::string& what, const std::string& number,
                         const auto& value, std::optional<double> at_least, std::optional<double> at_most) {
      const std::string title = fmt::format("{} ({})", what, variant_name(kVariants[v]));
      for (const Measured* side : {&theirs, &ours})
        if (!side->ok()) {
          report(missing_relation(10, subject.scene, title, number, side->missing));
          return;
        }
      const Estimate estimate = value();
      report({10, subject.scene, title, number, estimate.value, estimate.error, at_least, at_most,
              fmt::format("{}: {}, {:.1f} shadow rays a pixel; cuts: {}, {:.1f} shadow rays a pixel",
                          theirs.entry.method.name, measured_text(theirs), theirs.rays, measured_text(ours),
                          ours.rays)});
    };
    const auto text = [&](double a, double b) { return published ? ratio_text(a, b) : std::string(); };
    const SplittingTable p = published ? *published : SplittingTable{};
    add(
        saoh, "equal samples: MSE SAOH tree / cuts", text(p.mse_ats_equal_spp, p.mse_ours),
        [&] { return mse_ratio(saoh, ours); }, {}, 1);
    add(saoh, "equal samples: time SAOH tree / cuts", text(p.ms_ats, p.ms_ours),
        [&] {
          return Estimate{saoh.ms_median() / ours.ms_median(), 0};
        },
        1, {});
    add(saoh, "equal time: MSE SAOH tree / cuts", text(p.mse_ats, p.mse_ours),
        [&] { return equal_time_ratio(saoh, ours); }, 1, {});
    add(
        split, "equal shadow rays: MSE ats / cuts", "",
        [&] {
          const Estimate ratio = mse_ratio(split, ours);
          return Estimate{ratio.value * split.rays / ours.rays, ratio.error * split.rays / ours.rays};
        },
        {}, 1);
    add(split, "equal time: MSE ats / cuts", "", [&] { return equal_time_ratio(split, ours); }, 1, {});
  }
}

}  // namespace

void check_strategies(const Report& report) {
  for (std::size_t s = 0; s < std::size(kSubjects); ++s) {
    const std::array<Rows, 2> rows = measure_rows(kSubjects[s]);
    for (std::size_t v = 0; v < 2; ++v)
      StrategyReport(kSubjects[s], kTables[s], kVariants[v], rows[v], report).run();
  }
}

void check_tree_splitting(const Report& report) {
  for (std::size_t s = 0; s < std::size(kSubjects); ++s)
    report_splitting(kSubjects[s], s < std::size(kSplitting) ? &kSplitting[s] : nullptr, report);
}

}  // namespace lumigrove::bench
