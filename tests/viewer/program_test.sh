#!/usr/bin/env bash
# Copyright 2026 The osdx authors.
# SPDX-License-Identifier: Apache-2.0
#
# The program as a user meets it: exit status, one line of error, files or none.
#
# Usage: tests/program_test.sh OSDX DATA

set -uo pipefail

osdx=$(realpath "$1")
data=$(realpath "$2")
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
cd "$dir" || exit 1
failures=0

fail() {
    echo "FAILED: $*"
    failures=$((failures + 1))
}

# expect_files CALL FILE...: they are there and not empty.
expect_files() {
    local call=$1 file
    shift
    for file in "$@"; do
        [[ -s $file ]] || fail "$call: no $file"
    done
}

# succeeds FILE... -- ARGS: status 0, nothing on stderr, the files are there.
succeeds() {
    local files=()
    while [[ $1 != -- ]]; do
        files+=("$1")
        shift
    done
    shift
    "$osdx" "$@" >stdout 2>stderr || fail "$*: status $?: $(cat stderr)"
    [[ -s stderr ]] && fail "$*: stderr: $(cat stderr)"
    expect_files "$*" "${files[@]}"
}

# tells PATTERN ARGS: status 0, one matching line on stderr.
tells() {
    local pattern=$1
    shift
    "$osdx" "$@" >stdout 2>stderr || fail "$*: status $?: $(cat stderr)"
    grep -Eq -e "$pattern" stderr || fail "$*: '$(cat stderr)' does not say '$pattern'"
    [[ $(wc -l <stderr) == 1 ]] || fail "$*: not one line: $(cat stderr)"
}

# warns CODE FILE... -- ARGS: tells a warning of that code and nothing on stdout; the files are there.
warns() {
    local code=$1 files=()
    shift
    while [[ $1 != -- ]]; do
        files+=("$1")
        shift
    done
    shift
    tells "^osdx: warning: .* \\[$code\\]$" "$@"
    [[ -s stdout ]] && fail "$*: stdout: $(cat stdout)"
    expect_files "$*" "${files[@]}"
}

# refuses STATUS PATTERN ARGS: that status, one matching line on stderr (usage errors may
# have more), and no file that was not there before.
refuses() {
    local status=$1 pattern=$2 before after got=0
    shift 2
    before=$(ls -A | grep -v '^std')
    "$osdx" "$@" >stdout 2>stderr || got=$?
    after=$(ls -A | grep -v '^std')
    [[ $got == "$status" ]] || fail "$*: status $got, not $status"
    grep -Eq -e "$pattern" stderr || fail "$*: '$(cat stderr)' does not say '$pattern'"
    if [[ $status == 1 && $(wc -l <stderr) != 1 ]]; then
        fail "$*: not one line: $(cat stderr)"
    fi
    [[ $before == "$after" ]] || fail "$*: left behind: $(comm -13 <(echo "$before") <(echo "$after"))"
}

cat >cube.obj <<'END'
v -1 -1 -1
v 1 -1 -1
v 1 1 -1
v -1 1 -1
v -1 -1 1
v 1 -1 1
v 1 1 1
v -1 1 1
f 4 3 2 1
f 5 6 7 8
f 1 2 6 5
f 2 3 7 6
f 3 4 8 7
f 4 1 5 8
END
vertices=$(grep '^v' cube.obj)
faces=$(grep '^f' cube.obj)

# ------------------------------------------------------------------ what works

succeeds info.json -- info cube.obj --json info.json
for line in '"faces": 6' '"closed": true' '"boundary_loops": 0' '"boundary": "edge-only"'; do
    grep -q "$line" info.json || fail "info: no $line"
done
succeeds -- info cube.obj --boundary none
succeeds refined.off -- subdivide cube.obj --degree 5 --levels 2 --out refined.off
[[ $(sed -n 2p refined.off | cut -d' ' -f1,2) == "98 96" ]] ||
    fail "subdivide: $(sed -n 2p refined.off), not 98 96"
printf '%s\n' 'v 0 0 0' 'v 1 0 0' 'v 1 1 0' 'v 0 1 0' 'vt 0 0' 'vt 2 0' 'vt 2 2' 'vt 0 2' \
    'f 1/1 2/2 3/3 4/4' >textured.obj
