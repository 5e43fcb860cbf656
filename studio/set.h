// The set file: everything that a show is made from, as its author wrote it, every value checked.
// studio/docs/set_file.md describes the keys.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "calibrate/lens.h"
#include "calibrate/pose.h"
#include "capture/colour.h"
#include "capture/frame.h"
#include "compositing/keyer.h"
#include "compositing/person_shape.h"
#include "render/colour_matrix.h"
#include "render/environment.h"
#include "render/frame_job.h"
#include "studio/key_masks.h"
#include "studio/section.h"
#include "studio/toml.h"

namespace studio {

// All faults of a set at once. what() has one line for each.
class SetError : public std::runtime_error {
 public:
  explicit SetError(std::vector<Diagnostic> diagnostics);
  const std::vector<Diagnostic>& diagnostics() const { return diagnostics_; }

 private:
  std::vector<Diagnostic> diagnostics_;
};

struct ShowSettings {
  int width = 0;  // of the picture
  int height = 0;
  std::optional<capture::Rational> fps;  // nothing = the plate's own, 25 for stills
  std::optional<bool> sharpen;           // see sharpening.h; nothing = if the show is live
  std::optional<std::int64_t> frames;    // nothing = to the plate's end; endless for stills
};

// A moving camera or a fixed one.
struct PoseSettings {
  calibrate::Pose cam_from_set;
  std::string track;  // a file of poses (calibrate/track.h) in its place; "" = fixed
};

struct CameraSettings {
  std::string source;  // URI, paths made absolute
  Place source_place;
  calibrate::Lens lens;            // of the show's picture: cropped, and of its size
  std::array<int, 2> lens_size{};  // width and height of the whole picture that it was given for
  PoseSettings pose;
  Place pose_place;
  std::optional<std::int64_t> frame;
  std::optional<std::array<int, 4>> crop;  // x, y, width, height in source pixels
  capture::Transfer colour = capture::Transfer::rec1886;
  std::string response;              // .rsp file; "" = none
  std::vector<double> vignetting;    // of the lens (calibrate/vignetting.h); empty = even
  std::optional<double> exposure_s;  // where the source does not tell it
  // Of a rig: how much later than the rig's clock its frames are stamped.
  std::optional<double> rig_offset_s;
  bool loop = false;
  std::optional<bool> deinterlace;  // as capture::CameraOptions
};

// How probe radiance is brought to the plate's units.
struct MatchSettings {
  enum class Method { automatic, patch, given };
  Method method = Method::automatic;
  std::array<float, 3> gain{1, 1, 1};          // of `given`
  std::optional<render::ColourMatrix> matrix;  // of `given`: in place of the gain
  bool follow = false;               // of `given`: goes with the plate's exposure from then on
  std::optional<double> exposure_s;  // of `given`: the plate's that it was calibrated at
  double overlap = 1;                // of `given`: what both cameras' directions tell of that one
  std::array<int, 4> patch{};        // of `patch`: x, y, width, height in the show's picture
  std::array<float, 3> albedo{};     // of `patch`: what it is painted
  calibrate::Vec3 normal{0, 0, 1};   // of `patch`: where it faces in the set
  friend bool operator==(const MatchSettings&, const MatchSettings&) = default;
};

struct ProbeSettings {
  enum class Kind { map, bracket, camera };

