#!/usr/bin/env bash
# The whole way once: installs what is needed, builds, makes footage, runs the main job, and says where
# the results are. DIR is where they go; a second run repeats quickly.
#   studio/demo.sh [DIR]
set -euo pipefail
out=${1:+$(realpath -m -- "$1")}
cd "$(dirname "$0")/.."
out=${out:-demo}
studio/install-deps.sh
build=${PLATELIGHT_BUILD:-build}
cmake -S . -B "$build" -G Ninja -DCMAKE_UNITY_BUILD=ON >/dev/null
cmake --build "$build" --target platelight
platelight=$build/studio/platelight
[ -f "$out/car.toml" ] || "$platelight" demo "$out"
"$platelight" run "$out/car.toml" --record "$out/take.mkv" --exr "$out/take" --json "$out/run.json"
"$platelight" still "$out/car.toml" -o "$out/still.png"
cat <<END

In $out:
  take.mkv       the recorded take
  take/          the same as OpenEXR frames with coverage and matte
  still.png      its first frame
  run.json       frame rate, time per stage, rays, delay
  car.toml       the set: change it and run again
END
