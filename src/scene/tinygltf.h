// tinygltf, compiled into this library (tinygltf.cpp) under a namespace of its own. Debian's libdraco, which
// Assimp brings along, exports an older tinygltf with the same symbols and other layouts; sharing the name
// `tinygltf` with it would let the loader bind our calls to the wrong one. Include this header, never
// <tiny_gltf.h> itself.
#pragma once

#include <nlohmann/json.hpp>

#define tinygltf lumigrove_tinygltf
#define TINYGLTF_NO_INCLUDE_JSON
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#define TINYGLTF_NO_EXTERNAL_IMAGE
#include <tiny_gltf.h>
