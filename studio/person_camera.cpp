// One camera of a person.
#include "studio/person_camera.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "capture/half.h"
#include "compositing/keyed_picture.h"
#include "compositing/person_box.h"
#include "studio/clean_plates.h"
#include "studio/key_masks.h"
#include "studio/plate_lens.h"
#include "studio/section.h"

namespace studio {
namespace {

using compositing::Feet;

// Feet are looked for in a matte whose longer side is at most so long.
constexpr int matte_side = 640;
constexpr capture::Rational rate_of_unknown{25, 1};

// Alpha of a keyed picture, area-averaged `shrink` times smaller.
capture::Image matte_of(const compositing::KeyedFrame& keyed, int shrink) {
  constexpr int run = compositing::KeyedFrame::run;
  const capture::HalfImage& rgba = keyed.image();
  capture::Image matte =
      capture::make_image(std::max(1, rgba.height / shrink), std::max(1, rgba.width / shrink), 1);
  const float part = 1 / static_cast<float>(shrink * shrink);
  const int height = std::min(matte.height * shrink, rgba.height);
  const int width = std::min(matte.width * shrink, rgba.width);
  for (int y = 0; y < height; ++y) {
    for (int first = 0; first < width; first += run) {
      if (!keyed.has_any(y, first)) continue;
      float* to = &matte.at(y / shrink, first / shrink);
      int left = shrink - first % shrink;  // pixels of the row that still belong there
      for (int x = first; x < std::min(first + run, width); ++x) {
        *to += part * capture::float_from_half(rgba.pixels[rgba.index(y, x, 3)]);
        if (--left > 0) continue;
        ++to;
        left = shrink;
      }
    }
  }
  return matte;
}

int shrink_of(int height, int width) {
  return std::max(1, (std::max(height, width) + matte_side - 1) / matte_side);
}

// From pixels of the matte to those of the picture.
void enlarge(std::array<float, 4>& box, int shrink) {
  for (float& edge : box) edge = (edge + 0.5F) * static_cast<float>(shrink) - 0.5F;
}

Feet enlarged(Feet feet, int shrink) {
  const double times = shrink;
  const auto enlarge_place = [&](calibrate::Vec2& q) {
    q = {(q.x + 0.5) * times - 0.5, (q.y + 0.5) * times - 0.5};
  };
  enlarge_place(feet.q);
  std::ranges::for_each(feet.lower, enlarge_place);
  feet.sigma_px *= times;
  enlarge(feet.box, shrink);
  return feet;
}

// The part of a picture that an outline is in, and so far around it that what is seen a twentieth
// as large still ends within. Both are edges in pixels; all of it where the outline is none of it.
compositing::Window window_about(const std::array<float, 4>& outline,
                                 const std::array<float, 4>& picture) {
  const float width = picture[2] - picture[0], height = picture[3] - picture[1];
  const float around = std::max(width, height) / 32;
  const auto at = [](float pixel, float first, float size) {
    return std::clamp((pixel - first) / size, 0.0F, 1.0F);
  };
  const compositing::Window window{
      at(outline[0] - around, picture[0], width), at(outline[1] - around, picture[1], height),
      at(outline[2] + around, picture[0], width), at(outline[3] + around, picture[1], height)};
  const bool any = window.left < window.right && window.top < window.bottom;
  return any ? window : compositing::Window();
}

VideoSource video_of(const PersonCamera& s, const std::string& base_dir) {
  return {s.source, base_dir, s.loop, s.first, s.colour, !s.key, s.response, s.crop, s.deinterlace};
}

std::shared_ptr<TimedSource> open_source(const VideoSource& source,
                                         const PersonCameraFeed::Options& options,
                                         const std::string& held) {
  try {
    return std::make_shared<TimedSource>(source, options.start, options.live);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(error.what() + held);
  }
}

FileTimes times_of(const PersonCamera& camera) {
  const KeyChoice none, &key = camera.key ? *camera.key : none;
  return file_times({camera.response, key.plate, key.masks.garbage, key.masks.core});
}

// As apart_px() of plate_lens.h, of a plate that was taken on air; nothing where a lens is unknown.
std::optional<double> apart_px(const PlateTaking& taking,
                               const PersonCamera& camera,
                               const ShownPart& shown) {
  if (!taking.lens() || !camera.lens) return std::nullopt;
  return studio::apart_px(*taking.lens(), *camera.lens, shown);
}

void require_taken_through_lens(const PlateTaking& taking,
                                const PersonCamera& camera,
                                const ShownPart& shown) {
  const auto apart = apart_px(taking, camera, shown);
  if (!apart) return;
  throw std::runtime_error(fmt::format(
      "the plate was taken on air through a lens with {}, but the set's, {}, has {}: the same "
      "things lie up to {:.4g} px apart in the picture's middle. Give `take` another number, to "
      "take it anew while nobody is there",
      words_for_lens(*taking.lens()), camera.lens_file.empty() ? "written there" : camera.lens_file,
      words_for_lens(*camera.lens), *apart));
}

// But for where in their files they are written.
bool same(PersonCamera a, PersonCamera b) {
  a.place = b.place;
  if (a.key && b.key) a.key->place = b.key->place;
  return a == b;
}

}  // namespace

std::shared_ptr<const render::LivePicture> clear_picture() {
  capture::Image clear = capture::make_image(1, 1, 4);
  return std::make_shared<compositing::KeyedPicture>(compositing::make_keyed_texture(clear));
}

PersonCameraFeed::PersonCameraFeed(const PersonCamera& settings,
                                   const Options& options,
                                   Faults& faults,
                                   const PersonCameraFeed* before,
                                   const std::string& held)
    : settings_(settings),
      options_(options),
      times_(times_of(settings)),
      picture_(clear_picture()) {
  const PersonCamera& s = settings_;
  const VideoSource source = video_of(s, options.base_dir);
  try {
    opened_ = before ? before->opened_ : source;
    source_ = before ? before->source_ : open_source(source, options, held);
    const capture::CameraInfo& info = source_->info();
    if (s.lens && (s.lens->width != info.width || s.lens->height != info.height)) {
      throw std::invalid_argument(
          fmt::format("the video's picture is {}x{}, but its lens is for {}x{}", info.width,
                      info.height, s.lens->width, s.lens->height));
    }
    const auto& first = source_->first().image;
    if (options.needs_matte && !s.key && first && first->channels != 4) {
      throw std::invalid_argument(
          "the video has no alpha: a person who is found by its feet, or shown as a hull, needs a "
          "key");
    }
    aspect_ = static_cast<float>(info.width * info.pixel_aspect.value() / info.height);
    period_ = capture::time_of_frame(1, info.rate.num > 0 ? info.rate : rate_of_unknown);
  } catch (const std::exception& error) {
    faults.add(s.place, error.what());
    return;
  }
  if (!s.key) return;
  try {
    begin_key(source, before);
  } catch (const std::exception& error) {
    faults.add(s.key->place, error.what());
  }
}

// The plate as the set has it.
compositing::CleanPlate PersonCameraFeed::read_plate(const VideoSource& source,
                                                     const ShownPart& shown) const {
  const KeyChoice& key = *settings_.key;
  const capture::CameraInfo& info = source_->info();
  if (key.plate.empty() && info.live)
    throw std::invalid_argument(needs_plate(settings_.source) + ", or plate = \"take\"");
  auto plate = read_clean_plate(key.plate, source, key.settings, key.footage, shown);
  if (plate.light.width != info.width || plate.light.height != info.height) {
    throw std::invalid_argument(fmt::format(
        "the clean plate {} is {}x{}, but the video {} is {}x{}", key.plate, plate.light.width,
        plate.light.height, settings_.source, info.width, info.height));
  }
  if (settings_.lens && !key.plate.empty())
    require_plate_of_lens(key.plate, *settings_.lens, settings_.lens_file, shown);
  return plate;
}

// Files that are too short for a plate to be taken of them are told before the show.
void PersonCameraFeed::check_length() const {
  const capture::CameraInfo& info = source_->info();
  const std::int64_t left = info.frames - settings_.first;
  const bool repeats = settings_.loop && info.frames > 1;
  if (info.live || info.frames <= 0 || repeats ||
      left >= static_cast<std::int64_t>(shots_of_plate)) {
    return;
  }
  throw std::invalid_argument(
      fmt::format("a plate is taken of {} frames, but {} has {} from its beginning on",
                  shots_of_plate, settings_.source, std::max<std::int64_t>(left, 0)));
}

// As matte_of() has the matte.
void PersonCameraFeed::keep_garbage(const compositing::KeyMasks& masks) {
  if (masks.garbage.empty() || !settings_.lens) return;
  const capture::CameraInfo& info = source_->info();
  const int shrink = shrink_of(info.height, info.width);
  garbage_ =
      capture::make_image(std::max(1, info.height / shrink), std::max(1, info.width / shrink), 1);
  const float part = 1 / (255 * static_cast<float>(shrink * shrink));
  const auto row = static_cast<std::size_t>(info.width);
  for (int y = 0; y < std::min(garbage_.height * shrink, info.height); ++y) {
    for (int x = 0; x < std::min(garbage_.width * shrink, info.width); ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * row + static_cast<std::size_t>(x);
      garbage_.at(y / shrink, x / shrink) += part * static_cast<float>(masks.garbage[i]);
    }
  }
}

void PersonCameraFeed::make_keyer(const compositing::CleanPlate& plate,
                                  compositing::KeyMasks masks) {
  keyer_ = std::make_unique<compositing::Keyer>(plate, settings_.key->settings, std::move(masks));
}

void PersonCameraFeed::begin_key(const VideoSource& source, const PersonCameraFeed* before) {
  const KeyChoice& key = *settings_.key;
  const capture::CameraInfo& info = source_->info();
  const ShownPart shown = shown_part(info, source);
  by_texel_ = key.by_texel && !options_.needs_matte;
  if (!key.takes_plate) {
    const auto plate = read_plate(source, shown);
    auto masks = read_key_masks(key.masks, info.width, info.height, shown);
    keep_garbage(masks);
    make_keyer(plate, std::move(masks));
    return;
  }
  masks_ = read_key_masks(key.masks, info.width, info.height, shown);
  keep_garbage(masks_);
  const KeyChoice* const was = before && before->settings_.key ? &*before->settings_.key : nullptr;
  if (was && was->takes_plate && was->take == key.take) {
    require_taken_through_lens(*before->taking_, settings_, shown);
    taking_ = before->taking_;
    if (const auto plate = taking_->plate()) {
      make_keyer(*plate, std::move(masks_));
      return;
    }
  } else {
    check_length();
    if (was && was->takes_plate && before->keyer_ && !apart_px(*before->taking_, settings_, shown))
      plate_before_ = before->taking_->plate();
    const bool by_screen = key.settings.method == compositing::KeyMethod::screen;
    taking_ = std::make_shared<PlateTaking>(masks_.garbage, by_screen, !info.live,
                                            key.settings.screen_colour, settings_.lens);
    notes_.push_back(fmt::format(
        "takes its plate of the next {} frames: nobody may be in the picture", shots_of_plate));
  }
  key_ = "its plate is being taken";
  confidence_ = 0;
}

// A plate that fails leaves its person out, and the show goes on.
void PersonCameraFeed::go_on_with_plate(bool good) {
  if (plate_failed_) return;
  try {
    take_plate(good);
  } catch (const std::exception& error) {
    give_up_plate(error.what());
  }
}

void PersonCameraFeed::give_up_plate(const std::string& why) {
  plate_failed_ = true;
  if (!plate_before_) {
    notes_.push_back(fmt::format("has no plate: {}", why));
    return;
  }
  notes_.push_back(fmt::format("has no new plate: {}; it is keyed by the one before", why));
  make_keyer(*plate_before_, std::move(masks_));
}

// One more frame of the empty screen; after the last one the key begins, which takes a moment.
void PersonCameraFeed::take_plate(bool good) {
  if (good) taking_->add(image_);
  const auto plate = taking_->plate();
  if (!plate) return;
  if (!coming_keyer_.valid()) {
    coming_keyer_ = std::async(
        std::launch::async, [plate, settings = settings_.key->settings, masks = masks_]() mutable {
          return std::make_unique<compositing::Keyer>(*plate, settings, std::move(masks));
        });
  }
  if (!source_->info().live) coming_keyer_.wait();
  if (coming_keyer_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
  keyer_ = coming_keyer_.get();
  masks_ = {};
  if (const auto doubts = taking_->take_doubts()) {
    notes_.push_back(doubts->empty() ? "has its plate" : "has its plate, but " + *doubts);
  }
}

std::vector<std::string> PersonCameraFeed::take_notes() {
  std::vector<std::string> notes = source_->take_notes();
  notes.insert(notes.end(), notes_.begin(), notes_.end());
  notes_.clear();
  return notes;
}

bool PersonCameraFeed::serves(const PersonCamera& settings, const Options& options) const {
  Options asked = options;
  asked.start = options_.start;
  return asked == options_ && same(settings, settings_) && times_of(settings) == times_;
}

bool PersonCameraFeed::has_source_of(const PersonCamera& settings) const {
  VideoSource asked = video_of(settings, options_.base_dir);
  // Of what has no alpha, devices as well, it does not matter whether it was asked for.
  const auto& first = source_->first().image;
  const bool has_none = opened_.alpha && first && first->channels != 4;
  if (has_none || source_->info().live) asked.alpha = opened_.alpha;
  return asked == opened_;
}

std::string PersonCameraFeed::words_for_held(const PersonCamera& asked,
                                             const std::string& holder) const {
  if (!source_->info().live || asked.source != opened_.uri) return "";
  return studio::words_for_held(opened_, video_of(asked, options_.base_dir), holder);
}

void PersonCameraFeed::advance(capture::Time time) {
  const auto offset =
      std::chrono::duration_cast<capture::Time>(std::chrono::duration<double>(settings_.offset_s));
  const std::optional<capture::Frame> frame = source_->at(time, offset);
  const capture::Frame& newest = frame && frame->image ? *frame : source_->newest();
  if (takes_plate() && !plate_failed_ && !source_->info().live) {
    same_picture_for_ = frame && newest.image == image_ ? same_picture_for_ + 1 : 0;
    const bool stands = same_picture_for_ > shots_of_plate;
    if (!frame || stands) {
      give_up_plate(fmt::format("its video {} after {} of {} pictures",
                                stands ? "stands still" : "has ended", taking_->given(),
                                shots_of_plate));
    }
  }
  if (newest.image == image_ || !newest.image) return;
  skipped_ = image_ != shown_ || newest.pass_first != pass_;
  pass_ = newest.pass_first;
  image_ = newest.image;
  time_ = newest.time;
  if (takes_plate()) go_on_with_plate(newest.status == capture::FrameStatus::good);
}

bool PersonCameraFeed::show() {
  if (image_ == shown_ || takes_plate()) return false;
  key_frame();
  shown_ = image_;
  return true;
}

void PersonCameraFeed::key_frame() {
  const capture::Image& image = *image_;
  const auto texture = textures_.lend();
  if (!keyer_) {
    texture->take(image);
    if (image.channels == 4) return show_keyed(texture);
    feet_ = {}, has_matte_ = false, outline_.reset();
    picture_ = std::make_shared<compositing::KeyedPicture>(texture, options_.bounded);
    return;
  }
  if (std::exchange(skipped_, false)) keyer_->restart();
  const compositing::KeyReport report =
      by_texel_ ? keyer_->follow(image) : keyer_->key(image, texture->frame());
  confidence_ = report.confidence;
  key_ = compositing::name_of(report.status);
  ghost_ = report.ghost;
  moved_.reset();
  if (report.moved) moved_ = report.shift;
  if (by_texel_) {
    texture->take(image);
    picture_ = std::make_shared<compositing::TexelKeyedPicture>(
        texture, keyer_->shared_lit(), keyer_->shared_filtered(), keyer_->dials());
    return;
  }
  texture->finish();
  show_keyed(texture);
}

void PersonCameraFeed::show_keyed(std::shared_ptr<const compositing::KeyedTexture> texture) {
  // A video's own alpha is no noise: all of it is shown.
  const bool cut = keyer_ && !settings_.lens;
  if (cut || settings_.lens) look_for_person(texture->frame());
  window_ = cut ? window_about(outline(), whole()) : compositing::Window();
  picture_ = see_through(
      window_, std::make_shared<compositing::KeyedPicture>(std::move(texture), options_.bounded));
}

void PersonCameraFeed::look_for_person(const compositing::KeyedFrame& keyed) {
  const int shrink = shrink_of(keyed.image().height, keyed.image().width);
  const capture::Image matte = matte_of(keyed, shrink);
  if (settings_.lens) {
    has_matte_ = true;
    const int turns = compositing::turns_to_upright(settings_.cam_from_set);
    feet_ = enlarged(compositing::find_feet(matte, turns, garbage_), shrink);
    if (!options_.bounded) return;
  }
  outline_ = compositing::outline_box(matte);
  if (outline_) enlarge(*outline_, shrink);
}

std::array<float, 4> PersonCameraFeed::whole() const {
  const auto [width, height] = std::pair(source_->info().width, source_->info().height);
  return {-0.5F, -0.5F, static_cast<float>(width) - 0.5F, static_cast<float>(height) - 0.5F};
}

std::array<float, 4> PersonCameraFeed::person_box() const {
  return shown_ && feet_.box[2] <= feet_.box[0] ? whole() : feet_.box;
}

std::array<float, 4> PersonCameraFeed::outline() const { return outline_ ? *outline_ : whole(); }

}  // namespace studio