  Kind kind = Kind::map;
  std::string source;  // of a map or camera: URI; of a bracket: "" = `shots`
  Place source_place;
  std::vector<std::string> shots;       // of a bracket: its pictures
  std::optional<calibrate::Lens> lens;  // nothing = latitude-longitude
  calibrate::Pose probe_from_set;
  double yaw_rad = 0;               // of a map: turned to the left, seen from above
  std::vector<double> exposures_s;  // empty = "auto"
  bool asks_auto = false;           // "auto" is what the set says
  double exposure_error = 0.1;      // of radiance, that "auto" is to reach
  render::Unseen unseen = render::Unseen::floor;
  MatchSettings match;
  std::optional<std::array<int, 4>> albedo_patch;  // a level spot whose implied albedo is reported
  std::vector<double> vignetting;  // of the lens (calibrate/vignetting.h); empty = even
  std::string response;            // .rsp file of the shots; "" = recovered where needed
  capture::Transfer colour = capture::Transfer::linear;
  double offset_s = 0;  // how much later than the plate its frames are stamped
  friend bool operator==(const ProbeSettings&, const ProbeSettings&) = default;
};

// Where an object stands: scaled, tilted about its own x, turned about z, moved.
struct PlacementSettings {
  calibrate::Vec3 position;
  double tilt_rad = 0;
  double yaw_rad = 0;
  double scale = 1;
};

// The files of an object's shapes, by which it deforms.
struct ShapeSettings {
  std::vector<std::string> files;        // in their order; some may not be there
  std::optional<capture::Rational> fps;  // nothing = the show's
  bool loop = false;                     // else the last shape stays
  friend bool operator==(const ShapeSettings&, const ShapeSettings&) = default;
};

struct ObjectSettings {
  std::string name;
  std::string mesh;  // file, the first one of `shapes`; "" = made
  std::optional<ShapeSettings> shapes;
  std::string made;  // "car", "headlight", "stage", ...: see set_file.md
  Place place;       // of `mesh` or `made`
  PlacementSettings pose;
  std::vector<std::string> hide;  // parts left out, by node name
  double emission_gain = 1;
  // Copies in rows and columns along the object's own x and y, the first one at its pose.
  std::array<int, 2> copies{1, 1};
  std::array<double, 2> spacing_m{0, 0};
};

struct StandInSettings {
  enum class Shape { plane, box, mesh };
  std::string name;
  Shape shape = Shape::plane;
  calibrate::Vec3 size{1, 1, 0};  // metres; a plane has x and y
  std::string mesh;               // file
  Place place;
  PlacementSettings pose;  // a plane's and a box's middle; a box stands on it
  bool catches_shadow = true;
  bool catches_reflection = false;
  bool catches_light = true;
  std::array<float, 3> albedo{0.2F, 0.2F, 0.2F};
  float reflectance = 0.04F;
  float roughness = 0.3F;
  bool blocks_light = false;
  bool occludes = true;
  bool mirrored = false;  // virtual mirrors show the plate there
};

// A virtual lamp: a point that shines to all sides, or as a small disc that faces somewhere.
struct LampSettings {
  calibrate::Vec3 position;
  std::optional<calibrate::Vec3> facing;  // unit
  std::array<float, 3>
      intensity{};  // radiant intensity (of a disc: straight ahead), in the plate's units
};

// The display's tone mapping, see ToneFollower.
struct ToneSettings {
  std::optional<float> key;  // level of the picture's middle; nothing = as it is
  double seconds = 1;        // in which the curve follows the picture's levels to 63 %
  friend bool operator==(const ToneSettings&, const ToneSettings&) = default;
};

// Video that the surfaces of objects show, and shine by.
struct VideoSettings {
  std::string name;    // to change its source by while the show runs
  std::string source;  // URI
  Place source_place;
  std::string object;    // "OBJECT" or "OBJECT/PART"; "" = any
  std::string material;  // by its name in the model; "" = any
  Place object_place;
  std::array<float, 3> gain{1, 1, 1};  // radiance of its white, in the plate's units; or,
  bool lit = false;                    // ... where it is the colour of a matte surface, its albedo
  bool loop = false;
  capture::Transfer colour = capture::Transfer::rec1886;
  bool lights = false;               // its surroundings as well:
  std::array<int, 2> samples{5, 5};  // by so many lamps,
  float ambient = 0;                 // and by a share of its mean from everywhere
};

// How a person is cut out of a video.
struct KeyChoice {
  std::string plate;                   // file of the empty screen; "" = from the footage alone:
  std::array<int, 2> footage{0, 479};  // these of its frames, first and last;
  bool takes_plate = false;            // or from the video's next frames, before which nobody is;
  std::int64_t take = 0;               // of another number, anew
  KeyMaskFiles masks;
  bool by_texel = false;  // filtered, then keyed where rays see it; else whole frames are keyed
  compositing::KeySettings settings;
  Place place;
  friend bool operator==(const KeyChoice&, const KeyChoice&) = default;
};

// A camera that films a person.
struct PersonCamera {
  std::string source;  // URI
  Place place;
  bool loop = false;
  std::int64_t first = 0;  // frame of the video that it begins with
  capture::Transfer colour = capture::Transfer::rec1886;
  std::optional<std::array<int, 4>> crop;  // x, y, width, height in source pixels
  std::string response;                    // .rsp file; "" = none
  std::optional<bool> deinterlace;         // as capture::CameraOptions
  double offset_s = 0;                     // how much later than the plate its frames are stamped
  std::optional<KeyChoice> key;            // nothing = the source has alpha, or shows all
  std::optional<calibrate::Lens> lens;     // with its pose; further cameras always have both
  std::string lens_file;                   // "" = written in the set
  calibrate::Pose cam_from_set;
  friend bool operator==(const PersonCamera&, const PersonCamera&) = default;
};

// A person in a video, who stands in the set.
struct PersonSettings {
  std::string name;
  std::vector<PersonCamera> cameras{PersonCamera{}};  // 1 to 8; the first one tells the feet
  compositing::PersonShape shape = compositing::PersonShape::automatic;
  double error_m = 0.05;  // on the person, above which a billboard gives way to the hull
  bool by_feet = false;   // stands where its feet meet the floor
  double floor_z = 0;
  calibrate::Vec3 position;  // else here: its feet, or without a lens the lower edge's middle
  double height_m = 0;       // without a lens: of the whole picture
  double yaw_rad = 0;        // without a lens: where it faces; 0 = to -y
  double turn_rad = 0;       // how far it turns to the show's camera
  std::array<float, 3> gain{1, 1, 1};
  bool lit = false;
  float translucency = 0;

