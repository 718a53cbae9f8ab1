#!/usr/bin/env bash
# Copyright 2026 The osdx authors.
# SPDX-License-Identifier: Apache-2.0
#
# Installs what is missing, builds and runs the tests.
#
# Usage: ./test.sh [release | debug | asan-ubsan] [options of CMake]

set -euo pipefail

cd "$(dirname "$0")"
preset=${1:-release}
shift $(($# > 0))

groups=(build)
[[ $preset == asan-ubsan ]] && groups+=(clang)
scripts/install_packages.sh "${groups[@]}"

cmake --preset "$preset" "$@"
cmake --build --preset "$preset"

report=$PWD/build/$preset/tests.xml
rm -f "$report"
status=0
ctest --preset "$preset" --parallel "$(getconf _NPROCESSORS_ONLN)" --no-tests=error \
    --output-junit "$report" || status=$?

count() { grep -c "^[[:space:]]*<$1" "$report" || true; }
passed=$(count 'testcase .* status="run"')
skipped=$(($(count 'testcase .* status="disabled"') + $(count 'skipped message="SKIP_')))
failed=$(($(count 'testcase ') - passed - skipped))
echo "$passed passed, $failed failed, $skipped skipped"
if [[ $passed == 0 ]]; then
    echo "No test ran." >&2
    exit 1
fi
exit "$status"
