# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
#
# The core as a library for C++ programs: headers, libfastcal.a, the CMake package fastcal and fastcal.pc.
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)

add_library(fastcal_archive STATIC $<TARGET_OBJECTS:fastcal_core>)
target_include_directories(fastcal_archive INTERFACE $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
target_link_libraries(fastcal_archive PUBLIC Eigen3::Eigen Threads::Threads PRIVATE Ceres::ceres urdfdom::urdfdom_model)
target_compile_features(fastcal_archive PUBLIC cxx_std_20)
set_target_properties(fastcal_archive PROPERTIES OUTPUT_NAME fastcal EXPORT_NAME archive LINKER_LANGUAGE CXX)

set(package ${CMAKE_INSTALL_LIBDIR}/cmake/fastcal)
install(TARGETS fastcal_archive EXPORT fastcal ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(EXPORT fastcal NAMESPACE fastcal:: FILE fastcalTargets.cmake DESTINATION ${package})
install(DIRECTORY fastcal DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN "*.hpp"
        PATTERN precompiled.hpp EXCLUDE)
configure_package_config_file(fastcalConfig.cmake.in fastcalConfig.cmake INSTALL_DESTINATION ${package})
write_basic_package_version_file(fastcalConfigVersion.cmake COMPATIBILITY SameMinorVersion)
configure_file(fastcal.pc.in fastcal.pc @ONLY)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/fastcalConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/fastcalConfigVersion.cmake
        DESTINATION ${package})
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/fastcal.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
