// Made footage: plate, clap, probe.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "capture/files.h"
#include "capture/made_sound.h"
#include "capture/parallel_loop.h"
#include "capture/png.h"
#include "compositing/video_writer.h"
#include "studio/demo_files.h"

namespace studio {
namespace {

namespace fs = std::filesystem;

// Fine enough that what the codec loses is far below the sensor's noise.
constexpr int plate_crf = 8;

std::vector<std::uint8_t> codes8(const capture::MadeShot& shot) {
  return {shot.codes.begin(), shot.codes.end()};
}

// Plain codes behind a line of text, as a camera hands them over: nothing to unpack in the show.
void write_ppm(const fs::path& file, const capture::MadeShot& shot) {
  const std::string head = fmt::format("P6\n{} {}\n255\n", shot.width, shot.height);
  std::vector<std::uint8_t> bytes(head.begin(), head.end());
  bytes.insert(bytes.end(), shot.codes.begin(), shot.codes.end());
  capture::write_file(file.string(), std::as_bytes(std::span(bytes)));
}

std::vector<std::uint8_t> plate_codes(const render::MadeStudio& studio,
                                      const capture::Image& radiance,
                                      int n) {
  return codes8(capture::expose(studio.plate.sensor, radiance,
                                render::exposure_of_picture(studio.plate, n),
                                static_cast<std::uint64_t>(n)));
}

// Pictures with sound. Frames are made in parallel, a few at a time, and written in order.
template <class Frame>
void write_video(const fs::path& file,
                 const render::MadeCamera& camera,
                 int frames,
                 double clap_s,
                 const Frame& frame) {
  compositing::VideoSettings settings;
  settings.file = file.string();
  settings.rate = camera.rate;
  settings.width = camera.lens.width;
  settings.height = camera.lens.height;
  settings.crf = plate_crf;
  settings.transfer = camera.sensor.transfer;
  settings.timecode = "10:00:00:00";
  settings.sound_channels = 1;
  settings.sound_rate = demo_sound_rate;
  settings.repeatable = true;
  compositing::VideoWriter video(settings);
  const capture::Sound sound = capture::make_clap(
      {.rate = demo_sound_rate, .length_s = frames / camera.rate.value(), .clap_s = clap_s});
  const auto sample_of = [&](int n) {
    return std::min(
        sound.samples.size(),
        static_cast<std::size_t>(std::llround(n / camera.rate.value() * demo_sound_rate)));
  };
  constexpr int together = 8;
  for (int first = 0; first < frames; first += together) {
    const int count = std::min(together, frames - first);
    std::vector<std::vector<std::uint8_t>> pictures(static_cast<std::size_t>(count));
    capture::parallel_for(0, count,
                          [&](int i) { pictures[static_cast<std::size_t>(i)] = frame(first + i); });
    for (int i = 0; i < count; ++i) {
      const int n = first + i;
      video.write_picture(n, pictures[static_cast<std::size_t>(i)]);
      const std::size_t from = sample_of(n);
      video.write_sound(static_cast<std::int64_t>(from),
                        std::span(sound.samples).subspan(from, sample_of(n + 1) - from));
    }
  }
  video.close();
}

}  // namespace

void write_demo_plate(const fs::path& file,
                      const render::MadeStudio& studio,
                      const PlateRadiance& radiance) {
  write_video(file, studio.plate, studio.settings.frames, demo_clap_s,
              [&](int n) { return plate_codes(studio, radiance(n), n); });
}

void write_demo_clap(const fs::path& file,
                     const render::MadeStudio& studio,
                     const capture::Image& radiance) {
  constexpr int frames = 25;
  constexpr int flash = 12;
  write_video(file, studio.plate, frames, flash / studio.plate.rate.value(), [&](int n) {
    std::vector<std::uint8_t> codes = plate_codes(studio, radiance, n);
    if (n == flash) std::ranges::fill(codes, std::uint8_t{235});
    return codes;
  });
}

void write_demo_picture(const fs::path& file,
                        const render::MadeStudio& studio,
                        const capture::Image& radiance,
                        int n) {
  capture::write_png(file, radiance.width, radiance.height, radiance.channels,
                     plate_codes(studio, radiance, n));
}

int write_demo_probe(const fs::path& dir,
                     const render::MadeStudio& studio,
                     const render::LightParts& picture) {
  const render::MadeCamera& probe = studio.probe;
  const int shots = static_cast<int>(
      std::llround(studio.settings.frames * probe.rate.value() / studio.plate.rate.value()));
  fs::create_directories(dir);
  capture::parallel_for(0, shots, [&](int n) {
    const float strength = render::sun_strength(studio, render::time_of_picture(probe, n));
    const capture::MadeShot shot =
        capture::expose(probe.sensor, render::add_light(picture, strength),
                        render::exposure_of_picture(probe, n), static_cast<std::uint64_t>(n));
    write_ppm(dir / fmt::format("{:05}.ppm", n), shot);
  });
  std::string list = "file,time_s,exposure_s,status\n";
  for (int n = 0; n < shots; ++n) {
    const double time_s =
        static_cast<double>((render::time_of_picture(probe, n) - probe.start).count()) * 1e-9;
    list +=
        fmt::format("{:05}.ppm,{:.9f},{},good\n", n, time_s, render::exposure_of_picture(probe, n));
  }
  capture::write_file((dir / "frames.csv").string(), std::as_bytes(std::span(list)));
  return shots;
}

}  // namespace studio
