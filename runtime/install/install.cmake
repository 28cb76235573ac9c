# SPDX-License-Identifier: Apache-2.0
# What `cmake --install` puts where. Components are the Debian packages that ./dev package makes:
# libhapsix0, libhapsix-io0, libhapsix-dev and hapsix.
include(CMakePackageConfigHelpers)
set(config ${CMAKE_INSTALL_LIBDIR}/cmake/hapsix)

install(TARGETS hapsix_engine EXPORT hapsix_engine
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT libhapsix0 NAMELINK_COMPONENT libhapsix-dev)
install(TARGETS hapsix_engine_static EXPORT hapsix_engine
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT libhapsix-dev)
install(EXPORT hapsix_engine NAMESPACE hapsix:: DESTINATION ${config} FILE hapsixEngine.cmake
  COMPONENT libhapsix-dev)

set(headers ${PROJECT_SOURCE_DIR}/runtime/include/hapsix)
install(FILES ${headers}/base.h ${headers}/batch.h ${headers}/device.h ${headers}/device_plugin.h ${headers}/hapsix.h
  ${headers}/hapsix.hpp ${headers}/types.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/hapsix COMPONENT libhapsix-dev)

configure_package_config_file(hapsixConfig.cmake.in ${CMAKE_CURRENT_BINARY_DIR}/hapsixConfig.cmake
  INSTALL_DESTINATION ${config})
# Before 1.0 a minor version may break a program.
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/hapsixConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/hapsixConfig.cmake
  ${CMAKE_CURRENT_BINARY_DIR}/hapsixConfigVersion.cmake DESTINATION ${config} COMPONENT libhapsix-dev)
file(RELATIVE_PATH to_prefix /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
set(highway)
if(H6_HIGHWAY)
  set(highway "-lhwy ")
endif()
configure_file(hapsix.pc.in hapsix.pc @ONLY)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/hapsix.pc
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT libhapsix-dev)
include(package.cmake)
