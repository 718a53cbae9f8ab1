# Copyright 2026 The osdx authors.
# SPDX-License-Identifier: Apache-2.0

# Installs a build to a scratch prefix, then configures, builds and runs the program of the
# README, which finds osdx there.
#
# cmake -DBUILD_DIR=dir -DSOURCE_DIR=dir -DREADME=file -DMESH=file -P run.cmake
#   BUILD_DIR   a finished build
#   SOURCE_DIR  the folder of the consumer, this one
#   README      shows main.cpp below its head
#   MESH        what the program reads

cmake_minimum_required(VERSION 3.22)

# The consumer's compiler and flags are those of the build: a library with sanitizers
# links only to a program with them.
foreach(name CMAKE_GENERATOR CMAKE_BUILD_TYPE CMAKE_CXX_COMPILER CMAKE_CXX_FLAGS
        CMAKE_PREFIX_PATH)
    file(STRINGS ${BUILD_DIR}/CMakeCache.txt line REGEX "^${name}:")
    string(REPLACE "\\;" ";" line "${line}")
    string(REGEX REPLACE "^[^=]*=(.*)" "\\1" ${name} "${line}")
endforeach()

file(READ ${README} readme)
file(READ ${SOURCE_DIR}/main.cpp program)
string(FIND "${program}" "#include" start)
string(SUBSTRING "${program}" ${start} -1 program)
string(FIND "${readme}" "${program}" found)
if(found EQUAL -1)
    message(FATAL_ERROR "${README} does not show ${SOURCE_DIR}/main.cpp")
endif()

set(scratch ${BUILD_DIR}/install_test)
set(or_fail COMMAND_ECHO STDOUT COMMAND_ERROR_IS_FATAL ANY)
file(REMOVE_RECURSE ${scratch})
execute_process(
    COMMAND ${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${scratch}/prefix ${or_fail})
execute_process(
    COMMAND ${CMAKE_COMMAND} -S ${SOURCE_DIR} -B ${scratch}/build -G ${CMAKE_GENERATOR}
            -DCMAKE_BUILD_TYPE=${CMAKE_BUILD_TYPE}
            -DCMAKE_CXX_COMPILER=${CMAKE_CXX_COMPILER}
            -DCMAKE_CXX_FLAGS=${CMAKE_CXX_FLAGS}
            "-DCMAKE_PREFIX_PATH=${scratch}/prefix;${CMAKE_PREFIX_PATH}"
    ${or_fail})
execute_process(COMMAND ${CMAKE_COMMAND} --build ${scratch}/build ${or_fail})
execute_process(
    COMMAND ${scratch}/build/consumer ${MESH} WORKING_DIRECTORY ${scratch} ${or_fail})
if(NOT EXISTS ${scratch}/surface.ply)
    message(FATAL_ERROR "The program wrote no surface.ply")
endif()
