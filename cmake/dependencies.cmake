# Libraries, all Debian 12 packages (scripts/install-dependencies.sh installs them).
find_package(glm REQUIRED)
find_package(TBB REQUIRED)
find_package(embree 3 REQUIRED)
find_package(assimp REQUIRED)
find_package(OpenImageIO REQUIRED)
find_package(fmt REQUIRED)
find_package(spdlog REQUIRED)
find_package(CLI11 REQUIRED)
find_package(nlohmann_json REQUIRED)
find_path(TINYGLTF_INCLUDE_DIR tiny_gltf.h REQUIRED)
find_path(TOMLPP_INCLUDE_DIR toml++/toml.h REQUIRED)

# Third-party headers are system headers: their warnings are not ours.
add_library(lumigrove_dependencies INTERFACE)
target_link_libraries(lumigrove_dependencies INTERFACE TBB::tbb embree assimp::assimp OpenImageIO::OpenImageIO
                      fmt::fmt spdlog::spdlog nlohmann_json::nlohmann_json)
target_include_directories(lumigrove_dependencies SYSTEM INTERFACE ${TINYGLTF_INCLUDE_DIR} ${TOMLPP_INCLUDE_DIR})
