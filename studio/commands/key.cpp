// platelight key: clean plates, and clips keyed to EXR.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "calibrate/lens.h"
#include "capture/camera.h"
#include "capture/exr.h"
#include "compositing/exr_sequence.h"
#include "compositing/keyer.h"
#include "compositing/plate_footage.h"
#include "studio/clean_plates.h"
#include "studio/commands/commands.h"
#include "studio/commands/interruptible.h"
#include "studio/json_text.h"
#include "studio/key_masks.h"
#include "studio/plate_lens.h"
#include "studio/set_files.h"

namespace studio {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::int64_t plate_frames = 50;
constexpr int plate_footage = 480;  // frames that a clip without a plate is judged by

struct KeyOptions {
  std::vector<std::string> what;
  std::string out, plate, lens, response, colour = "Rec.1886", method = "screen", effort = "full";
  std::string screen_colour = "any";
  bool person = false, plain_ratio = false, steady_light = false;
  std::optional<std::int64_t> frames, first;
  std::optional<double> screen, core, edge, despill, smoothing;
  KeyMaskFiles masks;
};

VideoSource source_of(const KeyOptions& options, const std::string& uri) {
  VideoSource source;
  source.uri = uri.find(':') == std::string::npos ? "file:" + uri : uri;
  source.base_dir = std::filesystem::current_path().string();
  source.colour = capture::transfer_from_name(options.colour);
  source.response = options.response;
  source.first = options.first.value_or(0);
  return source;
}

// Nothing if any may be it.
std::optional<compositing::ScreenColour> screen_colour_of(const KeyOptions& options) {
  if (options.screen_colour == "any") return std::nullopt;
  return compositing::screen_colour_from_name(options.screen_colour);
}

// The lens of the options, which must be of the video's size; nothing if there is none.
std::optional<calibrate::Lens> lens_of(const KeyOptions& options,
                                       const std::string& uri,
                                       const capture::CameraInfo& info) {
  if (options.lens.empty()) return std::nullopt;
  calibrate::Lens lens = calibrate::read_lens(options.lens);
  if (lens.width != info.width || lens.height != info.height) {
    throw std::invalid_argument(
        fmt::format("the picture of {} is {}x{}, but the lens {} is for {}x{}", uri, info.width,
                    info.height, options.lens, lens.width, lens.height));
  }
  return lens;
}

// A plate of frames that come one by one, as the options ask.
class PlateMaker {
 public:
  explicit PlateMaker(const KeyOptions& options)
      : person_(options.person),
        by_screen_(options.method == "screen"),
        colour_(screen_colour_of(options)) {}

  void add(const capture::Image& frame) { person_ ? footage_.add(frame) : shots_.add(frame); }
  std::size_t count() const { return person_ ? footage_.count() : shots_.count(); }
  compositing::CleanPlate plate() const {
    if (!person_) return shots_.average(colour_);
    return by_screen_ ? footage_.screen(colour_) : footage_.background();
  }

