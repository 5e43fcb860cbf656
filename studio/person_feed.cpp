// Persons, frame by frame.
#include "studio/person_feed.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "compositing/billboard_place.h"
#include "compositing/keyed_picture.h"
#include "studio/clean_plates.h"
#include "studio/section.h"

namespace studio {
namespace {

using compositing::Feet;
using compositing::FeetStatus;

constexpr double degree = std::numbers::pi / 180;
// Feet are looked for in a matte whose longer side is at most so long.
constexpr int matte_side = 640;
// Below this the key is uncertain, and the show says so.
constexpr float sure = 0.5F;

std::shared_ptr<const render::LivePicture> clear_picture() {
  capture::Image clear = capture::make_image(1, 1, 4);
  return std::make_shared<compositing::KeyedPicture>(
      std::make_shared<render::VideoTexture>(render::make_video_texture(clear)));
}

compositing::KeyMasks masks_of(const KeyChoice& key) {
  compositing::KeyMasks masks;
  if (key.garbage.empty()) return masks;
  const capture::Image mask = read_picture(key.garbage, capture::Transfer::linear);
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      masks.garbage.push_back(
          static_cast<std::uint8_t>(std::clamp(mask.at(y, x) * 255 + 0.5F, 0.0F, 255.0F)));
    }
  }
  return masks;
}

// Alpha of a keyed picture of (height, width, 4), area-averaged `shrink` times smaller.
capture::Image matte_of(const capture::Image& rgba, int shrink) {
  capture::Image matte =
      capture::make_image(std::max(1, rgba.height / shrink), std::max(1, rgba.width / shrink), 1);
  const float part = 1 / static_cast<float>(shrink * shrink);
  for (int y = 0; y < matte.height * shrink; ++y) {
    for (int x = 0; x < matte.width * shrink; ++x) {
      if (y < rgba.height && x < rgba.width) {
        matte.at(y / shrink, x / shrink) += part * rgba.at(y, x, 3);
      }
    }
  }
  return matte;
}

// From pixels of the matte to those of the picture.
Feet enlarged(Feet feet, int shrink) {
  const double times = shrink;
  feet.q = {(feet.q.x + 0.5) * times - 0.5, (feet.q.y + 0.5) * times - 0.5};
  feet.sigma_px *= times;
  for (float& edge : feet.box) edge = (edge + 0.5F) * static_cast<float>(shrink) - 0.5F;
  return feet;
}

}  // namespace

struct PersonFeed::Person {
  PersonSettings settings;
  std::unique_ptr<TimedSource> source;
  std::optional<compositing::Keyer> keyer;
  std::optional<compositing::FeetTracker> tracker;
  std::shared_ptr<const capture::Image> image;  // that `frame.picture` was made from
  capture::HalfImage keyed;
  Feet feet;
  std::optional<compositing::Standing> standing;
  float aspect = 1;  // of its picture: width over height
  bool unsure = false;
  PersonFrame frame;
};

PersonFeed::PersonFeed(const Set& set, std::optional<capture::Time> start, bool live) {
  Faults faults(set.path);
  const std::string base_dir = std::filesystem::absolute(set.path).parent_path().string();
  for (std::size_t i = 0; i < set.persons.size(); ++i) {
    auto person = std::make_shared<Person>();
    person->settings = set.persons[i];
    const PersonSettings& s = person->settings;
    person->frame.picture = clear_picture();
    person->frame.status.name = s.name.empty() ? fmt::format("person {}", i + 1) : s.name;
    const VideoSource source{s.source, base_dir, s.loop, s.first, s.colour};
    try {
      person->source = std::make_unique<TimedSource>(source, start, live);
      const capture::CameraInfo& info = person->source->info();
      if (s.lens && (s.lens->width != info.width || s.lens->height != info.height)) {
        throw std::invalid_argument(
            fmt::format("the video's picture is {}x{}, but its lens is for {}x{}", info.width,
                        info.height, s.lens->width, s.lens->height));
      }
      person->aspect = static_cast<float>(info.width) / static_cast<float>(info.height);
      if (s.by_feet) person->tracker.emplace(*s.lens, s.cam_from_set, s.floor_z);
    } catch (const std::exception& error) {
      faults.add(s.place, error.what());
      continue;
    }
    try {
      if (s.key) {
        const capture::CameraInfo& info = person->source->info();
        auto plate = read_clean_plate(s.key->plate, source, s.key->footage);
        if (plate.light.width != info.width || plate.light.height != info.height) {
          throw std::invalid_argument(fmt::format(
              "the clean plate {} is {}x{}, but the video {} is {}x{}", s.key->plate,
              plate.light.width, plate.light.height, s.source, info.width, info.height));
        }
        person->keyer.emplace(std::move(plate), s.key->settings, masks_of(*s.key));
      }
    } catch (const std::exception& error) {
      faults.add(s.key->place, error.what());
    }
    persons_.push_back(std::move(person));
  }
  if (const auto all = faults.sorted(); !all.empty()) throw SetError(all);
}

std::vector<std::shared_ptr<const render::LivePicture>> PersonFeed::nothing_yet() const {
  std::vector<std::shared_ptr<const render::LivePicture>> pictures;
  for (const auto& person : persons_) pictures.push_back(person->frame.picture);
  return pictures;
}

