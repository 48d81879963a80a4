// lumigrove rerun IMAGE: renders an image again from the receipt it carries.
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>

#include "base/atomic_file.h"
#include "checks.h"
#include "commands.h"
#include "logging.h"
#include "output.h"
#include "render_job.h"
#include "stats_table.h"

namespace lumigrove {
namespace {

namespace fs = std::filesystem;

struct RerunOptions {
  std::string image, scene, progress = "auto";
  std::shared_ptr<OutputOptions> output;
  std::shared_ptr<LogOptions> log;
  int threads = -1;
  bool check = false, force = false, stats = false;
};

// The scene as the receipt names it; a file that is not at its given place is looked for at its absolute one.
std::string scene_to_open(const RerunOptions& options, const Receipt& receipt) {
  if (!options.scene.empty()) return options.scene;
  const bool moved =
      !receipt.scene_file.empty() && !fs::exists(receipt.scene) && fs::exists(receipt.scene_file);
  return moved ? receipt.scene_file : receipt.scene;
}

void check_hash(const RerunOptions& options, const Receipt& old, const Receipt& now) {
  if (old.scene_hash == now.scene_hash) return;
  const std::string sentence =
      fmt::format("scene '{}' has changed since '{}' was rendered: its hash is {}, not {}", now.scene,
                  options.image, now.scene_hash, old.scene_hash);
  if (!options.force) throw Error(sentence + " (--force renders it all the same)");
  spdlog::warn("{}", sentence);
}

// Equal to the last bit, so that NaN equals itself.
template <class T>
std::size_t count_differences(const std::vector<T>& a, const std::vector<T>& b) {
  if (a.size() != b.size()) return std::max(a.size(), b.size());
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) count += std::memcmp(&a[i], &b[i], sizeof(T)) != 0;
  return count;
}

// Values of `a` that `b` does not repeat, over all layers.
std::size_t count_differences(const Image& a, const Image& b) {
  std::size_t count = a.layers.size() == b.layers.size() ? 0 : 1;
  for (const Layer& layer : a.layers) {
    const Layer* other = b.find(layer.name);
    count += other ? count_differences(layer.values, other->values) + count_differences(layer.ids, other->ids)
                   : std::max(layer.values.size(), layer.ids.size());
  }
  return count;
}

// As its file reads back: files hold colours in fewer bits than renders do.
Image through_file(const Image& image, const std::string& like, const ToneMap& tone) {
  const fs::path file = temporary_beside(fs::temp_directory_path() / fs::path(like).filename())
                            .replace_extension(fs::path(like).extension());
  write_image(image, file, tone);
  Image result = read_image(file);
  fs::remove(file);
  return result;
}

void check_pixels(const RerunOptions& options, const Image& old, const Image& image) {
  const std::size_t different =
      count_differences(old, through_file(image, options.image, options.output->tone()));
  if (different > 0)
    throw Error(fmt::format("{} values of '{}' were not reproduced", different, options.image));
  if (!options.log->quiet) fmt::print("{} is reproduced bit for bit\n", options.image);
}

void run(const RerunOptions& options) {
  start_logging(*options.log);
  if (!options.check && options.output->files.empty()) throw CLI::RequiredError("-o,--output or --check");
  require_distinct(options.output->files);
  for (const std::string& file : options.output->files) require_writable(file);
  const Image old = read_image(options.image);
  const Receipt receipt = read_receipt(old.metadata, options.image);
  if (receipt.version != version_text())
    spdlog::warn("'{}' was rendered by version {}, this is {}", options.image, receipt.version,
                 version_text());

  const std::string name = scene_to_open(options, receipt);
  const Scene scene = open_scene(name, receipt.environment);
  Receipt now = make_receipt(scene, name);
  now.environment = receipt.environment;
  check_hash(options, receipt, now);

  Settings settings = rerun_settings(receipt);
  if (options.threads >= 0) settings.threads = options.threads;
  check(settings);
  const InterruptGuard guard;
  const ProgressStyle style = options.log->quiet ? ProgressStyle::kSilent : progress_style(options.progress);
  ProgressPrinter progress(style, 1);
  const Image image = render_frame(scene, settings, now, progress, guard);
  progress.end_line();
  write_files(image, options.output->files, options.output->tone(), now, options.log->quiet);
  if (options.stats) fmt::print("{}", stats_table(now.stats, 1));
  if (guard.interrupted()) throw ExitCode{guard.exit_status()};
  if (options.check) check_pixels(options, old, image);
}

}  // namespace

void add_rerun_command(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("rerun", "Render an image again, bit for bit, from the receipt it carries");
  auto options = std::make_shared<RerunOptions>();
  command->add_option("IMAGE", options->image, "An .exr that `lumigrove render` wrote")->required();
  options->output = add_output_options(*command);
  command->add_flag("--check", options->check,
                    "Compare every value with the image; exit status 1 when any differs");
  command->add_option("--scene", options->scene, "Scene file, when it is no longer where the receipt says")
      ->check(not_empty());
  command
      ->add_option("-t,--threads,--nthreads", options->threads,
                   "Worker threads (default as the receipt says)")
      ->check(CLI::Range(0, 1024));
  command->add_flag("--force", options->force, "Render although the scene has changed");
  add_stats_option(*command, options->stats);
  add_progress_option(*command, options->progress);
  options->log = add_log_options(*command);
  command->callback([options] { run(*options); });
}

}  // namespace lumigrove
