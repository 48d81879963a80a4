// File importers behind `load_scene`. Each returns a validated scene or throws Error naming the file.
#pragma once

#include "lumigrove/scene.h"

namespace lumigrove {

Scene import_gltf(const std::filesystem::path& file);    // gltf_import.cpp: .gltf, .glb by tinygltf
Scene import_assimp(const std::filesystem::path& file);  // assimp_import.cpp: .obj, .ply, .fbx by Assimp

}  // namespace lumigrove