  const PersonCamera& first() const { return cameras.front(); }
  bool may_be_hull() const {
    return cameras.size() > 1 && shape != compositing::PersonShape::billboard;
  }
};

struct DisplayChoice {
  std::string display;  // "" = compositing's default
  std::string view;
  std::optional<ToneSettings> tone;  // nothing = the view alone
  Place place;
};

struct RecordSettings {
  std::string file;  // "" = no video
  std::string exr;   // directory; "" = no EXR
  std::string fill;  // videos for an external keyer, both or none
  std::string key;
  std::string codec;            // "" = compositing's default
  std::optional<int> crf;       // H.264's constant rate factor; nothing = compositing's default
  std::string exr_compression;  // "" = compositing's default
  std::string timecode;         // of the first frame; "" = 00:00:00:00
  Place place;

  bool is_empty() const { return file.empty() && exr.empty() && fill.empty() && key.empty(); }
};

struct Set {
  std::string path;
  std::string name;
  ShowSettings show;
  CameraSettings camera;
  std::optional<ProbeSettings> probe;
  std::vector<ObjectSettings> objects;
  std::vector<StandInSettings> stand_ins;
  std::vector<LampSettings> lamps;
  std::vector<VideoSettings> videos;
  std::vector<PersonSettings> persons;
  render::Effort effort;
  DisplayChoice display;
  RecordSettings record;
  std::vector<NamedFile>
      files;  // that keys name, but for URIs and lists; of the rig, what it names
};

// Limits that keep a set within what one machine can hold.
inline constexpr int largest_picture_side = 16384;
inline constexpr int most_instances = 100000;

// Reads and checks a set file. Throws SetError with every fault: of syntax, keys, types, ranges,
// files that are missing, lens, track and response files that cannot be read, devices' URIs whose
// settings could never be (capture::check_camera_uri).
Set read_set(const std::string& path);

}  // namespace studio