succeeds textured_refined.obj -- subdivide textured.obj --levels 1 --out textured_refined.obj
[[ $(grep -c '^vt' textured_refined.obj) == 9 ]] && grep -q '^vt 1 1$' textured_refined.obj ||
    fail "subdivide: texture coordinates: $(grep '^vt' textured_refined.obj)"
for extension in obj ply stl glb; do
    succeeds "out.$extension" -- tessellate cube.obj --rate 4 --out "out.$extension"
done
[[ $(stat -c %s out.stl) == $((84 + 50 * 6 * 16 * 2)) ]] || fail "STL: wrong size"
{
    printf '%s\n' "$vertices" 'vt 0 0' 'vt 1 0' 'vt 1 1' 'vt 0 1'
    awk '{ print "f " $2 "/1 " $3 "/2 " $4 "/3 " $5 "/4" }' <<<"$faces"
} >uv.obj
succeeds uv_out.obj -- tessellate uv.obj --rate 2 --out uv_out.obj
[[ $(grep -c '^vt' uv_out.obj) == 54 ]] || fail "tessellate uv.obj: not 9 vt a face"
succeeds uv_out.glb -- tessellate uv.obj --rate 2 --uv-rule all --out uv_out.glb
grep -q TEXCOORD_0 uv_out.glb || fail "GLB: no TEXCOORD_0"
{
    awk '/^v/ { print $0, ($2 > 0), ($3 > 0), ($4 > 0) }' <<<"$vertices"
    printf '%s\n' 'g all' "$faces"
} >colors.obj
succeeds colors.ply -- subdivide colors.obj --levels 1 --out colors.ply
grep -q '^property double red$' colors.ply || fail "subdivide: no colours"
succeeds groups.obj -- subdivide colors.obj --levels 1 --out groups.obj
grep -q '^g all$' groups.obj || fail "subdivide: no groups"
warns names-dropped even.obj -- subdivide colors.obj --degree 2 --out even.obj
grep -q 'even degrees .* without their groups' stderr || fail "subdivide: $(cat stderr)"
grep -q '^g' even.obj && fail "subdivide: groups at degree 2"
succeeds -- subdivide cube.obj --degree 2 --out even.obj
[[ -s stdout ]] && fail "subdivide: a note without need: $(cat stdout)"
warns uvs-dropped even.obj warnings.json -- subdivide textured.obj --degree 2 --out even.obj \
    --json warnings.json
tr -d ' \n' <warnings.json | grep -q '"warnings":\[{"code":"uvs-dropped","message":"' ||
    fail "subdivide: $(cat warnings.json)"
warns uvs-dropped dropped.off -- subdivide textured.obj --out dropped.off
succeeds kept.ply -- subdivide textured.obj --out kept.ply
grep -q "^property list uchar .* texcoord$" kept.ply || fail "subdivide: no texcoord in PLY"
succeeds warnings.json -- subdivide cube.obj --out dropped.ply --json warnings.json
grep -q '"warnings": \[\]' warnings.json || fail "subdivide: $(cat warnings.json)"
{
    printf '%s\n' "$vertices" 'usemtl red'
    sed '3i usemtl blue' <<<"$faces"
} >materials.obj
succeeds materials_out.obj -- tessellate materials.obj --rate 2 --out materials_out.obj
[[ $(grep '^usemtl\|^f' materials_out.obj | cut -d' ' -f1 | uniq -c | xargs) == \
    "1 usemtl 8 f 1 usemtl 16 f" ]] || fail "tessellate: materials: $(cat materials_out.obj)"
succeeds materials.glb -- tessellate materials.obj --rate 2 --out materials.glb
grep -q '"name":"blue"' materials.glb || fail "tessellate: no materials in GLB"
# One pixel, 32768 of 65535: a fifth of the diagonal, 2 sqrt(3), by half is 0.3464.
base64 -d >half.png <<'END'
iVBORw0KGgoAAAANSUhEUgAAAAEAAAABEAAAAABq7kcWAAAAC0lEQVR42mNoYAAAAQMAga3osnQAAAAASUVORK5CYII=
END
lowest() {
    awk '$1 == "v" && $4 < z { z = $4 } END { print z }' "$1"
}
succeeds displaced.obj -- tessellate uv.obj --rate 2 --displace half.png --displace-scale 0.2 \
    --out displaced.obj
