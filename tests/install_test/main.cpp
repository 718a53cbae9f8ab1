// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <cstdio>

#include "far/mesh_data.h"
#include "far/result.h"

int main() {
    const osdx::Result<osdx::MeshData> mesh = osdx::read_mesh("no_such_file.obj");
    if (mesh || mesh.error().code != osdx::ErrorCode::FileUnreadable) {
        std::puts("read_mesh did not report the missing file");
        return 1;
    }
    std::printf("as expected: %s\n", mesh.error().message.c_str());
    return 0;
}
