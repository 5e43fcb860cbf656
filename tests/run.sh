#!/usr/bin/env bash
# Installs what is needed, builds, runs every test. --full adds the long statistics; other arguments
# go to ctest (for example -R Lens).
set -euo pipefail
cd "$(dirname "$0")/.."
studio/install-deps.sh
full=OFF
[ "${1:-}" = --full ] && { full=ON; shift; }
build=${PLATELIGHT_BUILD:-build}
cmake -S . -B "$build" -G Ninja -DPLATELIGHT_FULL_TESTS=$full >/dev/null
cmake --build "$build"
exec ctest --test-dir "$build" --output-on-failure -j "$(nproc)" "$@"
