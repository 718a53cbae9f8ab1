#!/usr/bin/env bash
# Copyright 2026 The osdx authors.
# SPDX-License-Identifier: Apache-2.0
#
# Writes hashes of all that a build computes, a line each and sorted: of the library by
# tests/fingerprint, and of the files, pictures and refusals of the program. Two builds that
# differ in no bit write the same file:
#
#   scripts/fingerprint.sh build/before before.txt meshes
#   scripts/fingerprint.sh build/after after.txt meshes
#   diff before.txt after.txt
#
# On one machine: kernels are chosen by its instruction set. JOBS meshes run at the same time, by
# default one for each core. PICTURES=no leaves out the pictures, which take most of the time.
#
# Usage: scripts/fingerprint.sh BUILD_DIR OUT.txt [FOLDER_OR_MESH]...
# The bundled meshes come first. No two meshes may have the same file name.

set -euo pipefail

if [[ $# -lt 2 ]]; then
    echo "usage: scripts/fingerprint.sh BUILD_DIR OUT.txt [FOLDER_OR_MESH]..." >&2
    exit 2
fi
root=$(cd "$(dirname "$0")/.." && pwd)
build=$(realpath "$1")
out=$2
shift 2
export fingerprint=$build/tests/fingerprint osdx=$build/viewer/osdx
for program in "$fingerprint" "$osdx"; do
    if [[ ! -x $program ]]; then
        echo "fingerprint: $program is not built" >&2
        exit 2
    fi
done

# Fills `files` here and not in a pipe, so that a folder that is not there ends the script.
list=$(find "$root/assets" "$@" -name '*.obj' -o -name '*.off' -o -name '*.ply')
mapfile -t files < <(sort <<<"$list" | xargs -d '\n' realpath)
twice=$(printf '%s\n' "${files[@]}" | sort -u | sed 's:.*/::' | sort | uniq -d)
if [[ -n $twice ]]; then
    echo "fingerprint: several meshes of the name $twice" >&2
    exit 2
fi

digest() {
    sha256sum <"$1" | cut -c1-16
}

# run THING FILE ARGS...: a line for the FILE that a subcommand writes, or for its refusal.
run() {
    local thing=$1 file=$2 status=0
    shift 2
    "$osdx" "$@" >stdout 2>stderr || status=$?
    if [[ $status == 0 ]]; then
        echo "$name osdx $thing $(digest "$file")"
    else
        echo "$name osdx $thing status=$status $(digest stderr)"
    fi
}

# Some points of some faces.
addresses() {
    awk -v n="$1" 'BEGIN {
        print "face,u,v"
        for (f = 0; f < n; f += int((n + 39) / 40))
            print f ",0,0\n" f ",0.25,0.75\n" f ",0.5,0.5\n" f ",1,0.125"
    }'
}

pictures() {
    local shade size=(--size 160 120)
    for shade in phong normals reflection mean gauss patches; do
        run "render d=3 $shade" o.png render "$name" "${size[@]}" --shade $shade --out o.png
        run "render d=4 $shade" o.png \
            render "$name" "${size[@]}" --degree 4 --shade $shade --out o.png
        run "render gregory $shade" o.png \
            render "$name" "${size[@]}" --patch gregory --shade $shade --out o.png
    done
    if grep -q '^vt' "$name"; then
        run "render checker" o.png \
            render "$name" "${size[@]}" --shade checker --uv-rule boundaries --out o.png
    fi
}

refined() {
    local d level
    for d in 2 3 4 5; do
        for level in 1 2; do
            run "subdivide d=$d level=$level" o.obj \
                subdivide "$name" --degree $d --levels $level --out o.obj
        done
    done
    run "subdivide off" o.off subdivide "$name" --ignore-tags --out o.off
    run "subdivide ply" o.ply \
        subdivide "$name" --uv-rule corners-plus1 --boundary edge-and-corner --out o.ply
}

sampled() {
    local d extension
    for d in 2 3 4 5; do
        run "info d=$d" stdout info "$name" --degree $d
        run "eval d=$d" o.csv eval "$name" --at at.csv --degree $d --out o.csv
        run "tessellate d=$d" o.obj \
            tessellate "$name" --degree $d --rate 3 --out o.obj
    done
    for d in gregory catmark; do
        run "eval $d" o.csv eval "$name" --at at.csv --patch $d --out o.csv
    done
    run "eval tags=no" o.csv eval "$name" --at at.csv --ignore-tags --out o.csv
    run "eval boundary" o.csv \
        eval "$name" --at at.csv --boundary edge-and-corner --out o.csv
    for extension in ply stl glb; do
        run "tessellate $extension" o.$extension \
            tessellate "$name" --patch gregory --rate 2 --out o.$extension
    done
}

# mesh_lines FILE: a folder of its own, so that messages name the mesh alone.
mesh_lines() {
    local folder faces status=0
    name=$(basename "$1")
    folder=$(mktemp -d -p "$work")
    cd "$folder"
    ln -s "$1" "$name"
    exec >"$folder.lines"
    "$fingerprint" "$name" || status=$?
    if [[ $status != 0 ]]; then
        echo "$name fingerprint status=$status"
    fi
    run "info json" info.json info "$name" --json info.json
    faces=1
    if [[ -e info.json ]]; then
        faces=$(sed -n 's/^ *"faces": \([0-9]*\),*$/\1/p' info.json)
    fi
    addresses "$faces" >at.csv
    refined
    sampled
    if [[ ${PICTURES:-yes} == yes && -e info.json && $faces -lt 3000 ]]; then
        pictures
    fi
}

# basis_lines: what needs no mesh.
basis_lines() {
    local net
    cd "$work"
    exec >basis.lines
    "$fingerprint" --basis
    for net in "$root"/tests/data/*.json; do
        name=$(basename "$net")
        ln -s "$net" "$name"  # so that messages name the file alone
        run patch o.json patch "$name" --out o.json
    done
}

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export root work
export -f digest run addresses pictures refined sampled mesh_lines
(basis_lines)
printf '%s\n' "${files[@]}" | sort -u |
    xargs -d '\n' -n 1 -P "${JOBS:-$(nproc)}" \
        bash -euo pipefail -c 'mesh_lines "$1"' mesh_lines
LC_ALL=C sort "$work"/*.lines >"$out"
echo "fingerprint: ${#files[@]} meshes, $(wc -l <"$out") lines in $out"
