#include "comparison.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>

#include "comparison_setup.h"
#include "contestant.h"
#include "frame_changes.h"
#include "output.h"
#include "page.h"
#include "plot_files.h"
#include "reference_image.h"
#include "render_job.h"

namespace lumigrove {
namespace {

namespace fs = std::filesystem;

constexpr double kPatience = 20;  // budgets that one camera sample may take; then the method is left out

std::string describe_scene(const Scene& scene, const SceneState& state, std::uint64_t emitters) {
  std::size_t triangles = 0;
  for (const MeshInstance& instance : state.instances)
    triangles += scene.meshes[static_cast<std::size_t>(instance.mesh)].triangles.size();
  return fmt::format("{} triangles, {} local emitters, {} instances", triangles, emitters, state.instances.size());
}

// --- one round: every method with one seed ----------------------------------------------------------------------------

struct Entry {
  int method = 0;
  std::unique_ptr<Contestant> contestant;
  double sample_s = 0;  // predicted
  Run run;
  bool done = false;
};

bool is_power_of_two(int n) { return (n & (n - 1)) == 0; }

class Contest {
 public:
  Contest(const ComparisonJob& job, const InterruptGuard& guard)
      : job_(job), guard_(guard), line_(job.progress), scene_(open_scene(job.scene, job.environment)) {}

  Results run() {
    start();
    make_folder((job_.folder / "images").string());
    for (const int frame : results_.frames) {
      if (!frame_is_complete(frame)) compare_frame(frame);
      if (guard_.interrupted()) break;
    }
    finish();
    return std::move(results_);
  }

 private:
  void start() {
    results_ = describe_job(job_, scene_);
    if (job_.resume) take_up(results_, read_results(job_.folder), job_.folder.string());
  }

  void finish() {
    line_.end();
    results_.complete = !guard_.interrupted();
    results_.changes = frame_changes(results_, job_.folder, job_.metrics.tone);
    write_results(results_, job_.folder);
    write_plots(results_, job_.folder);
    write_report(results_, job_.folder);
  }

  // --- one frame --------------------------------------------------------------------------------------------------

  bool has_run(int method, int seed, int frame) const {
    return std::any_of(results_.runs.begin(), results_.runs.end(), [&](const Run& run) {
      return run.complete && run.method == method && run.seed == seed && run.frame == frame;
    });
  }

  bool has_failed(int method) const { return !results_.methods[static_cast<std::size_t>(method)].failure.empty(); }
  int method_count() const { return static_cast<int>(results_.methods.size()); }

  bool frame_is_complete(int frame) const {
    for (int method = 0; method < method_count(); ++method)
      for (int seed = 0; seed < results_.seeds; ++seed)
        if (!has_failed(method) && !has_run(method, seed, frame)) return false;
    return true;
  }

  void compare_frame(int frame) {
    entries_.clear();
    geometry_.reset();  // of the last frame, before another takes as much memory
    RenderStats untimed;
    geometry_ = make_geometry(scene_, settings_at(job_, scene_, job_.methods.front().settings, frame), untimed);
    enter_methods(frame);
    if (results_.scene_summary.empty()) results_.scene_summary = describe_scene(scene_, geometry_->state, emitters_);
    if (guard_.interrupted()) return;
    if (!(results_.budget_s > 0) || results_.budget_spp < 1) settle_budgets();
    predict_work(frame);
    if (!prepare_reference(frame)) return;
    for (int seed = 0; seed < results_.seeds && !guard_.interrupted(); ++seed) compare_seed(seed, frame);
  }

  void fail(int method, const std::string& why) {
    results_.methods[static_cast<std::size_t>(method)].failure = why;
    line_.end();
    spdlog::warn("{} is left out: {}", results_.methods[static_cast<std::size_t>(method)].name, why);
  }

  // Does `work`; whatever goes wrong is the end of this method, not of the comparison.
  template <class Work>
  bool attempt(int method, const Work& work) {
    try {
      work();
      return true;
    } catch (const std::bad_alloc&) {
      fail(method, "out of memory");
    } catch (const std::exception& error) {
      fail(method, error.what());
    }
    return false;
  }

