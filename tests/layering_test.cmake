# Copyright 2026 The osdx authors.
# SPDX-License-Identifier: Apache-2.0

# A layer includes only itself and the layers before it, and a library that belongs to one
# layer is included by no other.
#
# cmake [-DROOT=dir] -P layering_test.cmake       checks the sources in ROOT
# cmake -DSCRATCH=dir -P layering_test.cmake      checks the check, on trees made in SCRATCH

cmake_minimum_required(VERSION 3.22)

set(layers far eval osd_ext viewer)
set(far_owns OpenMesh)
set(osd_ext_owns embree[0-9]* opensubdiv)

function(check_file file layer allowed foreign)
    file(STRINGS ${file} includes REGEX "^[ \t]*#[ \t]*include" ENCODING UTF-8)
    foreach(line IN LISTS includes)
        if((line MATCHES "include[ \t]*\"" AND NOT line MATCHES "\"(${allowed})/")
           OR line MATCHES "<(${foreign})/")
            message(SEND_ERROR "${file}: not in ${layer}: ${line}")
        endif()
    endforeach()
endfunction()

function(check_tree root)
    set(n_files 0)
    foreach(layer IN LISTS layers)
        list(APPEND allowed ${layer})
        set(foreign ${layers} ${far_owns} ${osd_ext_owns})
        list(REMOVE_ITEM foreign ${allowed} ${${layer}_owns})
        list(JOIN allowed "|" allowed_pattern)
        list(JOIN foreign "|" foreign_pattern)

        file(GLOB_RECURSE files ${root}/${layer}/*.h ${root}/${layer}/*.cpp)
        if(NOT files)
            message(SEND_ERROR "no files in ${root}/${layer}")
        endif()
        foreach(file IN LISTS files)
            check_file(${file} ${layer} "${allowed_pattern}" "${foreign_pattern}")
        endforeach()
        list(LENGTH files n)
        math(EXPR n_files "${n_files} + ${n}")
    endforeach()
    message(STATUS "layering: ${n_files} files checked")
endfunction()

# Runs the check on four files that follow the rules, with `line` added to one of them.
function(expect result layer line)
    file(REMOVE_RECURSE ${SCRATCH})
    file(WRITE ${SCRATCH}/far/mesh.h "#include <OpenMesh/Core/Mesh.hh>\n#include <vector>\n")
    file(WRITE ${SCRATCH}/eval/jet.h "#include \"far/mesh.h\"\n")
    file(WRITE ${SCRATCH}/osd_ext/scene.cpp
         "#include \"eval/jet.h\"\n#include <embree3/rtcore.h>\n#include <opensubdiv/far/x.h>\n")
    file(WRITE ${SCRATCH}/viewer/main.cpp "#include \"osd_ext/scene.h\"\n")
    if(line)
        file(WRITE ${SCRATCH}/${layer}/more.cpp "${line}\n")
    else()
        file(REMOVE_RECURSE ${SCRATCH}/${layer})
    endif()

    execute_process(COMMAND ${CMAKE_COMMAND} -DROOT=${SCRATCH} -P ${CMAKE_CURRENT_LIST_FILE}
                    RESULT_VARIABLE status OUTPUT_VARIABLE text ERROR_VARIABLE text)
    if(status EQUAL 0)
        set(seen accepted)
    else()
        set(seen refused)
    endif()
    if(NOT seen STREQUAL result)
        message(SEND_ERROR "${seen}, not ${result}: ${layer}: ${line}\n${text}")
    endif()
endfunction()

if(SCRATCH)
    expect(accepted far "#include \"far/mesh.h\"")
    expect(accepted viewer "#include <far/mesh.h>")
    expect(accepted eval "// #include \"viewer/app.h\"")
    expect(refused far "#include \"eval/jet.h\"")
    expect(refused far "  # include  <osd_ext/scene.h>")
    expect(refused eval "#include \"../osd_ext/scene.h\"")
    expect(refused osd_ext "#include \"viewer/app.h\"")
    expect(refused viewer "#include \"tests/test_meshes.h\"")
    expect(refused eval "#include <OpenMesh/Core/Mesh.hh>")
    expect(refused eval "#include <embree4/rtcore.h>")
    expect(refused viewer "#include <opensubdiv/far/primvarRefiner.h>")
    expect(refused viewer "")
    file(REMOVE_RECURSE ${SCRATCH})
    message(STATUS "layering: 12 trees checked")
else()
    if(NOT ROOT)
        set(ROOT ${CMAKE_CURRENT_LIST_DIR}/..)
    endif()
    check_tree(${ROOT})
endif()
