#!/usr/bin/env bash
# Copyright 2026 The osdx authors.
# SPDX-License-Identifier: Apache-2.0
#
# Builds the surfaces of all meshes of folders at degrees 2 to 5, each mesh in a process of its
# own, and prints a row for each: patches, gap over the diagonal, normal jump in degrees,
# curvature jump, and distance of borders and creases from their B-spline curves. Fails on jumps (the limits stand in tests/mesh_check.cpp), values that are no
# number, crashes, and meshes that take over two minutes. Refusals are listed and counted.
#
# Usage: scripts/check_meshes.sh FOLDER... [-- MESH_CHECK]
# MESH_CHECK: the built tests/mesh_check; without it the release preset is built.

set -euo pipefail

folders=()
while [[ $# != 0 && $1 != -- ]]; do
    folders+=("$1")
    shift
done
if [[ ${#folders[@]} == 0 ]]; then
    echo "usage: scripts/check_meshes.sh FOLDER... [-- MESH_CHECK]" >&2
    exit 2
fi
if [[ $# == 2 ]]; then
    check=$2
else
    root=$(cd "$(dirname "$0")/.." && pwd)
    (cd "$root" && cmake --preset release && cmake --build --preset release --target mesh_check) >&2
    check=$root/build/release/tests/mesh_check
fi

# Fills `files` here and not in a pipe, so that a folder that is not there ends the script.
list=$(find "${folders[@]}" -name '*.obj' -o -name '*.off' -o -name '*.ply')
mapfile -t files < <(sort <<<"$list")
if [[ -z $list ]]; then
    echo "check_meshes: no meshes in ${folders[*]}" >&2
    exit 2
fi

well=0 refused=0 failed=()
for file in "${files[@]}"; do
    status=0
    timeout 120 "$check" "$file" || status=$?
    case $status in
        0) well=$((well + 1)) ;;
        3) refused=$((refused + 1)) ;;
        1) failed+=("$file") ;;
        124)
            echo " FAILED: takes over two minutes"
            failed+=("$file")
            ;;
        *)
            echo " FAILED: crash, status $status"
            failed+=("$file")
            ;;
    esac
done
echo "${#files[@]} meshes: $well well, $refused refused at some degree, ${#failed[@]} failed"
if [[ ${#failed[@]} != 0 ]]; then
    printf '  %s\n' "${failed[@]}"
    exit 1
fi
