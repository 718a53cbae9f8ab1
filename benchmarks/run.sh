#!/usr/bin/env bash
# Copyright 2026 The osdx authors.
# SPDX-License-Identifier: Apache-2.0
#
# Installs what is missing, builds the benchmarks and runs them beside the peers that are found;
# the table goes to standard output, progress and checks to standard error.
#
# Usage: benchmarks/run.sh [--json FILE] [--markdown] [other options; see --help] MESH...

set -euo pipefail

root=$(cd "$(dirname "$0")/.." && pwd)
"$root/scripts/install_packages.sh" build benchmarks peers >&2
(
    cd "$root"
    cmake --preset benchmarks
    cmake --build --preset benchmarks
) >&2

if [[ " $* " == *" --markdown "* ]]; then
    model=$(sed -n 's/^model name[[:space:]]*: //p' /proc/cpuinfo | head -n 1)
    compiler=$("${CXX:-c++}" --version | head -n 1)
    echo "Machine: ${model:-unknown}, $(getconf _NPROCESSORS_ONLN) cores, $compiler."
    echo
fi
exec "$root/build/benchmarks/benchmarks/osdx_benchmarks" "$@"
