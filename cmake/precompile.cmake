# Parsing {fmt}, GLM and the standard library, and making the same templates of JSON and CLI11 in every file, costs more
# than compiling most of our own code. Two remedies, neither of them under ccache: with precompiled headers it would cache
# nothing unless told to be sloppy, and single files suit it better. Every file therefore still includes what it uses, and
# a build under ccache proves it.
string(FIND "${CMAKE_CXX_COMPILER_LAUNCHER}" ccache launched_by_ccache)
option(LUMIGROVE_UNITY "Without ccache, compile some files together: quicker, unless few of them change" ON)

function(lumigrove_precompile target)
  if(launched_by_ccache EQUAL -1)
    target_precompile_headers(${target} PRIVATE <algorithm> <array> <cmath> <cstdint> <filesystem> <functional> <map> <memory>
                              <optional> <span> <string> <string_view> <vector> <fmt/format.h> <glm/glm.hpp> ${ARGN})
  endif()
endfunction()

# Compiles `size` files of the target as one. For code whose speed matters little: what can be inlined depends on it.
function(lumigrove_unity target size)
  if(LUMIGROVE_UNITY AND launched_by_ccache EQUAL -1)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${size})
  endif()
endfunction()

# Compiles these files of the target as one; all that are in no such group alone. `group` is only a name. They must not
# use a name of their anonymous namespaces for two things.
function(lumigrove_unite target group)
  if(LUMIGROVE_UNITY AND launched_by_ccache EQUAL -1)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
    set_source_files_properties(${ARGN} PROPERTIES UNITY_GROUP ${group})
  endif()
endfunction()