awk -v a="$(lowest uv_out.obj)" -v b="$(lowest displaced.obj)" \
    'BEGIN { exit !(a - b > 0.3464 && a - b < 0.3465) }' ||
    fail "--displace: from $(lowest uv_out.obj) to $(lowest displaced.obj)"
succeeds displaced.obj -- tessellate uv.obj --error 1e-3 --displace half.png --out displaced.obj
# Rates by length and by error: with half of the error about twice the facets, up to the bound.
facets() {
    grep -o '"facets": [0-9]*' rates.json | cut -d' ' -f2
}
succeeds rates.obj rates.json -- tessellate cube.obj --error 1e-3 --out rates.obj --json rates.json
coarse=$(facets)
succeeds -- tessellate cube.obj --error 2.5e-4 --out rates.obj --json rates.json
((coarse > 6 && $(facets) > 2 * coarse)) || fail "--error: $coarse, then $(facets) facets"
# The curve of an edge is about a third of the diagonal long: three segments.
succeeds -- tessellate cube.obj --edge-length 0.14 --out rates.obj --json rates.json
[[ $(facets) == 54 ]] || fail "--edge-length: $(facets) facets, not 6 x 3 x 3"
warns rate-limited -- tessellate uv.obj --error 1e-6 --max-rate 3 --out rates.obj --json rates.json
[[ $(facets) == 54 ]] || fail "--max-rate: $(facets) facets, not 6 x 3 x 3"
grep -q '12 of 12 edges have the greatest rate' stderr || fail "--max-rate: $(cat stderr)"
warns uvs-dropped uv_out.stl -- tessellate uv.obj --rate 2 --out uv_out.stl
grep -q '"edges_at_max_rate": 12' rates.json || fail "--max-rate: $(cat rates.json)"
for patch in multisided catmark; do
    "$osdx" tessellate colors.ply --patch "$patch" --rate 2 --out colors.glb 2>stderr ||
        grep -q 'built without' stderr || fail "tessellate $patch: $(cat stderr)"
    grep -q COLOR_0 colors.glb || grep -q 'built without' stderr || fail "GLB: no COLOR_0"
done
"$osdx" render colors.ply --size 64 48 --shade color --out color.png 2>stderr ||
    grep -q 'built without Embree' stderr || fail "render color: $(cat stderr)"
printf '%s\n' "$vertices" "$(sed 1d <<<"$faces")" >box.obj
succeeds box.off -- subdivide box.obj --boundary none --degree 3 --levels 1 --out box.off
succeeds box.json box.ply -- tessellate box.obj --degree 4 --rate 2 --out box.ply --json box.json
grep -q '"facets": 20' box.json || fail "tessellate: $(cat box.json)"  # 5 faces of 4
succeeds -- info box.obj
grep -q 'open with 4 boundary edges in 1 loop; ' stdout || fail "info: $(cat stdout)"
grep -q '^at borders: 4 x 2 (faces)$' stdout || fail "info: $(cat stdout)"
succeeds box.json -- info box.obj --boundary none --json box.json
grep -q '"faces_without_surface": 4' box.json || fail "info: $(cat box.json)"

# A rim that is infinitely sharp, a crease and a hole.
printf '%s\n' "$vertices" "$faces" >sharp.obj
for edge in '0 1' '1 2' '2 3' '3 0'; do
    echo "t crease 2/1/0 $edge 10" >>sharp.obj
done
printf '%s\n' 't crease 2/1/0 4 5 1.5' 't corner 1/1/0 6 2' 't hole 1/0/0 1' >>sharp.obj
succeeds sharp.json -- info sharp.obj --json sharp.json
for line in 'creases: *1 semi-sharp (up to 1.5), 4 infinitely sharp' \
    'corners: *1 semi-sharp (up to 2)' 'holes: *1' 'bare: *1 faces'; do
    grep -q "^$line" stdout || fail "info: no $line: $(cat stdout)"
done
warns tags-dropped sharp.ply -- subdivide sharp.obj --out sharp.ply
printf 'face,u,v\n0,0.5,0.5\n1,0.5,0.5\n' >hole.csv
refuses 1 '^osdx: hole.csv:3: face 1 is a hole' eval sharp.obj --at hole.csv --out x.csv
printf 'face,u,v\n0,0.5,0.5\n5,0,1\n' >at.csv
succeeds out.csv -- eval cube.obj --degree 4 --at at.csv --out out.csv
[[ $(wc -l <out.csv) == 3 && $(sed -n 2p out.csv | tr , '\n' | wc -l) == 26 ]] ||
    fail "eval: $(cat out.csv)"
