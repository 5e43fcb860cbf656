// Where a board is in the frames of a video.
#include "studio/commands/board_places.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <utility>

#include "calibrate/board_detector.h"
#include "capture/parallel_loop.h"

namespace studio {

calibrate::GreyPicture small_picture(const capture::Image& image) {
  constexpr int longest = 1000;
  const int factor = (std::max(image.width, image.height) + longest - 1) / longest;
  if (factor == 1) return calibrate::grey_picture(image);
  // What is left over at the right and below is cut off.
  capture::Image small = capture::make_image(image.height / factor, image.width / factor, 1);
  const int channels = std::min(image.channels, 3);
  for (int y = 0; y < small.height * factor; ++y) {
    for (int x = 0; x < small.width * factor; ++x) {
      float sum = 0;
      for (int c = 0; c < channels; ++c) sum += image.at(y, x, c);
      if (std::isfinite(sum)) small.at(y / factor, x / factor) += sum;
    }
  }
  return calibrate::grey_picture(small);
}

std::unique_ptr<capture::Camera> open_recorded(const std::string& source) {
  const auto refuse = [&] {
    throw std::runtime_error(source +
                             ": is a live camera, which shows no end of pictures: record it first "
                             "(platelight capture record), and name replay: with its folder");
  };
  if (capture::is_device(source)) refuse();
  auto camera = capture::open_camera(source);
  if (camera->info().live) refuse();
  return camera;
}

BoardPlaces find_board_places(const std::vector<TimedPicture>& pictures,
                              const calibrate::Board& board,
                              const std::string& camera,
                              Console& console) {
  // Ten times what finding it takes; only frames that show a part of it would take longer.
  constexpr std::chrono::milliseconds limit{300};
  std::vector<std::optional<calibrate::Vec2>> middles(pictures.size());
  std::vector<std::string> reasons(pictures.size());
  std::atomic<std::size_t> done = 0;
  std::mutex speaking;
  capture::parallel_for(std::size_t{0}, pictures.size(), [&](std::size_t i) {
    calibrate::BoardDetection found =
        calibrate::detect_board(pictures[i].grey, board, {.time_limit = limit, .quick = true});
    reasons[i] = std::move(found.reason);
    if (found.view) {
      middles[i] = middle_of(board, *found.view);
      if (!middles[i]) reasons[i] = "its middle is hidden";
    }
    const std::lock_guard lock(speaking);
    console.progress(static_cast<double>(++done) / static_cast<double>(pictures.size()),
                     "looking for the board in " + camera);
  });
  BoardPlaces places{{}, pictures.size(), {}};
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    if (middles[i]) places.points.push_back({pictures[i].time_s, *middles[i]});
    if (!reasons[i].empty()) places.reason = reasons[i];
  }
  return places;
}

}  // namespace studio
