# Parsing {fmt}, GLM and the standard library costs more than compiling most of our own code, so these headers are
# precompiled. Not under ccache, which would then cache nothing unless told to be sloppy; every file therefore still
# includes what it uses, and a build under ccache proves it.
string(FIND "${CMAKE_CXX_COMPILER_LAUNCHER}" ccache launched_by_ccache)
if(launched_by_ccache EQUAL -1)
  set(LUMIGROVE_PRECOMPILED <algorithm> <array> <cmath> <cstdint> <filesystem> <functional> <map> <memory> <optional> <span>
      <string> <string_view> <vector> <fmt/format.h> <glm/glm.hpp>)
endif()