succeeds net.json -- patch "$data/thesis_EV_d3_n5.json" --out net.json
grep -q '"dxy"' net.json || fail "patch: no dxy"
succeeds gregory.json -- patch "$data/acc2_n5.json" --out gregory.json
for key in paper tuned control centre_point pos d1 d2 d11 d12 d22; do
    grep -q "\"$key\"" gregory.json || fail "patch: no $key"
done
succeeds gregory.json -- patch "$data/acc2_n4.json" --out gregory.json

if "$osdx" compare cube.obj --rate 2 --json compare.json >stdout 2>stderr; then
    for key in boundary_edges regular distance_rms normal_deg_max gap_max \
        normal_jump_deg_max curvature_jump_max sharp_normal_jump_deg_max sharp_samples \
        build points evaluate; do
        grep -q "\"$key\"" compare.json || fail "compare: no $key"
    done
    succeeds sharp_compare.json -- compare sharp.obj --rate 4 --json sharp_compare.json
    grep -q 'across infinitely sharp edges: .* up to [1-9]' stdout || fail "compare: $(cat stdout)"
    succeeds -- compare box.obj --rate 4 --boundary edge-and-corner
else
    grep -q 'built without OpenSubdiv' stderr || fail "compare: $(cat stderr)"
fi
"$osdx" render uv.obj --size 64 48 --shade checker --out checker.png 2>stderr ||
    grep -q 'built without Embree' stderr || fail "render checker: $(cat stderr)"
if "$osdx" compare cube.obj --rate 2 --patch gregory --levels 1 --with multisided \
    --json with.json >stdout 2>stderr; then
    grep -q '"gregory": {' with.json && grep -q '"4": 24' with.json &&
        grep -q '"patch": "multisided"' with.json || fail "compare: $(cat with.json)"
    "$osdx" compare cube.obj --rate 2 --patch gregory --levels 1 --with catmark \
        --json with.json >stdout 2>stderr &&
        grep -q 'OpenSubdiv at isolation 1: 24 patches' stdout &&
        grep -q '"isolation": 1' with.json || fail "compare: $(cat with.json)"
else
    grep -q 'built without OpenSubdiv' stderr || fail "compare: $(cat stderr)"
fi
refuses 1 'degree 3' info cube.obj --patch gregory --degree 4
for shade in phong normals reflection mean gauss patches; do
    "$osdx" render cube.obj --size 64 48 --shade "$shade" --out "$shade.png" 2>stderr ||
        grep -q 'built without Embree' stderr || fail "render $shade: $(cat stderr)"
done

# ------------------------------------------------------------------ streams and options

[[ $("$osdx" --version) =~ ^osdx\ [0-9]+\.[0-9]+\.[0-9]+$ ]] || fail "--version: $("$osdx" --version)"
for command in info subdivide patch eval tessellate compare render demo; do
    "$osdx" "$command" --help >help || fail "$command --help: status $?"
    LC_ALL=C grep -q '[^ -~]' help && fail "$command --help: bytes that nobody can read: $(cat help)"
    for option in --json --version --threads --quiet; do
        grep -q -- "$option " help || fail "$command --help: no $option"
    done
done
"$osdx" tessellate --help | grep -q 'uv-rule .*corners-plus1,corners-plus2' || fail "--uv-rule: no names"
succeeds -- info cube.obj --quiet
[[ -s stdout ]] && fail "--quiet: $(cat stdout)"
succeeds even.obj warnings.json -- --quiet subdivide textured.obj --degree 2 --out even.obj \
    --json warnings.json
grep -q uvs-dropped warnings.json || fail "--quiet: no warnings in JSON"
succeeds one.obj -- tessellate cube.obj --threads 1 --rate 4 --out one.obj
succeeds -- --threads 2 info cube.obj

# Standard input and output, as "-" and by their names.
for out in - /dev/stdout; do
    succeeds -- tessellate - --format obj --rate 4 --out "$out" <cube.obj
    cmp -s stdout one.obj || fail "tessellate - --out $out: another mesh"
