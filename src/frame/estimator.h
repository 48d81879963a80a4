// What the image of a method converges to: what the headers of src/methods say of their estimators, for whole settings.
#pragma once

#include <cstdint>
#include <string>

#include "lumigrove/settings.h"

namespace lumigrove {

enum class Bias : std::uint8_t {
  kUnbiased,    // the mean over all seeds is right, whatever the number of samples
  kConsistent,  // the mean is right only after many samples
  kBiased       // it is wrong, whatever the number of samples
};

// `kind` is about the light that is asked for; where that is less than all light, `reason` says so too.
struct EstimatorLabel {
  Bias kind = Bias::kUnbiased;
  std::string reason;  // short sentences with "; " between them, those of `kind` first; may be empty
};

// For any settings that pass `check`.
EstimatorLabel estimator_label(const Settings& settings);

const char* bias_name(Bias kind);  // "unbiased"
// "unbiased", or with its reason: "biased: clamp leaves out light near VPLs".
std::string estimator_text(const EstimatorLabel& label);

}  // namespace lumigrove
