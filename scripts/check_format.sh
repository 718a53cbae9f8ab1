#!/usr/bin/env bash
# Copyright 2026 The osdx authors.
# SPDX-License-Identifier: Apache-2.0
#
# Checks the tracked sources against .clang-format. Other versions of clang-format than 14
# lay out some lines differently, so 14 it is.

set -euo pipefail

cd "$(dirname "$0")/.."
if ! command -v clang-format-14 >/dev/null; then
    scripts/install_packages.sh format
fi

n_files=$(git ls-files '*.h' '*.cpp' | wc -l)
if [[ $n_files == 0 ]]; then
    echo "check_format: no files" >&2
    exit 1
fi
git ls-files -z '*.h' '*.cpp' | xargs -0 clang-format-14 --dry-run --Werror
echo "check_format: $n_files files"