done
succeeds -- subdivide - --format obj --out-format off --out - <cube.obj
grep -q '^OFF' stdout || fail "--out-format: $(head -1 stdout)"
succeeds -- eval cube.obj --at - --out - <<<$'face,u,v\n0,0.5,0.5'
[[ $(wc -l <stdout) == 2 ]] || fail "eval: $(cat stdout)"
succeeds piped.csv -- eval <(cat cube.obj) --format obj --at <(printf 'face,u,v\n0,0,0\n') --out piped.csv
"$osdx" info cube.obj --json - >stdout 2>stderr || fail "--json -: status $?"
[[ -e - ]] && fail "--json -: a file of that name"
cmp -s stdout <("$osdx" info cube.obj --json /dev/stdout 2>/dev/null) && [[ $(head -c 1 stdout) == '{' ]] ||
    fail "--json -: $(cat stdout)"
grep -q '^patches: ' stderr || fail "--json -: no report on stderr"
"$osdx" info cube.obj --json both.txt >both.txt 2>stderr
[[ $(head -c 1 both.txt) == '{' && $(tail -c 2 both.txt) == '}' ]] || fail "--json to stdout's file: $(cat both.txt)"
refuses 2 'stdin needs --format' info - <cube.obj
refuses 2 'stdout needs --format' tessellate cube.obj --out -
refuses 2 'stdin can be read once' eval - --format obj --at - --out x.csv <cube.obj
if [[ -c /dev/full ]]; then
    for arguments in 'info cube.obj' '--help' '--version' 'tessellate cube.obj --rate 1 --format obj --out -' \
        'info cube.obj --json -' 'tessellate cube.obj --out /dev/full --format ply'; do
        # shellcheck disable=SC2086
        "$osdx" $arguments >/dev/full 2>stderr && fail "$arguments: status 0 though stdout is full"
        grep -q '^osdx: ' stderr || fail "$arguments: '$(cat stderr)' on a full stdout"
        [[ -c /dev/full ]] || fail "$arguments: /dev/full is no device any more"
    done
fi

# Links stay, modes stay, what is read-only stays, and the other file of a call too.
echo keep >kept.obj
ln -s kept.obj link.obj
chmod 600 kept.obj
succeeds -- subdivide cube.obj --out link.obj
[[ -L link.obj && ! -L kept.obj && $(stat -c %a kept.obj) == 600 ]] && grep -q '^f ' kept.obj ||
    fail "a link as output: $(ls -l link.obj kept.obj)"
refuses 2 'names the same file' subdivide cube.obj --out kept.obj --json link.obj
refuses 2 'names the same file' subdivide cube.obj --out x.obj --json ./x.obj
refuses 2 'names the same file' tessellate cube.obj --format obj --out - --json -
refuses 2 'names the same file' compare cube.obj --images . --json phong.png
echo keep >kept.obj
chmod 400 kept.obj
refuses 1 '^osdx: kept.obj: .*read-only' subdivide cube.obj --out kept.obj
refuses 1 '^osdx: link.obj: .*read-only' info cube.obj --json link.obj
refuses 1 '^osdx: nowhere/x.json: ' subdivide cube.obj --out x.obj --json nowhere/x.json
refuses 1 '^osdx: kept.obj/phong.png: ' compare cube.obj --images kept.obj
[[ $(cat kept.obj) == keep ]] || fail "a read-only file was replaced"
refuses 2 'names the same file' demo --out . --json ./info.json
refuses 1 '^osdx: nowhere/x.json: ' demo --out fresh --json nowhere/x.json
refuses 1 '^osdx: x.jpg: .*\.png' render cube.obj --out x.jpg

# Nothing is left by signals, and the status is theirs. A second file tells that it is begun.
mkdir signals
for signal in INT TERM HUP; do
    (
        cd signals || exit 1
        echo keep >s.obj
        # Signals that are ignored stay so, as INT is in the background: it is set back.
        env --default-signal="$signal" "$osdx" tessellate ../cube.obj --rate 512 --out s.obj &
        process=$!
        while kill -0 $process 2>/dev/null && [[ $(ls -A | wc -l) == 1 ]]; do
            sleep 0.01
        done
        kill -"$signal" $process
        wait $process
        [[ $? == $((128 + $(kill -l "$signal"))) && $(ls -A) == s.obj && $(cat s.obj) == keep ]]
    ) 2>stderr || fail "$signal: $(ls -lA signals) $(cat stderr)"