  void enter_methods(int frame) {
    for (int method = 0; method < method_count() && !guard_.interrupted(); ++method) {
      if (has_failed(method)) continue;
      const std::string& name = results_.methods[static_cast<std::size_t>(method)].name;
      tell(fmt::format("warming up {}", name));
      attempt(method, [&] {
        const Settings settings = settings_at(job_, scene_, job_.methods[static_cast<std::size_t>(method)].settings, frame);
        auto contestant = std::make_unique<Contestant>(scene_, geometry_, settings);
        const double sample_s = contestant->predict_sample_s();
        const double limit = kPatience * (results_.budget_s > 0 ? results_.budget_s : 30.0);
        if (sample_s > limit)
          throw Error(fmt::format("one camera sample would take about {:.0f} s, more than {:.0f} times the budget", sample_s,
                                  kPatience));
        emitters_ = std::max(emitters_, contestant->emitters());
        entries_.push_back({method, std::move(contestant), sample_s, {}, false});
      });
    }
    if (entries_.empty() && !guard_.interrupted())
      throw Error(fmt::format("no method is left to compare: {}", results_.methods.front().failure));
  }

  // The budget that was not asked for, from one sample of each method.
  void settle_budgets() {
    double fastest_s = std::numeric_limits<double>::infinity();
    int fewest = std::numeric_limits<int>::max();
    for (Entry& entry : entries_) {
      tell("settling the budgets");
      const bool works = attempt(entry.method, [&] {
        entry.contestant->begin(results_.first_seed);
        const double build_s = entry.contestant->seconds();
        entry.contestant->sample();
        entry.sample_s = entry.contestant->median_sample_s();
        fastest_s = std::min(fastest_s, build_s + entry.sample_s * results_.budget_spp);
        fewest = std::min(fewest, static_cast<int>(std::min(1e6, (results_.budget_s - build_s) / entry.sample_s)));
      });
      entry.done = !works;
      if (guard_.interrupted()) break;
    }
    std::erase_if(entries_, [](const Entry& entry) { return entry.done; });
    if (!(results_.budget_s > 0))
      results_.budget_s = fastest_s;
    else
      results_.budget_spp = std::max(1, fewest);
  }

  // --- the reference -----------------------------------------------------------------------------------------------

  std::vector<std::string> lights() const {
    std::vector<std::string> names;
    for (const Contender& method : results_.methods)
      if (method.failure.empty() && std::find(names.begin(), names.end(), method.light) == names.end())
        names.push_back(method.light);
    return names;
  }

  fs::path reference_file(const std::string& light, int frame) const {
    return fs::path("images") / fmt::format("reference.{}{}.exr", slug(light), frame_suffix(frame));
  }
  std::string frame_suffix(int frame) const { return job_.frames.empty() ? "" : fmt::format(".f{:04}", frame); }

  bool has_references(int frame) const {
    for (const std::string& light : lights()) {
      const auto is_it = [&](const Reference& r) { return r.light == light && r.frame == frame; };
      const auto found = std::find_if(results_.references.begin(), results_.references.end(), is_it);
      if (found == results_.references.end() || !fs::exists(job_.folder / found->file)) return false;
    }
    return true;
  }

  BudgetSpec reference_budget() const {
    BudgetSpec budget = job_.reference_budget;
    if (!(budget.seconds > 0) && budget.spp < 1)
      budget.seconds = results_.budget_s * results_.seeds * static_cast<double>(entries_.size());
    return budget;
  }

  // Direct light has a method of its own where one was given that finds nothing else.
  const ComparedMethod& reference_method(const std::string& light) const {
    for (const ComparedMethod& method : job_.reference_methods)
      if ((method.settings.indirect.transport == Transport::kNone) == (light == kDirectLight)) return method;
    return job_.reference_methods.front();
  }

  // Methods share the budget.
  ReferenceImages make_reference(int frame) {
    if (!job_.reference_file.empty())
      return read_reference(job_.reference_file, results_.width, results_.height, lights());
    std::map<const ComparedMethod*, std::vector<std::string>> lights_of;
    for (const std::string& light : lights()) lights_of[&reference_method(light)].push_back(light);
    const double share = 1.0 / static_cast<double>(lights_of.size());
    BudgetSpec budget = reference_budget();
    budget.seconds *= share;
    ReferenceImages images;
    for (const auto& [method, lights] : lights_of) {
      const double before = work_done_;
      Settings settings = settings_at(job_, scene_, method->settings, frame);
      settings.frame = results_.frames.front();  // the same random numbers: what stands still does not flicker
      images.merge(render_reference(scene_, geometry_, settings, budget, lights, job_.metrics, [&](double seconds) {
        work_done_ = before + std::min(seconds, share * reference_work_);
        tell("reference");
        return !guard_.interrupted();
      }));
      if (guard_.interrupted() && images.count(lights.front()) == 0) return {};
    }
    return images;
  }