 private:
  bool person_, by_screen_;
  std::optional<compositing::ScreenColour> colour_;
  compositing::PlateShots shots_;
  compositing::PlateFootage footage_;
};

void warn_if_cut_short(const VideoSource& source, const capture::Camera& camera, Console& console) {
  const std::string how = camera.statistics().cut_short;
  if (!how.empty()) console.warn(source.uri + ": " + how);
}

// Of any still background there is none to tell.
Json json_of_colour(bool by_screen, std::string_view colour) {
  return by_screen ? Json(colour) : Json();
}

// Of a plate that is written anew, to note its lens: what its file tells goes along.
void keep_notes(std::string_view uri, capture::ExrOptions& tags) {
  constexpr std::string_view file = "file:";
  const std::string path(uri.starts_with(file) ? uri.substr(file.size()) : uri);
  if (!path.ends_with(".exr") || !std::filesystem::is_regular_file(path)) return;
  if (!tags.noise) tags.noise = capture::read_exr_noise(path);
  if (const std::string told = capture::read_exr_transfer(path); !told.empty())
    tags.transfer = told;
  if (tags.lens.empty()) tags.lens = capture::read_exr_lens(path);
}

void make_plate(const KeyOptions& options, Console& console) {
  if (!options.out.ends_with(".exr")) {
    throw std::invalid_argument(options.out + ": plates are OpenEXR files, name it *.exr");
  }
  const VideoSource source = source_of(options, options.what.back());
  std::vector<ReadFile> files = files_of(source.uri, "the plate's own footage");
  if (!options.response.empty()) files.push_back({"the camera's response", options.response});
  if (!options.lens.empty()) files.push_back({"the camera's lens", options.lens});
  spare_files(files, options.out);
  spare_files(files, console.figures_file());
  const auto camera = open_video(source);
  const auto lens = lens_of(options, source.uri, camera->info());
  PlateMaker maker(options);
  const std::int64_t wanted = options.frames.value_or(plate_frames);
  std::int64_t passed = 0;
  for (; passed < wanted; ++passed) {
    const auto frame = camera->next();
    if (!frame) break;
    // What is lost repeats the picture before, and tells no noise.
    const bool good = frame->status == capture::FrameStatus::good;
    if (frame->image && good) maker.add(*frame->image);
  }
  warn_if_cut_short(source, *camera, console);
  const std::size_t frames = maker.count();
  if (frames == 0) throw std::runtime_error(source.uri + " gives no picture");
  const std::int64_t bad = passed - static_cast<std::int64_t>(frames);
  if (bad > 0) {
    console.warn(fmt::format("{} of {} frames were lost or damaged, and left out", bad, passed));
  }
  const compositing::CleanPlate plate = maker.plate();
  capture::ExrOptions tags;
  if (plate.knows_noise) tags.noise = {plate.noise_gain, plate.noise_floor};
  tags.transfer = name_of_light(source);
  if (lens) tags.lens = calibrate::text_of_lens(*lens);
  if (frames == 1) keep_notes(source.uri, tags);
  capture::write_exr(options.out, plate.light, tags);
  const bool by_screen = options.method == "screen";
  const bool screen = by_screen && compositing::screen_share(plate.light, plate.colour) > 0;
  const std::string_view colour = screen ? compositing::name_of(plate.colour) : "no";
  if (const auto doubts = by_screen ? doubts_of_plate(plate) : std::nullopt) {
    console.warn(*doubts + (screen ? "; --person is for plates that somebody is in"
                                   : ": --method difference needs none"));
  }
  Json figures{{"frames", frames},
               {"lost", bad},
               {"width", plate.light.width},
               {"height", plate.light.height},
               {"colour", json_of_colour(by_screen, colour)},
               {"noise_gain", nullptr},
               {"noise_floor", nullptr},
               {"lens", lens ? Json(options.lens) : Json()}};
  std::string noise = "noise not measured";
  if (tags.noise) {
    figures["noise_gain"] = tags.noise->gain;
    figures["noise_floor"] = tags.noise->floor;
    noise = fmt::format("noise in black {:.4f}", std::sqrt(tags.noise->floor));
  }
  console.figures(json_text(figures));
  console.say(fmt::format("{}: {}x{}, {} of {} frames, {} screen, {}{}", options.out,
                          plate.light.width, plate.light.height, options.person ? "middle" : "mean",
                          frames, screen ? fmt::format("a {}", colour) : "no", noise,
                          lens ? ", with " + words_for_lens(*lens) : ""));
}

compositing::KeySettings settings_of(const KeyOptions& options) {
  compositing::KeySettings settings;
  if (options.method == "difference") settings.method = compositing::KeyMethod::difference;
  settings.screen_colour = screen_colour_of(options);
  const auto take = [](const std::optional<double>& from, float& to) {
    if (from) to = static_cast<float>(*from);
  };
  take(options.screen, settings.screen);
  take(options.core, settings.core);
  take(options.edge, settings.edge);
  take(options.despill, settings.despill);
  take(options.smoothing, settings.smoothing);
  settings.learned = !options.plain_ratio;
  settings.follows_light = !options.steady_light;
  if (options.effort == "quick") settings.effort = compositing::KeyEffort::quick;
  return settings;
}

// Throws if anything that is to be written is what is read.
void spare_what_is_read(const KeyOptions& options, const VideoSource& source, Console& console) {
  std::vector<ReadFile> files = files_of(source.uri, "the clip");
  for (const std::string& path :
       {options.plate, options.lens, options.response, options.masks.garbage, options.masks.core}) {
    if (path.empty()) continue;
    files.push_back({"what the clip is keyed by", path});
  }
  spare_files(files, options.out);
  spare_from_frames(files, options.out);
  spare_files(files, console.figures_file());
}

// What keying a clip came to.
struct KeyedClip {
  bool by_screen = true;
  std::string colour = "no";  // of the screen
  double known = 0;           // share of the plate
  std::int64_t frames = 0, lost = 0, keyed = 0, unsure = 0;
  double confidence_sum = 0, least_confidence = 1;
  std::string_view why = "good";  // of the least
  std::int64_t first = 0;         // frame that is keyed
  // The camera, if it was moved: the first frame that shows it, and the farthest.
  std::optional<std::int64_t> moved_from;
  compositing::PlateShift shift;
  bool scattered = false;
  float ghost = 0;    // the largest share of the picture
  double key_ms = 0;  // in all
  Json rows = Json::array();
  double confidence() const { return confidence_sum / static_cast<double>(keyed); }
};

Json lost_row(std::int64_t frame) { return {{"frame", frame}, {"status", "lost"}}; }

float degrees_of(const compositing::PlateShift& shift) {
  return shift.roll_rad * 180 / std::numbers::pi_v<float>;
}

Json row_of(std::int64_t frame, const compositing::KeyReport& report) {
  Json row{{"frame", frame},
           {"confidence", report.confidence},
           {"status", compositing::name_of(report.status)},
           {"screen_in_sight", report.sight.screen},
           {"gain", report.sight.gain},
           {"mismatch", report.sight.mismatch},
           {"clipped", report.sight.clipped},
           {"ghost", report.ghost},
           {"soft", report.soft}};
  if (report.moved) {
    row["moved_px"] = {report.shift.right_px, report.shift.down_px};
    row["roll_deg"] = degrees_of(report.shift);
    row["scale"] = report.shift.scale;
  }
  return row;
}

void add(const compositing::KeyReport& report, std::int64_t frame, KeyedClip& clip) {
  ++clip.keyed;
  if (report.confidence < clip.least_confidence) clip.why = compositing::name_of(report.status);
  clip.least_confidence = std::min(clip.least_confidence, double{report.confidence});
  clip.confidence_sum += report.confidence;
  clip.unsure += compositing::is_unsure(report.confidence);
  if (report.moved) {
    if (!clip.moved_from) clip.moved_from = frame - report.moved_for + 1;
    if (report.shift.farthest_px > clip.shift.farthest_px) clip.shift = report.shift;
  }
  clip.scattered |= report.scattered;
  if (report.status == compositing::KeyStatus::ghost)
    clip.ghost = std::max(clip.ghost, report.ghost);
  clip.rows.push_back(row_of(frame, report));
}

capture::HalfImage matte_of(const capture::HalfImage& keyed) {
  capture::HalfImage matte{keyed.height, keyed.width, {}, 1};
  matte.pixels.reserve(keyed.pixels.size() / 4);
  for (std::size_t i = 3; i < keyed.pixels.size(); i += 4) matte.pixels.push_back(keyed.pixels[i]);
  return matte;
}

// Keys the camera's frames into the sequence.
void key_frames(const KeyOptions& options,
                capture::Camera& camera,
                compositing::Keyer& keyer,
                const compositing::ExrSequence& sequence,
                KeyedClip& clip) {
  compositing::KeyedFrame keyed;
  const Interruptible ctrl_c;  // what is keyed by then is reported
  for (; clip.frames < options.frames.value_or(INT64_MAX) && !ctrl_c.is_interrupted();
       ++clip.frames) {
    const auto frame = camera.next();
    if (!frame) return;
    const std::int64_t number = clip.frames + options.first.value_or(0);
    // Its picture is the one before, if there is any.
    const bool is_lost = frame->status == capture::FrameStatus::lost;
    if (is_lost || !frame->image) {
      ++clip.lost;
      clip.rows.push_back(lost_row(number));
      if (!frame->image) continue;
    }
    const auto start = std::chrono::steady_clock::now();
    const compositing::KeyReport report = keyer.key(*frame->image, keyed);
    clip.key_ms +=
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    sequence.write(number, keyed.image(), matte_of(keyed.image()), {});
    if (!is_lost) add(report, number, clip);
  }
}

Json json_of(const KeyedClip& clip) {
  Json moved;
  if (clip.moved_from) {
    moved = {{"frame", *clip.moved_from},
             {"right_px", clip.shift.right_px},
             {"down_px", clip.shift.down_px},
             {"roll_deg", degrees_of(clip.shift)},
             {"scale", clip.shift.scale}};
  }
  return {{"frames", clip.frames},
          {"lost", clip.lost},
          {"colour", json_of_colour(clip.by_screen, clip.colour)},
          {"plate_known", clip.known},
          {"confidence_mean", clip.confidence()},
          {"confidence_least", clip.least_confidence},
          {"unsure", clip.unsure},
          {"moved", moved},
          {"key_ms", clip.key_ms / static_cast<double>(clip.keyed)},
          {"rows", clip.rows}};
}

// `before`: frames that the directory had already.
void tell(const KeyedClip& clip, const std::string& out, std::int64_t before, Console& console) {
  const std::string before_what = !clip.by_screen       ? "a still background"
                                  : clip.colour == "no" ? "no screen"
                                                        : "a " + clip.colour + " screen";
  console.say(fmt::format(
      "{}: {} frames before {}, confidence {:.2f} in the mean, {:.2f} at least; {:.1f} ms a frame",
      out, clip.frames, before_what, clip.confidence(), clip.least_confidence,
      clip.key_ms / static_cast<double>(clip.keyed)));
  if (before > 0) {
    console.warn(fmt::format("{} had {} frames already: those with other numbers are still there",
                             out, before));
  }
  if (clip.lost > 0) {
    console.warn(fmt::format(
        "{} of {} frames were lost: the picture before stands in their place, if there is one",
        clip.lost, clip.frames));
  }
  if (clip.unsure > 0) {
    console.warn(
        fmt::format("the key is unsure ({}) in {} of {} frames: look at it before it is used",
                    clip.why, clip.unsure, clip.keyed));
    if (clip.why == compositing::name_of(compositing::KeyStatus::thin))
      console.warn(std::string(compositing::advice_if_thin));
  }
  if (clip.ghost > 0) console.warn(words_for_ghost(clip.ghost));
  if (clip.scattered) console.warn(words_for_scattered());
  if (!clip.moved_from) return;
  const std::string how = words_for_shift(clip.shift);
  // Two looks tell, of which the second is at the fifth frame.
  if (compositing::is_of_another_lens(clip.shift) && *clip.moved_from <= clip.first) {
    console.warn(fmt::format(
        "the plate seems to be of another lens: {}. Take it anew with the lens of the clip", how));
    return;
  }
  console.warn(
      fmt::format("the camera was moved, from frame {} on or up to 3 before: {}. Key what is "
                  "before and after by themselves (--frames, --first), each with its own plate",
                  *clip.moved_from, how));
}

void key_clip(const KeyOptions& options, Console& console) {
  const VideoSource source = source_of(options, options.what.front());
  spare_what_is_read(options, source, console);
  const int first = static_cast<int>(source.first);
  const compositing::KeySettings settings = settings_of(options);
  compositing::CleanPlate plate =
      read_clean_plate(options.plate, source, settings, {first, first + plate_footage - 1});
  KeyedClip clip;
  clip.by_screen = settings.method == compositing::KeyMethod::screen;
  if (clip.by_screen && compositing::screen_share(plate.light, plate.colour) > 0)
    clip.colour = compositing::name_of(plate.colour);
  clip.known = plate.known;
  clip.first = first;
  const auto camera = open_video(source);
  // Before the masks, which are for the video too.
  const auto [width, height] = std::pair(camera->info().width, camera->info().height);
  if (plate.light.width != width || plate.light.height != height) {
    throw std::invalid_argument(
        fmt::format("the clean plate {} is {}x{}, but the video {} is {}x{}", options.plate,
                    plate.light.width, plate.light.height, source.uri, width, height));
  }
  if (const auto lens = lens_of(options, source.uri, camera->info());
      lens && !options.plate.empty())
    require_plate_of_lens(options.plate, *lens, options.lens, shown_part(camera->info(), source));
  compositing::KeyMasks masks = read_key_masks(options.masks, width, height);
  if (clip.by_screen && !options.plate.empty()) {
    if (const auto doubts = doubts_of_plate(plate, masks.garbage)) console.warn(*doubts);
  }
  compositing::Keyer keyer(std::move(plate), settings, std::move(masks));
  compositing::ExrSequenceSettings take;
  take.dir = options.out;
  take.rate = camera->info().rate.num > 0 ? camera->info().rate : capture::Rational{25, 1};
  take.pixel_aspect = camera->info().pixel_aspect;
  const std::int64_t before = compositing::ExrSequence::frames_in(options.out);
  const compositing::ExrSequence sequence(take);
  key_frames(options, *camera, keyer, sequence, clip);
  if (clip.keyed == 0) throw std::runtime_error(source.uri + " gives no picture");
  warn_if_cut_short(source, *camera, console);
  console.figures(json_text(json_of(clip)));
  tell(clip, options.out, before, console);
}

void key(const KeyOptions& options, Console& console) {
  if (options.what.size() == 2 && options.what.front() == "plate")
    return make_plate(options, console);
  const bool lacks_camera = options.what.front() == "plate" && !std::filesystem::exists("plate");
  if (options.what.size() != 1 || lacks_camera) {
    throw UsageError("give a clip, or: plate CAMERA");
  }
  key_clip(options, console);
}

}  // namespace

