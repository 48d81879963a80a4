// Every failure inside Lumigrove is one exception with one sentence that names the file or option at fault.
#pragma once

#include <stdexcept>

namespace lumigrove {

class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace lumigrove
