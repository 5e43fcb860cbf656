#!/usr/bin/env bash
# Installs what is needed, builds, runs every test.
#   tests/run.sh [--full] [--sanitize] [--sanitize-threads] [CTEST OPTIONS...]
# --full adds the long statistics, and compiles each source on its own; --sanitize builds apart with
# address and undefined-behaviour sanitizers, --sanitize-threads with the one for threads; other
# arguments go to ctest (for example -R Lens).
set -euo pipefail
cd "$(dirname "$0")/.."
studio/install-deps.sh
full=OFF
together=ON  # several sources as one: a third of the time
sanitize=
build=${PLATELIGHT_BUILD:-build}
while true; do
  case "${1:-}" in
    --full) full=ON together=OFF; shift ;;
    --sanitize) sanitize=address,undefined; build=$build-sanitize; shift ;;
    --sanitize-threads) sanitize=thread; build=$build-threads; shift ;;
    *) break ;;
  esac
done
cmake -S . -B "$build" -G Ninja -DCMAKE_UNITY_BUILD=$together -DPLATELIGHT_FULL_TESTS=$full \
  -DPLATELIGHT_SANITIZE="$sanitize" >/dev/null
cmake --build "$build"
export LSAN_OPTIONS="suppressions=$PWD/tests/leaks.supp:print_suppressions=0 ${LSAN_OPTIONS:-}"
# Of the longest history: a stack that is lost matches no suppression.
export TSAN_OPTIONS="suppressions=$PWD/tests/threads.supp history_size=7 ${TSAN_OPTIONS:-}"
exec ctest --test-dir "$build" --output-on-failure -j "$(nproc)" "$@"