done
(
    ulimit -f 16 -c 0
    cd signals && "$osdx" tessellate ../cube.obj --rate 64 --out s.obj
) 2>stderr
[[ $? == 153 && $(ls -A signals) == s.obj ]] || fail "XFSZ: $(ls -lA signals) $(cat stderr)"

# ------------------------------------------------------------------ bad usage

refuses 2 'subcommand'
refuses 2 "no subcommand 'foo'" foo
refuses 2 "no subcommand 'foo'" foo cube.obj
refuses 2 'threads' info cube.obj --threads 0
refuses 2 'MESH' info
refuses 2 'degree' info cube.obj --degree 1
refuses 2 'degree' info cube.obj --degree three
refuses 2 'patch' tessellate cube.obj --patch round --out x.obj
refuses 2 'patch' compare cube.obj --patch catmark
for option in --error --edge-length; do
    for value in 0 -1 nan inf x; do
        refuses 2 "^$option: $value is no positive" tessellate cube.obj $option $value --out x.obj
    done
    refuses 2 "excludes $option" tessellate cube.obj $option 0.1 --rate 3 --out x.obj
done
refuses 2 'edge-length excludes --error' tessellate cube.obj --edge-length 0.1 --error 0.1 --out x.obj
refuses 2 'max-rate' tessellate cube.obj --error 0.1 --max-rate 0 --out x.obj
refuses 2 'displace-scale requires --displace' tessellate uv.obj --displace-scale 1 --out x.obj
refuses 2 'displace-scale: inf' tessellate uv.obj --displace half.png --displace-scale inf --out x.obj
refuses 2 'uv-rule' tessellate cube.obj --uv-rule some --out x.obj
for command in info subdivide eval tessellate compare render; do
    refuses 2 'boundary' "$command" cube.obj --boundary round
    "$osdx" "$command" --help | grep -q -- --ignore-tags || fail "$command: no --ignore-tags"
done
refuses 2 'unknown|not expected' info cube.obj --unknown

# ------------------------------------------------------------------ bad input

# refuses_mesh NAME PATTERN LINES: a file that every way of reading it refuses.
refuses_mesh() {
    printf '%s\n' "$3" >"$1"
    refuses_surface "$@"
    refuses 1 "^osdx: $1.*$2" subdivide "$1" --out x.obj
}

# refuses_surface NAME PATTERN LINES: a file that can be refined, but has no surface.
refuses_surface() {
    printf '%s\n' "$3" >"$1"
    refuses 1 "^osdx: $1.*$2" tessellate "$1" --rate 2 --out x.ply
    refuses 1 "^osdx: $1.*$2" info "$1" --json x.json
}

# ------------------------------------------------------------------ what is taken, with a warning

printf '%s\n' "$vertices" 'vt 0 0' 'f 4/1 3/1 2/1 1/1' "$(sed 1d <<<"$faces")" >mixed.obj
tells '^osdx: warning: mixed.obj:11: face 1 has no texture coordinates' info mixed.obj
tells 'mixed.obj:11' subdivide mixed.obj --out mixed_out.obj
printf 'face,u,v\n0,0.5,1\n0,3000000000,0.25\n1,-1,0.5\n' >outside.csv
tells '^osdx: warning: outside.csv:3: .*outside of face 0 and taken as \(1, 0.25\); 2 rows' \
    eval cube.obj --at outside.csv --out x.csv
rm x.csv

# ------------------------------------------------------------------ repairs

