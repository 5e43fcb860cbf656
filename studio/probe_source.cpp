// Lightprobes as sources of radiance.
#include "studio/probe_source.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "capture/hdr.h"
#include "capture/make_hdr.h"

namespace studio {
namespace {

constexpr std::size_t longest_cycle = 16;  // exposures of a bracket
constexpr double same_exposure = 0.02;     // relative

bool about_equal(double a, double b) { return std::abs(a - b) <= same_exposure * b; }

[[noreturn]] void fail(const Set& set, const std::string& message) {
  const Place place = set.probe->source_place;
  throw SetError({{set.path, place.line, place.column, message}});
}

}  // namespace

RollingBracket::RollingBracket(std::vector<double> exposures_s) {
  for (const double exposure_s : exposures_s) slots_.push_back({exposure_s, nullptr});
}

void RollingBracket::add(std::shared_ptr<const capture::Image> linear, double exposure_s) {
  if (width_ == 0) {
    width_ = linear->width;
    height_ = linear->height;
  }
  if (linear->width != width_ || linear->height != height_ || linear->channels != 3) {
    throw std::invalid_argument("the shots of a bracket must have one size and three channels");
  }
  const auto nearest = std::ranges::min_element(slots_, {}, [&](const Slot& slot) {
    return std::abs(std::log(slot.exposure_s / exposure_s));
  });
  *nearest = {exposure_s, std::move(linear)};
}

std::shared_ptr<const capture::Image> RollingBracket::merge() {
  std::vector<capture::LiveShot> shots;
  for (const Slot& slot : slots_) {
    if (slot.linear != nullptr) shots.push_back({slot.linear.get(), slot.exposure_s});
  }
  std::shared_ptr<capture::Image> radiance = pool_.lend();
  capture::merge_live_shots(shots, {}, *radiance);
  return radiance;
}

ProbeSource::ProbeSource(const Set& set) {
  const ProbeSettings& probe = *set.probe;
  exposures_s_ = probe.exposures_s;
  offset_ =
      std::chrono::duration_cast<capture::Time>(std::chrono::duration<double>(probe.offset_s));
  try {
    if (probe.shots.empty()) {
      open_camera(set, probe);
      return;
    }
    capture::HdrOptions options;
    options.exposures_s = probe.exposures_s;
    if (!probe.response.empty()) options.response = probe.response;
    newest_.image =
        std::make_shared<capture::Image>(capture::make_hdr(probe.shots, options).radiance);
  } catch (const std::runtime_error& error) {
    fail(set, error.what());
  } catch (const std::invalid_argument& error) {
    fail(set, error.what());
  }
}

void ProbeSource::open_camera(const Set& set, const ProbeSettings& probe) {
  capture::CameraOptions options;
  options.colour.transfer = probe.colour;
  options.response = probe.response;
  options.loop = set.camera.loop;
  if (set.show.fps) options.picture_rate = *set.show.fps;
  camera_ = std::make_unique<Source>(capture::open_camera(probe.source, options));
  if (camera_->first().image == nullptr) throw std::runtime_error("its first frame is lost");
  if (camera_->is_still()) {
    newest_ = {camera_->first().image, camera_->first().time};
    camera_.reset();
    return;
  }
  prime();
}

double ProbeSource::exposure_s_of(const capture::Frame& frame) const {
  if (exposures_s_.empty()) return frame.exposure_s;
  return exposures_s_[static_cast<std::size_t>(frame.number) % exposures_s_.size()];
}

// The first cycle is taken at once, so that no frame is lit by half a bracket.
void ProbeSource::prime() {
  std::vector<capture::Frame> cycle{camera_->first()};
  std::vector<double> exposures_s{exposure_s_of(cycle.front())};
  while (exposures_s.back() > 0 && cycle.size() < longest_cycle) {
    const std::optional<capture::Time> time = camera_->next_time();
    if (!time) break;
    const capture::Frame frame = camera_->advance(*time).front();
    const double exposure_s = exposure_s_of(frame);
    cycle.push_back(frame);
    const bool again = std::ranges::any_of(
        exposures_s, [&](double other) { return about_equal(exposure_s, other); });
    if (again) break;
    exposures_s.push_back(exposure_s);
  }
  if (exposures_s.size() > 1) bracket_ = std::make_unique<RollingBracket>(exposures_s);
  take(cycle);
}

void ProbeSource::take(const std::vector<capture::Frame>& frames) {
  bool fresh = false;
  for (const capture::Frame& frame : frames) {
    if (frame.status == capture::FrameStatus::lost || frame.image == nullptr) continue;
    fresh = true;
    newest_.time = frame.time;
    if (bracket_) {
      bracket_->add(frame.image, exposure_s_of(frame));
    } else {
      newest_.image = frame.image;
    }
  }
  if (fresh && bracket_) newest_.image = bracket_->merge();
}

ProbeSource::Radiance ProbeSource::at(capture::Time time) {
  if (camera_) take(camera_->advance(time - offset_));
  return newest_;
}

}  // namespace studio