Command key_command() {
  return {
      "key", "Cut persons out of a clip, or take the clean plate that this needs",
      "platelight key plate v4l2:/dev/video0 -o plate.exr && platelight key take.mkv --plate "
      "plate.exr -o keyed/",
      [](Arguments& arguments) -> std::function<void(Console&)> {
        auto o = std::make_shared<KeyOptions>();
        arguments.positionals("WHAT", o->what,
                              "a clip (file or camera URI) to key; or the word plate and the "
                              "camera that sees the empty screen");
        arguments.option("-o,--out", o->out,
                         "of a clip: directory for EXR files (premultiplied R, G, B, A, and "
                         "matte), numbered as the clip's frames are; of a plate: EXR file");
        arguments.required("--out");
        arguments.option("--plate", o->plate,
                         "picture of the empty screen; without it, from the footage alone");
        arguments.flag("--person", o->person,
                       "of a plate: somebody is in the picture, but nowhere all the time");
        arguments.choice("--method", o->method, {"screen", "difference"},
                         "by the screen's colour, or by the distance from any still background");
        std::vector<std::string> colours{"any"};
        for (const auto name : compositing::screen_colour_names) colours.emplace_back(name);
        arguments.choice("--screen-colour", o->screen_colour, colours,
                         "where something else is taken for the screen");
        arguments.option("--colour", o->colour, "the clip's transfer curve, as in a set");
        arguments.option("--response", o->response,
                         "the camera's measured response (.rsp or .toml), in place of --colour");
        arguments.option("--lens", o->lens,
                         "the camera's lens (.cameramodel or .toml): a plate notes it, and a clip "
                         "is keyed by no plate that notes another");
        arguments.option("--first", o->first, 0, 1'000'000'000, "begin at this frame");
        arguments.option(
            "--frames", o->frames, 1, 1'000'000'000,
            "at most so many (of a plate: 50); Ctrl-C ends a clip with its figures too");
        arguments.option("--screen", o->screen, 0, 0.9, "alpha below which the screen is clear");
        arguments.option("--core", o->core, 0.1, 1, "alpha above which the person is whole");
        arguments.option("--garbage", o->masks.garbage,
                         "picture of the clip's size: white is never the person");
        arguments.option("--core-mask", o->masks.core,
                         "picture of the clip's size: white is always the person");
        arguments.option("--edge", o->edge, -1, 1, "thinner to fuller");
        arguments.option("--despill", o->despill, 0, 2, "none, 1 all of the likely spill, up to 2");
        arguments.option("--smoothing", o->smoothing, 0, 4, "of alpha over frames");
        arguments.flag("--plain-ratio", o->plain_ratio,
                       "in place of the learned table, for screens unlike any");
        arguments.flag("--steady-light", o->steady_light,
                       "the light is the plate's: no gain is measured in the frames");
        arguments.choice("--effort", o->effort, {"full", "quick"},
                         "for a frame; quick is for screens of one primary");
        return [o](Console& console) { key(*o, console); };
      }};
}

}  // namespace studio
