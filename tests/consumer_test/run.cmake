# Copyright 2026 The osdx authors.
# SPDX-License-Identifier: Apache-2.0

# Builds and runs the program of the README against osdx in four ways: installed or as a part
# of its project, static or shared, and one that uses every component; and looks at the headers
# that are installed.
#
# cmake -DBUILD_DIR=dir -DOSDX_DIR=dir -DMESH=file -DCOMPONENTS=... [-DINSTALLED_ALONE=ON] -P run.cmake
#   BUILD_DIR         a finished build, of static libraries
#   OSDX_DIR          the sources
#   MESH              what the program reads
#   COMPONENTS        those that BUILD_DIR has with what they stand on, with commas
#   INSTALLED_ALONE   what is installed from BUILD_DIR, and no build of another

cmake_minimum_required(VERSION 3.22)

# The consumer's compiler and flags are those of the build: a library with sanitizers
# links only to a program with them.
foreach(name CMAKE_GENERATOR CMAKE_BUILD_TYPE CMAKE_CXX_COMPILER CMAKE_CXX_FLAGS
        CMAKE_PREFIX_PATH)
    file(STRINGS ${BUILD_DIR}/CMakeCache.txt line REGEX "^${name}:")
    string(REPLACE "\\;" ";" line "${line}")
    string(REGEX REPLACE "^[^=]*=(.*)" "\\1" ${name} "${line}")
endforeach()

set(source ${CMAKE_CURRENT_LIST_DIR})
file(READ ${OSDX_DIR}/README.md readme)
file(READ ${source}/main.cpp program)
string(FIND "${program}" "#include" start)
string(SUBSTRING "${program}" ${start} -1 program)
string(FIND "${readme}" "${program}" found)
if(found EQUAL -1)
    message(FATAL_ERROR "README.md does not show ${source}/main.cpp")
endif()

set(scratch ${BUILD_DIR}/consumer_test)
set(or_fail COMMAND_ECHO STDOUT COMMAND_ERROR_IS_FATAL ANY)
file(REMOVE_RECURSE ${scratch})

# consume(<name> options...): configures, builds and runs the program in scratch/<name>.
function(consume name)
    execute_process(
        COMMAND ${CMAKE_COMMAND} -S ${source} -B ${scratch}/${name} -G ${CMAKE_GENERATOR}
                -DCMAKE_CXX_COMPILER=${CMAKE_CXX_COMPILER} -DCOMPONENTS=${COMPONENTS} ${ARGN}
        ${or_fail})
    execute_process(COMMAND ${CMAKE_COMMAND} --build ${scratch}/${name} ${or_fail})
    file(REMOVE ${scratch}/${name}/surface.ply)
    execute_process(
        COMMAND ${scratch}/${name}/consumer ${MESH}
        WORKING_DIRECTORY ${scratch}/${name} ${or_fail})
    if(NOT EXISTS ${scratch}/${name}/surface.ply)
        message(FATAL_ERROR "The program wrote no surface.ply")
    endif()
    execute_process(
        COMMAND ${scratch}/${name}/components
        OUTPUT_VARIABLE used OUTPUT_STRIP_TRAILING_WHITESPACE ${or_fail})
    if(NOT used STREQUAL COMPONENTS)
        message(FATAL_ERROR "of the components ${COMPONENTS} work: ${used}")
    endif()
endfunction()

execute_process(
    COMMAND ${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${scratch}/prefix ${or_fail})
# One header after the other is what takes long; sanitizers add nothing to them.
set(unity OFF)
if(CMAKE_CXX_FLAGS MATCHES "-fsanitize")
    set(unity ON)
endif()
consume(installed
    -DCMAKE_UNITY_BUILD=${unity} -DCMAKE_UNITY_BUILD_BATCH_SIZE=0
    -DCMAKE_BUILD_TYPE=${CMAKE_BUILD_TYPE} -DCMAKE_CXX_FLAGS=${CMAKE_CXX_FLAGS}
    -DOSDX_HEADERS=${scratch}/prefix/include
    "-DCMAKE_PREFIX_PATH=${scratch}/prefix;${CMAKE_PREFIX_PATH}")

# What the facade shows.
set(facade ${scratch}/facade.cpp)
file(WRITE ${facade} "#include <osdx/surface.h>\n")
execute_process(
    COMMAND ${CMAKE_CXX_COMPILER} -std=c++20 -M -I${scratch}/prefix/include ${facade}
    OUTPUT_VARIABLE closure COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL "/include/osdx/[a-z_/]+\\.h" ours "${closure}")
list(LENGTH ours n_headers)
if(n_headers EQUAL 0 OR n_headers GREATER 14)
    message(FATAL_ERROR "osdx/surface.h includes ${n_headers} headers of ours: ${ours}")
endif()
if(closure MATCHES "OpenMesh/|embree[34]/|hwy/|oneapi/tbb/")
    message(FATAL_ERROR "osdx/surface.h shows ${CMAKE_MATCH_0}")
endif()
message(STATUS "osdx/surface.h: ${n_headers} headers of ours")

if(INSTALLED_ALONE)
    return()
endif()

# A build of the library for these, as quick as can be: it is not for speed. Kernels are of the
# plainest instruction set alone.
set(as_part
    -DOSDX_SOURCE_DIR=${OSDX_DIR} -DOSDX_INSTALL=ON
    -DCMAKE_BUILD_TYPE=Debug "-DCMAKE_CXX_FLAGS=-O0 -g0 -DHWY_COMPILE_ONLY_STATIC"
    -DCMAKE_UNITY_BUILD=ON -DCMAKE_UNITY_BUILD_BATCH_SIZE=16)
consume(part ${as_part} -DBUILD_SHARED_LIBS=ON)
file(GLOB shared ${scratch}/part/osdx/libosdx.so*)
file(GLOB_RECURSE static ${scratch}/part/*.a)
if(NOT shared OR static)
    message(FATAL_ERROR "not shared: ${shared} ${static}")
endif()
file(GLOB_RECURSE others ${scratch}/part/osdx/*viewer* ${scratch}/part/osdx/*_test)
if(others)
    message(FATAL_ERROR "As a part of another project osdx builds ${others}")
endif()
execute_process(
    COMMAND ${CMAKE_COMMAND} --install ${scratch}/part --prefix ${scratch}/shared ${or_fail})
consume(installed_shared -DCMAKE_BUILD_TYPE=Debug
    "-DCMAKE_PREFIX_PATH=${scratch}/shared;${CMAKE_PREFIX_PATH}")
consume(part ${as_part} -DBUILD_SHARED_LIBS=OFF)  # links the same objects