void PersonFeed::key(Person& person, const capture::Image& image) {
  PersonStatus& status = person.frame.status;
  auto texture = textures_.lend();
  compositing::Keyer& keyer = *person.keyer;
  // The feet are looked for in the matte: a person who stands by them needs all of it.
  const bool by_texel = person.settings.key->by_texel && !person.tracker;
  const compositing::KeyReport report =
      by_texel ? keyer.follow(image) : keyer.key(image, person.keyed);
  status.confidence = report.confidence;
  status.key = compositing::name_of(report.status);
  const bool unsure = report.confidence < sure;
  if (unsure && !person.unsure) {
    notes_.push_back(fmt::format("{}: the key is unsure ({})", status.name, status.key));
  }
  person.unsure = unsure;
  if (by_texel) {
    render::make_video_texture(image, *texture);
    person.frame.picture = std::make_shared<compositing::TexelKeyedPicture>(
        std::move(texture), keyer.lit(), keyer.dials());
    return;
  }
  const capture::Image keyed = capture::to_float(person.keyed);
  render::make_video_texture(keyed, *texture);
  person.frame.picture = std::make_shared<compositing::KeyedPicture>(std::move(texture));
  find_feet(person, keyed);
}

void PersonFeed::find_feet(Person& person, const capture::Image& rgba) {
  person.feet = {};
  if (!person.settings.lens) return;
  const int longer = std::max(rgba.width, rgba.height);
  const int shrink = std::max(1, (longer + matte_side - 1) / matte_side);
  person.feet = enlarged(compositing::find_feet(matte_of(rgba, shrink)), shrink);
}

void PersonFeed::stand(Person& person, capture::Time time) {
  if (!person.tracker) return;
  PersonStatus& status = person.frame.status;
  person.standing =
      person.tracker->update(std::chrono::duration<double>(time).count(), person.feet);
  const bool lost = person.feet.status != FeetStatus::seen;
  if (lost && status.feet == compositing::name_of(FeetStatus::seen)) {
    notes_.push_back(fmt::format("{}: its feet are {}; it stays where it is", status.name,
                                 compositing::name_of(person.feet.status)));
  }
  status.feet = compositing::name_of(person.feet.status);
}

void PersonFeed::show(Person& person, const capture::Image& image, capture::Time time) {
  if (person.keyer) {
    key(person, image);
  } else {
    auto texture = textures_.lend();
    render::make_video_texture(image, *texture);
    person.frame.picture = std::make_shared<compositing::KeyedPicture>(std::move(texture));
    if (image.channels == 4) find_feet(person, image);
  }
  stand(person, time);
}

void PersonFeed::update(Person& person, capture::Time time) {
  const std::optional<capture::Frame> frame = person.source->at(time);
  if (const auto note = person.source->take_note()) {
    notes_.push_back(fmt::format("{} {}: its last picture stays", person.frame.status.name, *note));
  }
  const capture::Frame& shown = frame ? *frame : person.source->first();
  const bool newer = frame ? frame->image != person.image : person.image == nullptr;
  if (!newer || !shown.image) return;
  person.image = shown.image;
  show(person, *shown.image, shown.time);
}

// Upright, and turned to the show's camera as far as the set says.
void PersonFeed::place(Person& person, const calibrate::Pose& cam_from_set) {
  const PersonSettings& s = person.settings;
  PersonStatus& status = person.frame.status;
  const calibrate::Vec3 viewer = calibrate::position_of(cam_from_set);
  status.position = person.standing ? person.standing->p_set : s.position;
  status.sigma_m = person.standing ? person.standing->sigma_m : 0;
  status.held = person.standing && person.standing->held;
  if (s.by_feet && !person.standing) {
    person.frame.picture = clear_picture();  // nobody knows where
    return;
  }
  if (s.lens) {
    std::array<float, 4> box = person.feet.box;
    if (person.frame.picture && person.image && box[2] <= box[0]) {
      box = {-0.5F, -0.5F, static_cast<float>(s.lens->width) - 0.5F,
             static_cast<float>(s.lens->height) - 0.5F};
    }
    const auto placed = compositing::place_billboard(*s.lens, s.cam_from_set, status.position, box,
                                                     viewer, s.turn_rad);
    if (!placed) return;  // as it was
    person.frame.set_from_object = placed->set_from_object;
    status.view_angle_deg = placed->view_angle_rad / degree;
    status.shallow = placed->shallow;
    return;
  }
  // Faces the way that the set says, and from there turns to the camera.
  const double to_viewer = std::atan2(viewer.x - s.position.x, -(viewer.y - s.position.y));
  const compositing::Facing facing = compositing::face(s.yaw_rad, to_viewer, s.turn_rad);
  status.view_angle_deg = facing.view_angle_rad / degree;
  status.shallow = facing.shallow;
  const double turned = facing.azimuth_rad;
  const auto wide = static_cast<float>(s.height_m) * person.aspect;
  const auto c = static_cast<float>(std::cos(turned)), sine = static_cast<float>(std::sin(turned));
  const auto at = calibrate::to_float(s.position);
  person.frame.set_from_object = {wide * c,    -sine, 0,
                                  at.x,  //
                                  wide * sine, c,     0,
                                  at.y,  //
                                  0,           0,     static_cast<float>(s.height_m),
                                  at.z};
}

std::vector<PersonFrame> PersonFeed::at(capture::Time time, const calibrate::Pose& cam_from_set) {
  std::vector<PersonFrame> frames;
  for (const auto& person : persons_) {
    update(*person, time);
    const bool was_shallow = person->frame.status.shallow;
    place(*person, cam_from_set);
    const PersonStatus& status = person->frame.status;
    if (status.shallow && !was_shallow) {
      notes_.push_back(
          fmt::format("{}: seen {:.0f} degrees from the side, more than it turns ({:.0f})",
                      status.name, status.view_angle_deg, person->settings.turn_rad / degree));
    }
    frames.push_back(person->frame);
  }
  return frames;
}

std::vector<std::string> PersonFeed::take_notes() { return std::exchange(notes_, {}); }

}  // namespace studio
