// Set files: the root, and the sections that are a few plain values.
#include "studio/set.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <span>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>

#include "compositing/timecode.h"
#include "render/caustics.h"
#include "render/kernel.h"
#include "studio/set_sections.h"
#include "studio/toml_file.h"

namespace studio {
namespace {

constexpr std::int64_t most_frames = 100'000'000;  // 46 days at 25 frames a second

std::string lines_of(const std::vector<Diagnostic>& diagnostics) {
  std::string lines;
  for (const Diagnostic& diagnostic : diagnostics) {
    if (!lines.empty()) lines += '\n';
    lines += to_string(diagnostic);
  }
  return lines;
}

// "30000/1001", both parts from 1.
std::optional<capture::Rational> parse_rational(const std::string& text) {
  const std::size_t slash = text.find('/');
  const auto whole = [](const std::string& digits) -> std::int64_t {
    const bool good = !digits.empty() && digits.size() <= 9 &&
                      digits.find_first_not_of("0123456789") == std::string::npos;
    return good ? std::stoll(digits) : 0;
  };
  if (slash == std::string::npos) return std::nullopt;
  const std::int64_t num = whole(text.substr(0, slash));
  const std::int64_t den = whole(text.substr(slash + 1));
  if (num < 1 || den < 1) return std::nullopt;
  const std::int64_t divisor = std::gcd(num, den);
  return capture::Rational{num / divisor, den / divisor};
}

ShowSettings read_show_section(Section section) {
  ShowSettings show;
  section.need("width", "the picture's width in pixels");
  section.need("height", "the picture's height in pixels");
  section.integer("width", show.width, 1, largest_picture_side);
  section.integer("height", show.height, 1, largest_picture_side);
  read_fps(section, show.fps);
  if (bool sharpen = false; section.boolean("sharpen", sharpen)) show.sharpen = sharpen;
  std::int64_t frames = 0;
  if (section.integer("frames", frames, std::int64_t{1}, most_frames)) show.frames = frames;
  section.finish();
  return show;
}

void read_tone(Section& section, std::optional<ToneSettings>& tone) {
  std::string name = "none";
  section.text("tone", name);
  if (name != "none" && name != "schlick") {
    section.fault("tone", fmt::format("must be \"none\" or \"schlick\", not \"{}\"", name));
  }
  ToneSettings settings;
  float key = 0;
  if (section.number("key", key, {0.001, 0.9})) settings.key = key;
  section.number("tone_seconds", settings.seconds, {0.01, 1000});
  if (name == "schlick") {
    tone = settings;
    return;
  }
  for (const char* given : {"key", "tone_seconds"}) {
    if (section.has(given)) section.fault(given, "is for tone = \"schlick\"");
  }
}

DisplayChoice read_display_section(Section section) {
  DisplayChoice display;
  display.place = section.place();
  section.text("display", display.display);
  section.text("view", display.view);
  read_tone(section, display.tone);
  section.finish();
  return display;
}

// A time code that can be at the show's rate; where that is the plate's, at any.
void check_timecode(Section& section, const RecordSettings& record, const ShowSettings& show) {
  if (record.timecode.empty()) return;
  std::vector<capture::Rational> rates{{60, 1}, {60000, 1001}};
  if (show.fps) rates = {*show.fps};
  std::string why =
      fmt::format("\"{}\" is none at any rate up to 60 frames per second", record.timecode);
  for (const capture::Rational rate : rates) {
    try {
      static_cast<void>(compositing::parse_timecode(record.timecode, rate));
      return;
    } catch (const std::invalid_argument& error) {
      if (show.fps) why = error.what();
    }
  }
  section.fault("timecode", fmt::format("cannot be: {}", why));
}

}  // namespace

RecordSettings read_record_section(Section section,
                                   const std::filesystem::path& base,
                                   const ShowSettings& show) {
  RecordSettings record;
  record.place = section.place();
  const auto read_path = [&](std::string_view key, std::string& path) {
    if (section.text(key, path)) path = (base / path).lexically_normal().string();
  };
  read_path("file", record.file);
  read_path("exr", record.exr);
  read_path("fill", record.fill);
  read_path("key", record.key);
  for (const auto& [key, path] : {std::pair("file", &record.file), std::pair("fill", &record.fill),
                                  std::pair("key", &record.key)}) {
    if (!path->empty() && !path->ends_with(".mkv")) section.fault(key, "must end in .mkv");
  }
  if (!section.has("key") && section.has("fill")) section.fault("fill", "comes with record.key");
  if (!section.has("fill") && section.has("key")) section.fault("key", "comes with record.fill");
  section.word("codec", record.codec, {"h264", "lossless"});
  int crf = 0;
  if (section.integer("crf", crf, 0, 51)) record.crf = crf;
  section.of_use_only(record.codec != "lossless", "crf", "record.codec = \"h264\"");
  section.word("exr_compression", record.exr_compression, {"none", "rle", "zip", "piz"});
  section.text("timecode", record.timecode);
  check_timecode(section, record, show);
  section.finish();
  return record;
}

void read_fps(Section& section, std::optional<capture::Rational>& fps) {
  const TomlValue* value = section.value("fps");
  if (value == nullptr) return;
  if (value->kind == TomlValue::Kind::integer) {
    std::int64_t rate = 0;
    if (section.integer("fps", rate, 1, 1000)) fps = capture::Rational{rate, 1};
    return;
  }
  if (value->kind == TomlValue::Kind::text) {
    fps = parse_rational(value->text);
    if (fps && fps->value() >= 0.01 && fps->value() <= 1000) return;
    fps.reset();
  }
  section.fault("fps",
                "must be a whole number from 1 to 1000, or a fraction such as \"30000/1001\"");
}

SetError::SetError(std::vector<Diagnostic> diagnostics)
    : std::runtime_error(lines_of(diagnostics)), diagnostics_(std::move(diagnostics)) {}

render::Effort read_effort_section(Section section, render::Effort effort) {
  section.integer("aa_samples", effort.aa_samples, 1, render::samples_max);
  section.number("aa_tolerance", effort.aa_tolerance, {0, 1000});
  section.number("glint_contrast", effort.glint_contrast, {0, 1000});
  section.integer("light_samples", effort.light_samples, 1, 4096);
  section.integer("interleave", effort.interleave, 1, 4);
  if (effort.interleave == 3) section.fault("interleave", "must be 1, 2 or 4");
  section.integer("bounce_lamps", effort.bounce_lamps, 0, 1024);
  section.integer("caustic_photons", effort.caustic_photons, 0, render::most_caustic_photons);
  section.boolean("adaptive_visibility", effort.adaptive_visibility);
  section.boolean("soft_lights", effort.soft_lights);
  section.boolean("cull_lights", effort.cull_lights);
  section.number("accuracy", effort.accuracy, {0, 1});
  section.boolean("chance_cuts", effort.chance_cuts);
  section.integer("max_depth", effort.max_depth, 1, 64);
  section.integer("max_rays", effort.max_rays, 0, 1'000'000);
  section.integer("tile_size", effort.tile_size, 16, 1024);
  if (effort.tile_size % 16 != 0) section.fault("tile_size", "must be a multiple of 16");
  section.finish();
  return effort;
}

Set read_set(const std::string& path) {
  Faults faults(path);
  const TomlValue file = read_toml_file(path);

  Set set;
  set.path = path;
  Section root(file, "", faults);
  root.text("name", set.name);

  SetContext context;
  context.base = std::filesystem::absolute(path).parent_path();
  root.need("show", "every set has [show] with width and height");
  if (auto section = root.table("show")) set.show = read_show_section(*section);
  context.show = set.show;

  std::int64_t instances = 0;
  for (const Section& section : root.tables("object")) {
    set.objects.push_back(read_object_section(section, context));
    const auto before = std::span(set.objects).first(set.objects.size() - 1);
    if (const std::string& name = set.objects.back().name;
        !name.empty() && std::ranges::find(before, name, &ObjectSettings::name) != before.end()) {
      faults.add(section.place(), fmt::format("there are two objects named \"{}\"", name));
    }
    const auto& copies = set.objects.back().copies;
    instances += std::int64_t{copies[0]} * copies[1];
    if (instances > most_instances) {
      faults.add(section.place(),
                 fmt::format("object: {} instances so far, but a set holds at most {}", instances,
                             most_instances));
      break;
    }
  }
  for (const Section& section : root.tables("stand_in")) {
    set.stand_ins.push_back(read_stand_in_section(section, context));
  }
  for (const Section& section : root.tables("lamp")) {
    set.lamps.push_back(read_lamp_section(section));
  }
  for (const Section& section : root.tables("video")) {
    set.videos.push_back(read_video_section(section, context, false));
  }
  for (const Section& section : root.tables("video_light")) {
    set.videos.push_back(read_video_section(section, context, true));
  }
  name_videos(set.videos, faults);
  const std::vector<Section> persons = root.tables("billboard");
  context.has_scene = !set.objects.empty() || !set.stand_ins.empty() || !persons.empty();

  if (auto section = root.table("rig")) context.rig = read_rig_section(*section, context.base);
  root.need("camera", "every set has [camera] with a source");
  if (auto section = root.table("camera")) set.camera = read_camera_section(*section, context);
  context.plate_offset_s = set.camera.rig_offset_s;
  for (const Section& section : persons) {
    set.persons.push_back(read_billboard_section(section, context));
  }
  refuse_same_names(set.persons, faults);
  if (auto section = root.table("probe")) set.probe = read_probe_section(*section, context);
  if (auto section = root.table("effort")) set.effort = read_effort_section(*section);
  if (auto section = root.table("display")) set.display = read_display_section(*section);
  if (auto section = root.table("record")) {
    set.record = read_record_section(*section, context.base, context.show);
  }
  root.finish();
  refuse_shared_devices(set, faults);

  std::vector<Diagnostic> diagnostics = faults.sorted();
  if (!diagnostics.empty()) throw SetError(std::move(diagnostics));
  set.files = faults.named();
  return set;
}

}  // namespace studio
