// The made studio: a place and its light, seen by a made plate camera and a made fish-eye.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "calibrate/lens.h"
#include "calibrate/pose.h"
#include "calibrate/track.h"
#include "capture/frame.h"
#include "capture/made_sensor.h"
#include "render/light_table.h"
#include "render/made_court.h"
#include "render/made_sky.h"
#include "render/scene.h"

namespace render {

// A camera of the studio: how it stands, sees and codes. It takes `rate` pictures per second, with
// its exposures in turn; picture 0 is exposed about `start`.
struct MadeCamera {
  calibrate::Lens lens;
  calibrate::Pose cam_from_set;  // of picture 0
  calibrate::Track track;        // of a camera that moves, from picture 0 on; no keys = it stands
  capture::MadeSensor sensor;
  std::vector<double> exposures_s;
  capture::Rational rate;
  capture::Time start{};
};

// The middle of the exposure of picture n, where the camera was, and the exposure.
capture::Time time_of_picture(const MadeCamera& camera, std::int64_t n);
calibrate::Pose pose_of_picture(const MadeCamera& camera, std::int64_t n);
double exposure_of_picture(const MadeCamera& camera, std::int64_t n);

struct MadeStudioSettings {
  int width = 640;  // of the plate
  int height = 480;
  int probe_size = 384;     // of the fish-eye's square picture
  int sky_height = 512;     // of the sky's maps
  int texture_size = 2560;  // of the court's side
  int frames = 60;          // of the plate, after which the light repeats itself
  std::uint32_t seed = 1;
};

// Throws std::invalid_argument for sizes below 16, or frames below 1.
void check(const MadeStudioSettings& settings);

// Where something stands.
struct MadeStand {
  Vec3f foot;
  double yaw_deg = 0;
};

// Everything of the studio but time. The set's origin is the spot on the ground where a car is to
// stand; radiance is in the plate's units, 1 = display white.
struct MadeStudio {
  MadeStudioSettings settings;
  MadeSky sky;
  SceneDescription place;         // its first instance is the ground around the origin
  double car_yaw_deg = 0;         // how the car is to stand
  std::optional<MadeStand> lamp;  // where a made lamp is to stand, if one is
  MadeCamera plate;               // 25 pictures a second, Rec.1886 codes of 8 bits
  MadeCamera probe;               // exposures in turn, sRGB codes of 8 bits, looking straight up
  double cloud_share = 0;         // of the sun's light that a passing cloud takes at most
  capture::Time period{};         // of the light
};

// The court under a made sky with a passing cloud. The plate camera stands; the probe takes 75
// pictures a second in three exposures. The same settings give the same studio. Throws as check().
MadeStudio make_studio(const MadeStudioSettings& settings);

// The probe's camera: a fish-eye of 186 degrees that looks straight up from the car's place, and
// shows radiance up to sensor.saturation / exposure. Each of its brackets fits one picture of the
// plate.
MadeCamera make_fisheye(int size, std::vector<double> exposures_s, std::uint32_t seed);

// How strong the sun is at a time: 1, less while a cloud passes before it. Smooth, the same
// again after studio.period.
float sun_strength(const MadeStudio& studio, capture::Time time);

// Where the court's plate shows the inside of the grey card: x, y, width, height of a rectangle of
// pixels that lies in it.
std::array<int, 4> picture_of_card(const MadeStudio& studio);

// What is seen of a still scene, by where its light came from: at any strength of the sun, the
// picture is rest + strength * sun + lamps, since light adds.
struct LightParts {
  capture::Image sun;    // (height, width, 3)
  capture::Image rest;   // (height, width, 3)
  capture::Image lamps;  // (height, width, 3); empty = there are none
};
capture::Image add_light(const LightParts& parts, float sun_strength);

struct PhotographSettings {
  int samples = 16;  // paths a pixel for each part of the light, more where the sun itself is seen
  std::uint32_t seed = 1;       // of the noise, which does not depend on the number of threads
  bool behind_virtual = false;  // see PhotographView
  std::span<const LocalLight> lamps = {};  // of the made lamps that are in the scene (made_lamp.h)
};

// A scene in the studio's light through `directions`, path-traced.
LightParts photograph_parts(const MadeStudio& studio,
                            const Scene& scene,
                            const calibrate::DirectionTable& directions,
                            const calibrate::Pose& cam_from_set,
                            const PhotographSettings& settings);

// Directions of a latitude-longitude map (height, 2 * height) as render::Environment has them, for
// a camera that is not turned against the set.
calibrate::DirectionTable latlong_directions(int height);

// Which share of every pixel the instances named in `seen` (one flag for each) cover, (height,
// width, 1).
capture::Image coverage_of(const SceneDescription& scene,
                           const std::vector<bool>& seen,
                           const calibrate::DirectionTable& directions,
                           const calibrate::Pose& cam_from_set,
                           int samples);

}  // namespace render
