// The files of the made footage, one function for each kind.
#pragma once

#include <filesystem>
#include <string>

#include "render/made_studio.h"

namespace studio {

// Where the clap is, seconds from the plate's first frame.
inline constexpr double demo_clap_s = 1.2;
inline constexpr int demo_sound_rate = 48000;

// The plate: H.264 of 8 bits, 4:2:0, with sound. Every frame has its own noise and its own strength
// of the sun.
void write_demo_plate(const std::filesystem::path& file,
                      const render::MadeStudio& studio,
                      const render::LightParts& picture);

// A second of the plate's first frame in which the picture flashes white while the clap sounds.
void write_demo_clap(const std::filesystem::path& file,
                     const render::MadeStudio& studio,
                     const render::LightParts& picture);

// The probe's shots as PPM files, with frames.csv. Returns how many.
int write_demo_probe(const std::filesystem::path& dir,
                     const render::MadeStudio& studio,
                     const render::LightParts& picture);

// The set, and the lenses that it names.
void write_demo_set(const std::filesystem::path& dir, const render::MadeStudio& studio);

// What everything was made with, as JSON.
void write_demo_truth(const std::filesystem::path& file,
                      const render::MadeStudio& studio,
                      int samples);

}  // namespace studio
