#include LUMIGROVE_COMMIT_HEADER  // written by cmake/write_commit.cmake
#include "lumigrove/renderer.h"

namespace lumigrove {

const char* version() { return LUMIGROVE_VERSION; }
const char* commit() { return LUMIGROVE_COMMIT; }

}  // namespace lumigrove