printf '%s\n' "$vertices" 'f 1 2 3 4' "$(sed 1d <<<"$faces")" 'f 1 2' >broken.obj
refuses 1 '^osdx: broken.obj:15: face 6 has 2 vertices \(--repair helps\)$' info broken.obj
tells '^osdx: warning: broken.obj: 1 face dropped, 1 face turned \[repaired\]$' info broken.obj --repair
grep -q '8 vertices, 12 edges, 6 faces, closed' stdout || fail "--repair: $(cat stdout)"
tells 'repaired' subdivide broken.obj --repair --out repaired.off
{
    printf 'v %s\n' '0 0 0' '1 0 0' '1 1 0' '1 0 1e-4' '2 0 0' '1 1 0'
    printf 'f %s\n' '1 2 3' '4 5 6'
} >apart.obj
succeeds -- info apart.obj
grep -q ' 2 components' stdout || fail "info: $(cat stdout)"
tells ': 2 vertices welded \[repaired\]$' info apart.obj --weld 1e-3
grep -q ' 1 component,' stdout || fail "--weld: $(cat stdout)"
tells ': 1 vertex welded, .*\[repaired\]$' info apart.obj --weld 0 --repair
refuses 2 'weld' info cube.obj --weld -1
succeeds -- info cube.obj --crease-angle 89
grep -q '^creases: *12 infinitely sharp$' stdout || fail "--crease-angle: $(cat stdout)"
succeeds -- info cube.obj --crease-angle 91
grep -q '^creases:' stdout && fail "--crease-angle: $(cat stdout)"
refuses 1 '^osdx: broken.obj:15: .*--repair' info broken.obj --crease-angle 30

# ------------------------------------------------------------------ what is no file of its kind

ln -s /dev/zero zero.obj
refuses 1 '^osdx: zero.obj: .*device' info zero.obj
refuses 1 '^osdx: zero.obj: .*device' patch zero.obj --out x.json
refuses 1 '^osdx: zero.obj: .*device' eval cube.obj --at zero.obj --out x.csv
mkdir folder.obj
refuses 1 '^osdx: folder.obj: .*directory' info folder.obj
refuses 1 '^osdx: folder.obj: .*directory' patch folder.obj --out x.json
refuses 1 '^osdx: folder.obj: .*directory' eval cube.obj --at folder.obj --out x.csv
succeeds -- info cube.obj --json pipe.json
"$osdx" info <(cat cube.obj) >stdout 2>stderr && fail "a pipe has no extension"
mkfifo pipe.obj
cat cube.obj >pipe.obj &
succeeds -- info pipe.obj
printf '{"kind": "EV", "a": %s1%s, "b": 2}' "$(printf '[%.0s' {1..100000})" \
    "$(printf ']%.0s' {1..100000})" >deep.json
refuses 1 '^osdx: deep.json: the JSON nests deeper' patch deep.json --out x.json
printf '%s\n' "$vertices" "$faces" >bad_utf8.obj
printf 't \xff\xfe 0/0/0\n' >>bad_utf8.obj
refuses 1 "^osdx: bad_utf8.obj:15: tag 0 is '\?\?'" info bad_utf8.obj
succeeds utf8.json -- info bad_utf8.obj --ignore-tags --json utf8.json
grep -q $'\xef\xbf\xbd' utf8.json || fail "info: no U+FFFD in $(cat utf8.json)"

refuses 1 '^osdx: missing.obj: ' info missing.obj
: >empty.obj
refuses 1 '^osdx: empty.obj: ' info empty.obj
: >cube.xyz
refuses 1 '^osdx: cube.xyz: ' info cube.xyz
refuses_mesh range.obj ':15: face 6 .*vertex 8' "$vertices"$'\n'"$faces"$'\n''f 1 2 9'
refuses_mesh small.obj ':9: face 0 ' "$vertices"$'\n''f 1 2'
refuses_mesh repeated.obj ':9: face 0 .*vertex 1 twice' "$vertices"$'\n''f 1 2 3 2'
refuses_mesh edge.obj ':16: face 6 .*vertices 0 and 1' \
    "$vertices"$'\n''v 0 -3 0'$'\n'"$faces"$'\n''f 1 2 9'
refuses_mesh flipped.obj 'opposite orientations' \
    "$vertices"$'\n'"$(sed '1s/.*/f 1 2 3 4/' <<<"$faces")"
refuses_mesh fans.obj ':1: vertex 0 .*fans' "v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
v -1 0 0
v 0 -1 0
v 0 0 -1
f 1 3 2
f 1 2 4
f 1 4 3
f 2 3 4
f 1 5 6
f 1 7 5
f 1 6 7
f 5 7 6"
refuses_mesh nan.obj ':3: vertex 2 ' "$(sed '3s/.*/v 1 nan -1/' <<<"$vertices")"$'\n'"$faces"
refuses_mesh inf.obj ':3: vertex 2 ' "$(sed '3s/.*/v 1 inf -1/' <<<"$vertices")"$'\n'"$faces"
refuses_surface two.obj ':9: vertex 8 .*two faces' \
    "$vertices"$'\n''v 0 -1 -1'$'\n'"$(sed '1s/.*/f 4 3 2 9 1/; 3s/.*/f 1 9 2 6 5/' <<<"$faces")"
