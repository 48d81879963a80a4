// What an image was rendered from, kept in its metadata, so that `lumigrove rerun` makes the same pixels
// again.
#pragma once

#include <map>
#include <string>

#include "lumigrove/renderer.h"

namespace lumigrove {

struct Receipt {
  std::string version;      // of the program that rendered, "0.1.0 (3f2a9c1d04b7)"
  std::string scene;        // name or path as it was given
  std::string scene_file;   // the same path, absolute; empty for built-in scenes
  std::string scene_hash;   // content_hash of the loaded scene
  std::string environment;  // --environment as it was given; empty when there was none
  Settings settings;        // settings.spp is what was asked for
  int spp_done = 0;         // what was rendered; less after an interrupt
  int threads = 0;          // workers used
  RenderStats stats;        // written as text under "timings"; not read back
};

// version() and commit() as one text.
std::string version_text();

// Receipt of any render of `scene`, which was loaded as `scene_name`: hashes the scene, so make it once for a
// sequence.
Receipt make_receipt(const Scene& scene, const std::string& scene_name);

// Adds what one render was asked and what it did.
void complete_receipt(Receipt& receipt, const Settings& settings, const RenderStats& stats);

// Adds the receipt to `metadata`. Only the key "timings" differs between equal renders.
void write_receipt(const Receipt& receipt, std::map<std::string, std::string>& metadata);

// Throws Error naming `source` when the metadata hold no receipt or a damaged one.
Receipt read_receipt(const std::map<std::string, std::string>& metadata, const std::string& source);

// The settings that reproduce the image: those of the receipt with the samples that were really rendered.
Settings rerun_settings(const Receipt& receipt);

}  // namespace lumigrove
