# What `cmake --install` leaves: the archives of the library and its ports, the headers, a CMake package for
# find_package(pflight) and a file for pkg-config. Both find their files from where they stand, so the tree may be moved.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/pflight)
set(pkgconfig_dir ${CMAKE_INSTALL_LIBDIR}/pkgconfig)

get_property(ports GLOBAL PROPERTY PFLIGHT_PORTS)
install(TARGETS pflight ${ports} EXPORT pflight ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
  INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(FILES ${PFLIGHT_LIB_HEADERS} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/pflight)
install(EXPORT pflight NAMESPACE pflight:: FILE pflightTargets.cmake DESTINATION ${package_dir})

configure_package_config_file(tools/package/pflightConfig.cmake.in ${PROJECT_BINARY_DIR}/pflightConfig.cmake
  INSTALL_DESTINATION ${package_dir})
# Before 1.0 a minor version may change the interface: 0.1 does not serve who asks for 0.2.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/pflightConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/pflightConfig.cmake ${PROJECT_BINARY_DIR}/pflightConfigVersion.cmake
  DESTINATION ${package_dir})

set(PFLIGHT_PKGCONFIG_PORT null)
if(TARGET pflight_port_posix)
  set(PFLIGHT_PKGCONFIG_PORT posix)
endif()
file(RELATIVE_PATH PFLIGHT_PKGCONFIG_PREFIX /prefix/${pkgconfig_dir} /prefix)
configure_file(tools/package/pflight.pc.in ${PROJECT_BINARY_DIR}/pflight.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/pflight.pc DESTINATION ${pkgconfig_dir})