printf '%s\n' "$vertices" "$faces" 't crease 2/1/0 0 1 2.5' >tag.obj
printf "%s\n" "$vertices" "$faces" "t smoothtriangles 0/0/1 smooth" >smooth.obj
refuses 1 "^osdx: smooth.obj:15: .*'smoothtriangles'" info smooth.obj --degree 4
succeeds -- info tag.obj --ignore-tags
grep -q '^tags: .*1 x crease (ignored)$' stdout || fail "info: $(cat stdout)"
grep -q '^creases:' stdout && fail "info: creases though ignored"
# Of no effect on a closed mesh, and so on its surface.
printf '%s\n' "$vertices" "$faces" 't crease 2/1/0 0 1 0' 't interpolateboundary 1/0/0 1' \
    't creasemethod 0/0/1 chaikin' >inert.obj
succeeds inert.json -- info inert.obj --json inert.json
for line in '"boundary": "edge-and-corner"' '"crease_method": "chaikin"' '"holes": 0'; do
    grep -q "$line" inert.json || fail "info: no $line"
done
grep -q '^method: *chaikin$' stdout || fail "info: $(cat stdout)"
succeeds inert.json -- info inert.obj --boundary none --json inert.json
grep -q '"boundary": "none"' inert.json || fail "info: --boundary has no effect"
refuses_mesh words.obj ':2: ' "v 0 0 0"$'\n''v one two three'

printf 'face,u,v\n6,0,0\n' >far.csv
refuses 1 '^osdx: far.csv:2: .*face 6' eval cube.obj --at far.csv --out x.csv
printf 'face,u\n' >head.csv
refuses 1 '^osdx: head.csv:1: ' eval cube.obj --at head.csv --out x.csv
echo '{"kind": "EV", "n": 5, "d": 3, "control": [], "samples": []}' >net_bad.json
refuses 1 '^osdx: net_bad.json: .*31 points' patch net_bad.json --out x.json
mesh='"vertices": [[0,0,0],[1,0,0],[0,1,0]], "faces": [[0,1,2]]'
samples='"paper": {"domain": [[0,0]]}, "tuned": {"domain": [[0,0],[2,9]]}'
echo "{\"mesh\": {$mesh}, $samples}" >net_good.json
succeeds net.json -- patch net_good.json --out net.json
echo "{\"mesh\": {$mesh}}" >net_bad.json
refuses 1 '^osdx: net_bad.json: .*domain' patch net_bad.json --out x.json
echo "{\"mesh\": {${mesh/1,2]]/1,3]]}}, $samples}" >net_bad.json
refuses 1 '^osdx: net_bad.json: .*vertex 3' patch net_bad.json --out x.json
echo "{\"mesh\": {${mesh/1,2]]/1,1]]}}, $samples}" >net_bad.json
refuses 1 '^osdx: net_bad.json: .*face 0' patch net_bad.json --out x.json
echo "{\"mesh\": {$mesh, \"inf_creases\": [[0,0]]}, $samples}" >net_bad.json
refuses 1 '^osdx: net_bad.json: .*share no edge' patch net_bad.json --out x.json
echo "{\"mesh\": 7, $samples}" >net_bad.json
refuses 1 '^osdx: net_bad.json: ' patch net_bad.json --out x.json
refuses 1 '^osdx: cube.obj: .*texture coordinates' render cube.obj --shade checker --out x.png
refuses 1 '--displace: cube.obj has no texture' tessellate cube.obj --displace half.png --out x.obj
refuses 1 '--displace: missing.png' tessellate uv.obj --displace missing.png --out x.obj
refuses 1 '--displace: cube.obj: ' tessellate uv.obj --displace cube.obj --out x.obj
refuses 1 'no colours to show' render cube.obj --shade color --out x.png
refuses 1 'patch|built without' render cube.obj --patch catmark --shade patches --out x.png
refuses 1 'x.step' tessellate cube.obj --out x.step
refuses 1 'nowhere' tessellate cube.obj --out nowhere/x.obj

if [[ $failures != 0 ]]; then
    echo "$failures failures"
    exit 1
fi
