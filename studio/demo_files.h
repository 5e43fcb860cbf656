// The files of the made footage, one function for each kind.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

#include "render/made_studio.h"
#include "studio/demo.h"

namespace studio {

// Where the clap is, seconds from the plate's first frame.
inline constexpr double demo_clap_s = 1.2;
inline constexpr int demo_sound_rate = 48000;

// Plate picture n before noise: radiance (height, width, 3). Called from several threads.
using PlateRadiance = std::function<capture::Image(int n)>;

// The plate: H.264 of 8 bits, 4:2:0, with sound. Every frame has its own noise.
void write_demo_plate(const std::filesystem::path& file,
                      const render::MadeStudio& studio,
                      const PlateRadiance& radiance);

// A second of the plate's first frame in which the picture flashes white while the clap sounds.
void write_demo_clap(const std::filesystem::path& file,
                     const render::MadeStudio& studio,
                     const capture::Image& radiance);

// What the plate's camera makes of a picture, as a PNG file: codes with the noise of frame n.
void write_demo_picture(const std::filesystem::path& file,
                        const render::MadeStudio& studio,
                        const capture::Image& radiance,
                        int n);

// The probe's shots as PPM files, with frames.csv. Returns how many.
int write_demo_probe(const std::filesystem::path& dir,
                     const render::MadeStudio& studio,
                     const render::LightParts& picture);

// The set files. `prefix` comes before every file that they name: "" for one that lies beside its
// footage.
std::string court_set(const render::MadeStudio& studio, const std::string& prefix);
std::string park_set(const render::MadeStudio& studio, const std::string& prefix);

// The lenses, and the camera's track if it moves.
void write_demo_cameras(const std::filesystem::path& dir, const render::MadeStudio& studio);

// What everything was made with, as JSON. read_demo_truth() (demo.h) reads it again.
void write_demo_truth(const std::filesystem::path& file,
                      const DemoSettings& settings,
                      const render::MadeStudio& studio);

void write_text(const std::filesystem::path& file, std::string_view text);

}  // namespace studio
