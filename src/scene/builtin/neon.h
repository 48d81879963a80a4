// Neon lettering: words of luminous tubes.
#pragma once

#include <string_view>

#include "scene/builtin/mesh_builder.h"

namespace lumigrove::builtin {

constexpr float kLetterWidth = 0.6f;     // of a letter of height 1
constexpr float kLetterAdvance = 0.85f;  // from one letter to the next

// Draws `word` (capital letters among those of the neon font) in the frame's xy plane, facing +z, with
// letters `height` high on tubes of radius 0.045 * height. `corner` is the lower left of the word's box;
// stacked words run downwards from there. Every stroke is a closed tube.
void add_neon_word(MeshBuilder& builder, std::string_view word, vec3 corner, float height, bool stacked);

// Width and height of that word's box.
vec2 neon_word_size(std::string_view word, float height, bool stacked);

}  // namespace lumigrove::builtin
