# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
#
# Installs the library of BUILD below PLACE, compiles SOURCE against it as a user would, and runs what comes out.
file(REMOVE_RECURSE ${PLACE})
set(prefix ${PLACE}/prefix)
function(run)
  execute_process(COMMAND ${ARGN} COMMAND_ECHO STDOUT COMMAND_ERROR_IS_FATAL ANY)
endfunction()

run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${prefix})
file(GLOB_RECURSE python_files ${prefix}/*.so)
if(python_files)
  message(FATAL_ERROR "The library was to be installed alone, and with it came ${python_files}")
endif()

run(${CMAKE_COMMAND} -S ${SOURCE} -B ${PLACE}/build -DCMAKE_PREFIX_PATH=${prefix} -DCMAKE_CXX_COMPILER=${COMPILER}
    -DCMAKE_BUILD_TYPE=${BUILD_TYPE} -DCMAKE_CXX_FLAGS=${FLAGS})
run(${CMAKE_COMMAND} --build ${PLACE}/build)
run(${PLACE}/build/calibrated_arm)

find_program(pkg_config pkg-config)
file(GLOB_RECURSE description ${prefix}/fastcal.pc)
cmake_path(GET description PARENT_PATH folder)
if(pkg_config)
  run(${CMAKE_COMMAND} -E env PKG_CONFIG_PATH=${folder} ${pkg_config} --print-errors --exists "fastcal = ${VERSION}")
endif()
