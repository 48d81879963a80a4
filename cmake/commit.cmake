# Bakes the commit into the library (receipts name it); looked up at every build, not only when CMake runs.
set(LUMIGROVE_COMMIT_HEADER ${PROJECT_BINARY_DIR}/generated/lumigrove_commit.h)
add_custom_target(lumigrove_commit
  COMMAND ${CMAKE_COMMAND} -DSOURCE=${PROJECT_SOURCE_DIR} -DOUTPUT=${LUMIGROVE_COMMIT_HEADER}
          -P ${PROJECT_SOURCE_DIR}/cmake/write_commit.cmake
  BYPRODUCTS ${LUMIGROVE_COMMIT_HEADER} COMMENT "Looking up the commit" VERBATIM)
add_dependencies(lumigrove_io lumigrove_commit)
set_property(SOURCE ${PROJECT_SOURCE_DIR}/src/frame/version.cpp APPEND PROPERTY COMPILE_DEFINITIONS
             LUMIGROVE_VERSION="${PROJECT_VERSION}" LUMIGROVE_COMMIT_HEADER="${LUMIGROVE_COMMIT_HEADER}")
