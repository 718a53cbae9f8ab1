#!/usr/bin/env bash
# Copyright 2026 The osdx authors.
# SPDX-License-Identifier: Apache-2.0
#
# From a fresh clone to pictures: installs what is missing, having said what and how much, builds,
# and runs the demo. Arguments go to `osdx demo`.

set -euo pipefail

root=$(cd "$(dirname "$0")" && pwd)

echo "1/3 Packages: what is missing is installed"
"$root/scripts/install_packages.sh" build

echo "2/3 Build: the program osdx in build/release"
(
    cd "$root"
    cmake --preset release
    NINJA_STATUS="[%f of %t, %e s] " cmake --build --preset release --target osdx_program
)

echo "3/3 Demo"
"$root/build/release/viewer/osdx" demo --out "$root/demo" "$@"
echo "The pictures are in $root/demo"