  // False: interrupted before there was one.
  bool prepare_reference(int frame) {
    references_.clear();
    if (!has_references(frame)) {
      std::erase_if(results_.references, [&](const Reference& r) { return r.frame == frame; });
      ReferenceImages made = make_reference(frame);
      if (made.empty()) return false;
      for (auto& [light, reference] : made) {
        const std::string file = reference_file(light, frame).string();
        save(reference.image, {{"emission", reference.emission}}, file);
        results_.references.push_back({light, frame, file, reference.origin, reference.errors});
      }
    }
    // As it is on disk, rounded, so that it is the same after a --resume.
    for (const Reference& reference : results_.references)
      if (reference.frame == frame) references_[reference.light] = load(reference.file);
    return true;
  }

  ReferenceImage load(const std::string& file) const {
    const Image image = read_image(job_.folder / file);
    ReferenceImage reference;
    reference.image = rgb_of(image, "", file);
    if (image.find("emission")) reference.emission = rgb_of(image, "emission", file);
    return reference;
  }

  // Layers without values are left out.
  void save(const RgbImage& image, const std::vector<std::pair<std::string, RgbImage>>& layers, const std::string& file) const {
    const std::vector<std::string> rgb{"R", "G", "B"};
    Image written{image.width, image.height, {{"", rgb, image.rgb, {}}}, {}};
    for (const auto& [name, layer] : layers)
      if (!layer.rgb.empty()) written.layers.push_back({name, rgb, layer.rgb, {}});
    write_image(written, job_.folder / file);
  }

  // --- runs -------------------------------------------------------------------------------------------------------

  double run_work(const Entry& entry) const {
    return std::max(results_.budget_s, entry.sample_s * results_.budget_spp);
  }

  // Seconds of work in this frame and, as if they were like it, in those to come.
  void predict_work(int frame) {
    const int frames_left = static_cast<int>(std::count_if(results_.frames.begin(), results_.frames.end(),
                                                           [&](int f) { return f >= frame && !frame_is_complete(f); }));
    double runs = 0, sample_s = 0;
    for (const Entry& entry : entries_) {
      runs += run_work(entry) * results_.seeds;
      sample_s = std::max(sample_s, entry.sample_s);
    }
    const BudgetSpec reference = reference_budget();
    const bool renders_reference = job_.reference_file.empty() && !has_references(frame);
    reference_work_ = renders_reference ? std::max(reference.seconds, reference.spp * sample_s) : 0;
    work_total_ = work_done_ + frames_left * (reference_work_ + runs);
  }

  void tell(const std::string& what) {
    if (!line_.due(false)) return;
    const double done = work_total_ > 0 ? std::min(1.0, work_done_ / work_total_) : 0;
    line_.show(done, what, nlohmann::json{{"stage", what}});
  }

  void compare_seed(int seed, int frame) {
    std::vector<Entry*> running;
    for (Entry& entry : entries_) {
      entry.done = has_failed(entry.method) || has_run(entry.method, seed, frame);
      if (entry.done) continue;
      entry.run = Run{};
      entry.run.method = entry.method;
      entry.run.seed = seed;
      entry.run.frame = frame;
      const auto begin = [&] { entry.contestant->begin(results_.first_seed + static_cast<std::uint32_t>(seed)); };
      if (attempt(entry.method, begin)) running.push_back(&entry);
    }
    while (!running.empty() && !guard_.interrupted()) {
      const auto least = [](const Entry* a, const Entry* b) { return a->contestant->seconds() < b->contestant->seconds(); };
      Entry& next = **std::min_element(running.begin(), running.end(), least);
      const double before = next.contestant->seconds();
      next.done = !attempt(next.method, [&] { advance(next); }) || reached_both(next);
      work_done_ += next.contestant->seconds() - before;
      std::erase_if(running, [](const Entry* entry) { return entry->done; });
      tell(fmt::format("seed {} of {}{}, {}", seed + 1, results_.seeds,
                       job_.frames.empty() ? "" : fmt::format(", frame {}", frame), name_of(next)));
    }
    // What was interrupted has had nearly the same time.
    for (Entry* entry : running)
      if (entry->contestant->spp() > 0) attempt(entry->method, [&] { interrupt(*entry); });
    for (Entry& entry : entries_)
      if (entry.run.seed == seed && entry.run.frame == frame && !has_failed(entry.method) && entry.run.sample_ms > 0)
        results_.runs.push_back(std::move(entry.run));
    for (Entry& entry : entries_) entry.run = Run{};
    write_results(results_, job_.folder);
  }

