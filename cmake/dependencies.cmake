# Libraries, all Debian 12 packages (scripts/install-dependencies.sh installs them).
find_package(glm REQUIRED)
find_package(TBB REQUIRED)
find_package(embree 3 REQUIRED)
find_package(assimp REQUIRED)
find_package(ZLIB REQUIRED)
find_package(fmt REQUIRED)
find_package(spdlog REQUIRED)
find_package(CLI11 REQUIRED)
find_package(nlohmann_json REQUIRED)
find_path(TINYGLTF_INCLUDE_DIR tiny_gltf.h REQUIRED)  # compiled into the library, see src/scene/tinygltf.h
find_path(TOMLPP_INCLUDE_DIR toml++/toml.h REQUIRED)

# OpenImageIO pulls in Imath, whose CMake package lists a Python library that Debian ships separately and that nobody
# here links; its status message about the absent file would look like an error of ours.
block()
  set(CMAKE_MESSAGE_LOG_LEVEL NOTICE)
  find_package(OpenImageIO REQUIRED)
endblock()
# Its target also lists OpenCV's headers, which only imagebufalgo_opencv.h needs and which need not be installed.
get_target_property(openimageio_headers OpenImageIO::OpenImageIO INTERFACE_INCLUDE_DIRECTORIES)
list(FILTER openimageio_headers EXCLUDE REGEX opencv)
set_target_properties(OpenImageIO::OpenImageIO PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${openimageio_headers}"
                      INTERFACE_SYSTEM_INCLUDE_DIRECTORIES "")

# What the static library must be linked with; lumigrove-config.cmake finds the same packages.
set(LUMIGROVE_LINKED_LIBRARIES TBB::tbb embree assimp::assimp ZLIB::ZLIB OpenImageIO::OpenImageIO fmt::fmt
    spdlog::spdlog)

# For everything built here. Third-party headers are system headers: their warnings are not ours.
add_library(lumigrove_dependencies INTERFACE)
target_link_libraries(lumigrove_dependencies INTERFACE ${LUMIGROVE_LINKED_LIBRARIES} nlohmann_json::nlohmann_json)
target_include_directories(lumigrove_dependencies SYSTEM INTERFACE ${TINYGLTF_INCLUDE_DIR} ${TOMLPP_INCLUDE_DIR})
