#include "frame/receipt.h"

#include <fmt/format.h>

#include <charconv>
#include <filesystem>
#include <thread>

#include "frame/settings_file.h"

namespace lumigrove {
namespace {

std::string timings_text(const RenderStats& stats) {
  std::string text = fmt::format("total {:.3f} ms", stats.total_ms);
  for (const PassStats& pass : stats.passes)
    text += fmt::format("; {} {:.3f} ms {} rays", pass.name, pass.ms, pass.rays);
  for (const StructureStats& structure : stats.structures)
    text += fmt::format("; {} build {:.3f} ms {} bytes", structure.name, structure.build_ms, structure.bytes);
  return text;
}

const std::string& field(const std::map<std::string, std::string>& metadata, const std::string& key,
                         const std::string& source) {
  const auto found = metadata.find(key);
  if (found == metadata.end())
    throw Error(fmt::format("'{}' carries no Lumigrove receipt: metadata '{}' is missing", source, key));
  return found->second;
}

int positive_count(const std::map<std::string, std::string>& metadata, const std::string& key,
                   const std::string& source) {
  const std::string& text = field(metadata, key, source);
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < 1)
    throw Error(fmt::format("the receipt of '{}' is damaged: {} is '{}'", source, key, text));
  return value;
}

std::string optional_field(const std::map<std::string, std::string>& metadata, const std::string& key) {
  const auto found = metadata.find(key);
  return found == metadata.end() ? "" : found->second;
}

}  // namespace

std::string version_text() {
  const std::string revision = commit();
  return revision.empty() ? version() : fmt::format("{} ({})", version(), revision);
}

Receipt make_receipt(const Scene& scene, const std::string& scene_name) {
  Receipt receipt;
  receipt.version = version_text();
  receipt.scene = scene_name;
  if (!is_builtin_scene(scene_name)) receipt.scene_file = std::filesystem::absolute(scene_name).string();
  receipt.scene_hash = content_hash(scene);
  return receipt;
}

void complete_receipt(Receipt& receipt, const Settings& settings, const RenderStats& stats) {
  receipt.settings = settings;
  receipt.spp_done = stats.spp_done;
  const auto cores = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  receipt.threads = settings.threads > 0 ? settings.threads : cores;
  receipt.stats = stats;
}

void write_receipt(const Receipt& receipt, std::map<std::string, std::string>& metadata) {
  metadata["version"] = receipt.version;
  metadata["scene"] = receipt.scene;
  if (!receipt.scene_file.empty()) metadata["scene_file"] = receipt.scene_file;
  metadata["scene_hash"] = receipt.scene_hash;
  if (!receipt.environment.empty()) metadata["environment"] = receipt.environment;
  metadata["settings"] = to_toml(receipt.settings);
  metadata["seed"] = std::to_string(receipt.settings.seed);
  metadata["frame"] = std::to_string(receipt.settings.frame);
  metadata["spp"] = std::to_string(receipt.spp_done);
  metadata["threads"] = std::to_string(receipt.threads);
  metadata["timings"] = timings_text(receipt.stats);
}

Receipt read_receipt(const std::map<std::string, std::string>& metadata, const std::string& source) {
  Receipt receipt;
  receipt.version = field(metadata, "version", source);
  receipt.scene = field(metadata, "scene", source);
  receipt.scene_file = optional_field(metadata, "scene_file");
  receipt.scene_hash = field(metadata, "scene_hash", source);
  receipt.environment = optional_field(metadata, "environment");
  receipt.spp_done = positive_count(metadata, "spp", source);
  receipt.threads = positive_count(metadata, "threads", source);
  const std::string place = fmt::format("the receipt of '{}'", source);
  apply_settings(receipt.settings, parse_settings(field(metadata, "settings", source), place), place);
  return receipt;
}

Settings rerun_settings(const Receipt& receipt) {
  Settings settings = receipt.settings;
  settings.spp = receipt.spp_done;
  return settings;
}

}  // namespace lumigrove
