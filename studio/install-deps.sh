#!/usr/bin/env bash
# Every Debian 12 package that Platelight builds, runs and tests with. Quick when all are there.
set -euo pipefail
packages=(
  # build
  build-essential clang-format cmake file ninja-build pkg-config git ca-certificates
  # capture
  libaravis-dev libavcodec-dev libavfilter-dev libavformat-dev libavutil-dev libswresample-dev
  libswscale-dev libeigen3-dev libexif-dev libimath-dev libopenexr-dev libusb-1.0-0-dev
  # calibrate
  libceres-dev libmrcal-dev libopencv-contrib-dev libtomlplusplus-dev
  # render
  libassimp-dev libembree-dev libtbb-dev
  # compositing
  libopencolorio-dev
  # studio
  fonts-dejavu-core libcli11-dev libfmt-dev libopencv-photo-dev librsvg2-dev nlohmann-json3-dev
  # tests
  ffmpeg libgmock-dev libgtest-dev locales openimageio-tools
)
missing=()
for package in "${packages[@]}"; do
  dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
done
[ ${#missing[@]} -eq 0 ] && exit 0
sudo=()
[ "$(id -u)" -eq 0 ] || sudo=(sudo)
export DEBIAN_FRONTEND=noninteractive
"${sudo[@]}" apt-get update -q
"${sudo[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "${missing[@]}"