  const std::string& name_of(const Entry& entry) const {
    return results_.methods[static_cast<std::size_t>(entry.method)].name;
  }
  static bool reached_both(const Entry& entry) {
    return entry.run.stage(Budget::kTime).spp > 0 && entry.run.stage(Budget::kSamples).spp > 0;
  }

  // One camera sample, and whatever is to be measured after it.
  void advance(Entry& entry) {
    Contestant& contestant = *entry.contestant;
    contestant.sample();
    const bool time_is_up = contestant.seconds() + 0.5 * contestant.median_sample_s() >= results_.budget_s;
    const bool takes_time = time_is_up && entry.run.stage(Budget::kTime).spp == 0;
    const bool takes_samples = contestant.spp() >= results_.budget_spp && entry.run.stage(Budget::kSamples).spp == 0;
    if (takes_time || takes_samples || is_power_of_two(contestant.spp())) measure(entry, takes_time, takes_samples);
    if (!reached_both(entry)) return;
    entry.run.complete = true;
    contestant.describe(entry.run);
  }

  void interrupt(Entry& entry) {
    measure(entry, entry.run.stage(Budget::kTime).spp == 0, false);
    entry.contestant->describe(entry.run);
  }

  void measure(Entry& entry, bool takes_time, bool takes_samples) {
    const Contestant& contestant = *entry.contestant;
    const std::string& light = results_.methods[static_cast<std::size_t>(entry.method)].light;
    const ReferenceImage& shown = references_.at(light);
    const RgbImage& reference = shown.image;
    RgbImage image = with_emission(contestant.image(light), shown.emission);
    if (shows_emission(light) && shown.emission.rgb.empty()) image = with_emission(image, contestant.part(&FilmPixel::emission));
    image.name = name_of(entry);
    CurvePoint point{contestant.spp(), contestant.seconds(), contestant.rays(), rmse(reference, image),
                     rel_mse(reference, image)};
    if (entry.run.curve.empty() || entry.run.curve.back().spp < point.spp) entry.run.curve.push_back(point);
    if (!takes_time && !takes_samples) return;
    const Comparison errors = compare_images(reference, image, job_.metrics);
    for (const Budget budget : kBudgets) {
      if (!(budget == Budget::kTime ? takes_time : takes_samples)) continue;
      Stage stage{point.spp, point.seconds, point.rays, {errors.rmse, errors.rel_mse, errors.ssim, errors.flip}, ""};
      stage.file = (fs::path("images") / fmt::format("{:02}-{}.{}.s{}{}.exr", entry.method, slug(name_of(entry)),
                                                     budget_key(budget), entry.run.seed, frame_suffix(entry.run.frame)))
                       .string();
      save(image, parts(contestant), stage.file);
      if (entry.run.seed == 0 && entry.run.frame == results_.frames.front()) note_command(entry, budget, stage);
      entry.run.stages[static_cast<std::size_t>(budget)] = std::move(stage);
    }
  }

  static std::vector<std::pair<std::string, RgbImage>> parts(const Contestant& contestant) {
    std::vector<std::pair<std::string, RgbImage>> parts{{"direct", contestant.part(&FilmPixel::direct)}};
    if (contestant.settings().indirect.transport != Transport::kNone)
      parts.emplace_back("indirect", contestant.part(&FilmPixel::indirect));
    return parts;
  }

  void note_command(const Entry& entry, Budget budget, const Stage& stage) {
    Contender& method = results_.methods[static_cast<std::size_t>(entry.method)];
    method.commands[static_cast<std::size_t>(budget)] =
        render_command(job_, entry.contestant->settings(), stage.spp, fmt::format("{}.exr", slug(method.name)));
  }

  const ComparisonJob& job_;
  const InterruptGuard& guard_;
  ProgressLine line_;
  Scene scene_;
  Results results_;
  std::uint64_t emitters_ = 0;
  std::shared_ptr<Geometry> geometry_;
  std::vector<Entry> entries_;
  ReferenceImages references_;  // of the frame at hand, by light
  double work_done_ = 0, work_total_ = 0, reference_work_ = 0;  // seconds, predicted
};

}  // namespace

Results run_comparison(const ComparisonJob& job, const InterruptGuard& guard) {
  if (!job.resume && !job.force && fs::exists(job.folder / "results.json"))
    throw Error(fmt::format("{}: holds a comparison already; --resume goes on with it, --force replaces it",
                            job.folder.string()));
  const int asked = job.methods.front().settings.threads;
  const int threads = asked > 0 ? asked : tbb::this_task_arena::max_concurrency();
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
  tbb::task_arena arena(threads);
  return arena.execute([&] { return Contest(job, guard).run(); });
}

}  // namespace lumigrove
