// Clean plates, read and made.
#include "studio/clean_plates.h"

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <vector>

namespace studio {
namespace {

// Of footage without a clean plate, so many frames tell the screen, spread over it.
constexpr int plate_frames = 48;

std::vector<capture::Image> spread_frames(capture::Camera& camera, int count) {
  const int step = std::max(1, count / plate_frames);
  std::vector<capture::Image> frames;
  for (int i = 0; i < count; ++i) {
    const auto frame = camera.next();
    if (!frame) break;
    if (i % step == 0 && frame->image) frames.push_back(*frame->image);
  }
  return frames;
}

}  // namespace

capture::Image read_picture(const std::string& path, capture::Transfer transfer) {
  const std::string ending = std::filesystem::path(path).extension().string();
  capture::CameraOptions options;
  options.colour.transfer =
      ending == ".exr" || ending == ".hdr" ? capture::Transfer::linear : transfer;
  const auto frame = capture::open_camera("file:" + path, options)->next();
  if (!frame || !frame->image) throw std::runtime_error(path + " holds no picture");
  return *frame->image;
}

compositing::CleanPlate read_clean_plate(const std::string& path,
                                         const VideoSource& source,
                                         std::array<int, 2> footage) {
  if (!path.empty()) {
    const capture::Image plate = read_picture(path, source.colour);
    return compositing::average_plate(std::span(&plate, 1));
  }
  VideoSource whole = source;
  whole.first = footage[0];
  const auto camera = open_video(whole);
  if (camera->info().live) {
    throw std::runtime_error(source.uri +
                             " is live and needs a clean plate: platelight key plate CAMERA -o "
                             "plate.exr");
  }
  return compositing::plate_from_footage(spread_frames(*camera, footage[1] - footage[0] + 1));
}

}  // namespace studio
