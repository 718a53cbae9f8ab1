# Copyright 2026 The osdx authors.
# SPDX-License-Identifier: Apache-2.0

# Finds the CPU library of OpenSubdiv 3.5 or later (Bfr is needed) and gives the target
# OpenSubdiv::osdCPU. Used instead of OpenSubdiv's own package file, which in some packages
# names a static library that is not shipped and then fails.
find_path(OpenSubdivCPU_INCLUDE_DIR opensubdiv/bfr/refinerSurfaceFactory.h)
find_library(OpenSubdivCPU_LIBRARY osdCPU)
mark_as_advanced(OpenSubdivCPU_INCLUDE_DIR OpenSubdivCPU_LIBRARY)

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(OpenSubdivCPU
    REQUIRED_VARS OpenSubdivCPU_LIBRARY OpenSubdivCPU_INCLUDE_DIR)

if(OpenSubdivCPU_FOUND AND NOT TARGET OpenSubdiv::osdCPU)
    add_library(OpenSubdiv::osdCPU UNKNOWN IMPORTED)
    set_target_properties(OpenSubdiv::osdCPU PROPERTIES
        IMPORTED_LOCATION ${OpenSubdivCPU_LIBRARY}
        INTERFACE_INCLUDE_DIRECTORIES ${OpenSubdivCPU_INCLUDE_DIR})
endif()
