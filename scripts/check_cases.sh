#!/usr/bin/env bash
# Copyright 2026 The osdx authors.
# SPDX-License-Identifier: Apache-2.0
#
# Runs every mesh, address file and control net of a folder through all subcommands, and prints a
# row for each: the statuses, in the order of the heading, and what a refusal says. Fails on
# crashes, statuses other than 0 and 1, refusals of more or less than one line, files that a
# refused call leaves, numbers that are not finite, and calls that take over two minutes.
#
# Usage: scripts/check_cases.sh FOLDER [OSDX]
# OSDX: the built program; without it that of the release preset, which is built.

set -euo pipefail

folder=${1:?usage: scripts/check_cases.sh FOLDER [OSDX]}
if [[ $# -gt 1 ]]; then
    osdx=$(realpath "$2")
else
    root=$(cd "$(dirname "$0")/.." && pwd)
    (cd "$root" && cmake --preset release && cmake --build --preset release --target osdx_program) >&2
    osdx=$root/build/release/viewer/osdx
fi
list=$(find "$(realpath "$folder")" -type f \
    \( -name '*.obj' -o -name '*.off' -o -name '*.ply' -o -name '*.json' \))
mapfile -t files < <(sort <<<"$list")
if [[ -z $list ]]; then
    echo "check_cases: no files in $folder" >&2
    exit 2
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
printf 'face,u,v\n0,0.25,0.5\n0,0,0\n' >at.csv
n_failed=0

# call OUT ARGS: one subcommand; adds to `statuses`, `said` and `faults`.
call() {
    local out=$1 status=0
    shift
    rm -rf out.* report.json
    timeout 120 "$osdx" "$@" --json report.json >stdout 2>stderr || status=$?
    statuses+=" $status"
    local lines
    lines=$(grep -cv '^osdx: warning: ' stderr || true)
    case $status in
        0) [[ -z $out || -s $out ]] || faults+=("$1: no output") ;;
        1)
            said=$(grep -v '^osdx: warning: ' stderr | head -1)
            [[ $lines == 1 && $said == 'osdx: '* ]] || faults+=("$1: $lines lines: $said")
            [[ -z $out || ! -e $out ]] || faults+=("$1: leaves a file")
            ;;
        *) faults+=("$*: status $status: $(head -c 200 stderr | head -1)") ;;
    esac
    local text=()
    [[ $out == *.obj || $out == *.csv || $out == *.json ]] && [[ -e $out ]] && text+=("$out")
    [[ -e report.json ]] && text+=(report.json)
    if [[ ${#text[@]} != 0 ]] && grep -Eiqw -e '-?(nan|inf|infinity)|null' "${text[@]}"; then
        faults+=("$1: not finite: $(grep -Eiwm1 -e '-?(nan|inf|infinity)|null' "${text[@]}" | head -1)")
    fi
}

echo "info, tessellate 3 4 gregory, subdivide 3 4, eval, compare 3 gregory, render, info --repair"
for file in "${files[@]}"; do
    statuses='' said='' faults=()
    if [[ $file == *.json ]]; then
        call out.json patch "$file" --out out.json
    else
        call '' info "$file"
        call out.obj tessellate "$file" --rate 3 --out out.obj
        call out.obj tessellate "$file" --degree 4 --rate 2 --out out.obj
        call out.obj tessellate "$file" --patch gregory --rate 2 --out out.obj
        call out.obj subdivide "$file" --levels 1 --out out.obj
        call out.obj subdivide "$file" --degree 4 --levels 1 --out out.obj
        call out.csv eval "$file" --at at.csv --out out.csv
        call '' compare "$file" --rate 2
        call '' compare "$file" --rate 2 --patch gregory
        call out.png render "$file" --size 64 48 --out out.png
        call '' info "$file" --repair
    fi
    printf '%-48s%s %s\n' "$(basename "$file")" "$statuses" "${said#osdx: }"
    for fault in ${faults[@]+"${faults[@]}"}; do
        printf '    FAULT %s\n' "$fault"
        n_failed=$((n_failed + 1))
    done
done
echo "${#files[@]} files, $n_failed faults"
[[ $n_failed == 0 ]]
