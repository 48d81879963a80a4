#include "scene/builtin/neon.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace lumigrove::builtin {
namespace {

constexpr float kTubeRadius = 0.045f;
constexpr int kTubeSides = 5;
constexpr float kLineHeight = 1.25f;  // of stacked letters

// Strokes on a grid 3 wide and 5 high: pairs of digits (column 0..2, row 0..4 from below), blank between
// polylines.
struct Glyph {
  char letter;
  std::string_view strokes;
};
constexpr Glyph kGlyphs[] = {{'A', "00042420 0222"},
                             {'B', "0004142322120200 12212000"},
                             {'C', "24040020"},
                             {'D', "00041423211000"},
                             {'E', "24040020 0212"},
                             {'F', "000424 0212"},
                             {'G', "2404002022 2212"},
                             {'H', "0004 2024 0222"},
                             {'I', "1014"},
                             {'J', "24201000"},
                             {'K', "0004 240220"},
                             {'L', "040020"},
                             {'M', "0004122420"},
                             {'N', "00042024"},
                             {'O', "0004242000"},
                             {'P', "0004242202"},
                             {'R', "0004242202 1220"},
                             {'S', "2404022220 2000"},
                             {'T', "0424 1410"},
                             {'U', "04002024"},
                             {'V', "041024"},
                             {'W', "0400122024"},
                             {'X', "0024 0420"},
                             {'Y', "0412 2412 1210"},
                             {'Z', "04240020"}};

std::string_view strokes_of(char letter) {
  for (const Glyph& glyph : kGlyphs)
    if (glyph.letter == letter) return glyph.strokes;
  throw Error(std::string("The neon font has no letter '") + letter + "'.");
}

vec3 grid_point(char column, char row) {
  return vec3(static_cast<float>(column - '0') * kLetterWidth / 2, static_cast<float>(row - '0') / 4, 0);
}

void add_letter(MeshBuilder& builder, char letter, vec3 corner, float height) {
  const std::string_view strokes = strokes_of(letter);
  for (std::size_t i = 0; i + 3 < strokes.size(); i += 2) {
    if (strokes[i] == ' ') ++i;
    if (strokes[i + 2] == ' ') continue;
    const vec3 a = corner + height * grid_point(strokes[i], strokes[i + 1]);
    const vec3 b = corner + height * grid_point(strokes[i + 2], strokes[i + 3]);
    const float radius = kTubeRadius * height;
    const vec3 gap = 1.2f * radius * glm::normalize(b - a);  // neighbouring strokes do not interpenetrate
    builder.cylinder(a + gap, b - gap, radius, radius, kTubeSides);
  }
}

}  // namespace

void add_neon_word(MeshBuilder& builder, std::string_view word, vec3 corner, float height, bool stacked) {
  const float lines = static_cast<float>(word.size());
  for (std::size_t i = 0; i < word.size(); ++i) {
    const float at = static_cast<float>(i);
    const vec3 offset =
        stacked ? vec3(0, (lines - 1 - at) * kLineHeight, 0) : vec3(at * kLetterAdvance, 0, 0);
    add_letter(builder, word[i], corner + height * offset, height);
  }
}

vec2 neon_word_size(std::string_view word, float height, bool stacked) {
  const float count = static_cast<float>(word.size());
  return height * (stacked ? vec2(kLetterWidth, (count - 1) * kLineHeight + 1)
                           : vec2((count - 1) * kLetterAdvance + kLetterWidth, 1));
}

}  // namespace lumigrove::builtin
