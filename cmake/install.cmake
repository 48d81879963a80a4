# `cmake --install` makes a tree in which find_package(lumigrove) gives lumigrove::lumigrove.
include(CMakePackageConfigHelpers)
set(LUMIGROVE_CONFIG_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/lumigrove)

install(TARGETS lumigrove EXPORT lumigrove-targets)
install(DIRECTORY include/lumigrove DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(FILES LICENSE README.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(EXPORT lumigrove-targets NAMESPACE lumigrove:: DESTINATION ${LUMIGROVE_CONFIG_DIR})

configure_package_config_file(cmake/lumigrove-config.cmake.in lumigrove-config.cmake
                              INSTALL_DESTINATION ${LUMIGROVE_CONFIG_DIR}
                              NO_SET_AND_CHECK_MACRO)
# Before 1.0 every minor version may change the API.
write_basic_package_version_file(lumigrove-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/lumigrove-config.cmake ${CMAKE_CURRENT_BINARY_DIR}/lumigrove-config-version.cmake
        DESTINATION ${LUMIGROVE_CONFIG_DIR})
