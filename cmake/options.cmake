# Compile options of every target of this project; never exported to users of the library.
add_library(lumigrove_options INTERFACE)
target_compile_options(lumigrove_options INTERFACE
  -march=${LUMIGROVE_ARCH}
  -fno-math-errno -fno-trapping-math -fno-tree-slp-vectorize      # let loops over children vectorise; NaN and infinity keep their meaning
  -Wno-psabi -Wall -Wextra -Wshadow -Wconversion -Wno-sign-conversion
  $<$<BOOL:${LUMIGROVE_WERROR}>:-Werror>)
if(LUMIGROVE_SANITIZE)
  target_compile_options(lumigrove_options INTERFACE -fsanitize=address,undefined -fno-sanitize-recover=undefined -fno-omit-frame-pointer
                         -Wno-maybe-uninitialized)  # false alarms inside std::regex once it is instrumented
  target_link_options(lumigrove_options INTERFACE -fsanitize=address,undefined)
endif()
