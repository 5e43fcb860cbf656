// Two Matroska files whose pictures stay locked to each other: as many, with the same times.
#include "compositing/locked_videos.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "compositing/output_file.h"

namespace compositing {
namespace {

constexpr double checkpoints_a_second = 2;

const VideoSettings& checked(const VideoSettings& first, const VideoSettings& second) {
  validate(first);
  validate(second);
  if (is_one_file(first.file, second.file)) {
    throw std::invalid_argument(first.file + ": two videos cannot be one file");
  }
  if (first.rate.num != second.rate.num || first.rate.den != second.rate.den ||
      first.timecode != second.timecode) {
    throw std::invalid_argument(second.file +
                                ": videos of two rates or timecodes cannot be locked");
  }
  return first;
}

}  // namespace

LockedVideos::LockedVideos(const VideoSettings& first, const VideoSettings& second)
    : pictures_between_(std::max<std::int64_t>(
          1, std::llround(checked(first, second).rate.value() / checkpoints_a_second))),
      first_(first),
      second_(second) {}

void LockedVideos::checkpoint() {
  first_.checkpoint();
  second_.checkpoint();
}

void LockedVideos::write_pictures(std::int64_t index,
                                  std::span<const std::uint8_t> first,
                                  std::span<const std::uint8_t> second) {
  // Before the picture, so that sound which came with those before it is in.
  if (!checkpoint_ || index - *checkpoint_ >= pictures_between_) {
    checkpoint();
    checkpoint_ = index;
  }
  broken_ = true;
  first_.write_picture(index, first);
  second_.write_picture(index, second);
  broken_ = false;
}

void LockedVideos::write_sound(std::int64_t first, std::span<const float> samples) {
  first_.write_sound(first, samples);
}

void LockedVideos::close() {
  if (!checkpoint_) return;
  checkpoint();
  // All pictures are in both before either is finished: what fails until then is cut back in both.
  first_.drain();
  second_.drain();
  try {
    first_.close();
  } catch (const std::runtime_error&) {
    second_.close();
    throw;
  }
  second_.close();
}

void LockedVideos::salvage() noexcept {
  if (!broken_) {
    try {
      close();
    } catch (const std::exception&) {
      // Then they are cut back like those that broke.
    }
  }
  VideoWriter::salvage_together(first_, second_);
}

}  // namespace compositing
