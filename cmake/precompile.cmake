# Parsing {fmt}, GLM and the standard library costs more than compiling most of our own code, so these headers are
# precompiled. Not under ccache, which would then cache nothing unless told to be sloppy; every file therefore still
# includes what it uses, and a build under ccache proves it.
string(FIND "${CMAKE_CXX_COMPILER_LAUNCHER}" ccache launched_by_ccache)
function(lumigrove_precompile target)
  if(launched_by_ccache EQUAL -1)
    target_precompile_headers(${target} PRIVATE <algorithm> <array> <cmath> <cstdint> <filesystem> <functional> <map> <memory>
                              <optional> <span> <string> <string_view> <vector> <fmt/format.h> <glm/glm.hpp> ${ARGN})
  endif()
endfunction()
