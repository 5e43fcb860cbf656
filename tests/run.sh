#!/usr/bin/env bash
# Installs what is needed, builds, runs every test.
#   tests/run.sh [--full] [--sanitize] [CTEST OPTIONS...]
# --full adds the long statistics, --sanitize builds apart with address and undefined-behaviour
# sanitizers; other arguments go to ctest (for example -R Lens).
set -euo pipefail
cd "$(dirname "$0")/.."
studio/install-deps.sh
full=OFF
sanitize=OFF
build=${PLATELIGHT_BUILD:-build}
while true; do
  case "${1:-}" in
    --full) full=ON; shift ;;
    --sanitize) sanitize=ON; build=$build-sanitize; shift ;;
    *) break ;;
  esac
done
cmake -S . -B "$build" -G Ninja -DPLATELIGHT_FULL_TESTS=$full -DPLATELIGHT_SANITIZE=$sanitize >/dev/null
cmake --build "$build"
exec ctest --test-dir "$build" --output-on-failure -j "$(nproc)" "$@"
