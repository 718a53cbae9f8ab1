#!/usr/bin/env bash
# Copyright 2026 The osdx authors.
# SPDX-License-Identifier: Apache-2.0
#
# Installs what is missing of the packages that osdx needs, and says before which ones and how much
# that is; names are those of Debian 12.
# Where it cannot install, it says what is needed and leaves the verdict to CMake.
#
# Usage: scripts/install_packages.sh [build | format | clang | benchmarks | peers]...
#   build       to build, run and test (the default)
#   format      to check the format of the sources
#   clang       to build with Clang as well, and with sanitizers
#   benchmarks  to build the benchmarks
#   peers       what they measure beside the libraries that osdx itself uses

set -euo pipefail

build=(g++ cmake ninja-build pkg-config
    libopenmesh-dev libglm-dev libtbb-dev libhwy-dev libeigen3-dev libfmt-dev
    libembree-dev libosd-dev
    libcli11-dev nlohmann-json3-dev libtinygltf-dev libpng-dev libstb-dev
    libgtest-dev)
format=(clang-format-14)
clang=(clang-14 libclang-rt-14-dev lld-14)
benchmarks=(libbenchmark-dev)
peers=(libcgal-dev)

# Fails when there is no use in going on to CMake.
by_hand() {
    cat >&2 <<'END'
osdx is built with a C++20 compiler (GCC 12, Clang 14 or newer), CMake 3.22, Ninja and
pkg-config, from these libraries:
  GLM, oneTBB, Highway, Eigen 3, fmt, CLI11, nlohmann-json, tinygltf, libpng, stb,
  GoogleTest for the tests; OpenMesh for its meshes, Embree 3 or 4 to trace rays and
  OpenSubdiv 3.5 to compare.
Once they are installed, from the folder of the sources:
  cmake --preset release && cmake --build --preset release && ctest --preset release
CMAKE_PREFIX_PATH tells CMake of libraries in unusual places.
END
    local tool status=0
    for tool in "${CXX:-c++}" cmake ninja; do
        if ! command -v "$tool" >/dev/null; then
            echo "Missing: $tool" >&2
            status=1
        fi
    done
    return "$status"
}

wanted=()
for group in "${@:-build}"; do
    case $group in
        build) wanted+=("${build[@]}") ;;
        format) wanted+=("${format[@]}") ;;
        clang) wanted+=("${clang[@]}") ;;
        benchmarks) wanted+=("${benchmarks[@]}") ;;
        peers) wanted+=("${peers[@]}") ;;
        *)
            echo "usage: $0 [build | format | clang | benchmarks | peers]..." >&2
            exit 2
            ;;
    esac
done

if ! command -v apt-get >/dev/null || ! command -v dpkg-query >/dev/null; then
    echo "There is no apt-get here, so nothing is installed." >&2
    by_hand
    exit
fi

installed=$(dpkg-query -W -f '${Package} ${db:Status-Status}\n' "${wanted[@]}" 2>/dev/null ||
    true)
missing=()
for package in "${wanted[@]}"; do
    grep -qxF "$package installed" <<<"$installed" || missing+=("$package")
done
if [[ ${#missing[@]} == 0 ]]; then
    exit
fi

as_root=(env DEBIAN_FRONTEND=noninteractive LC_ALL=C)
if [[ $(id -u) != 0 ]]; then
    as_root=(sudo "${as_root[@]}")
fi
apt_install=("${as_root[@]}" apt-get -q -o DPkg::Lock::Timeout=60 -o Dpkg::Use-Pty=0
    install --no-install-recommends)

# What apt-get would do, by its own figures.
forecast() {
    "${apt_install[@]}" --print-uris "${missing[@]}" </dev/null 2>/dev/null |
        grep -E '^([0-9]+ upgraded|Need to get|After this operation)' || true
}

# Reads apt-get's report and says after every 20 packages how far it is.
progress() {
    local line downloaded=0 unpacked=0 ready=0
    tell() {
        if (($2 % 20 == 0)); then
            echo "  $2 packages $1"
        fi
    }
    while IFS= read -r line; do
        case $line in
            Get:*) tell downloaded $((downloaded += 1)) ;;
            Unpacking\ *) tell unpacked $((unpacked += 1)) ;;
            Setting\ up\ *) tell "set up" $((ready += 1)) ;;
        esac
    done
    echo "  $ready packages set up"
}

if command -v "${as_root[0]}" >/dev/null; then
    echo "Missing: ${missing[*]}"
    echo "Reading the lists of packages"
    # An update can fail for a source that has nothing to do with these packages.
    "${as_root[@]}" apt-get -qq update </dev/null || true
    echo "To install, with what they depend on and without what they recommend:"
    forecast | sed 's/^/  /'
    if "${apt_install[@]}" -y "${missing[@]}" </dev/null | progress; then
        exit
    fi
fi
echo "Not installed. As root: apt-get install --no-install-recommends ${missing[*]}" >&2
by_hand
