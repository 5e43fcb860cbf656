// A clean plate that a show takes of a person's camera while it runs.
#pragma once

#include <cstddef>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "calibrate/lens.h"
#include "capture/image.h"
#include "compositing/clean_plate.h"
#include "compositing/plate_footage.h"

namespace studio {

// So many of a camera's pictures make a plate.
inline constexpr std::size_t shots_of_plate = 50;

// Added up on a thread of its own. Feeds that an edit puts in each other's place go on with one:
// any thread may call.
class PlateTaking {
 public:
  // `garbage`: (height, width), 255 = not looked at when the plate is doubted, or empty.
  // `screen`: it is to be a screen, of that colour if one is given. `waits`: each picture counts;
  // else those that come while one is being added are left out. `lens`: that it is taken through,
  // where that is known.
  PlateTaking(std::vector<std::uint8_t> garbage,
              bool screen,
              bool waits,
              std::optional<compositing::ScreenColour> colour = {},
              std::optional<calibrate::Lens> lens = {});
  ~PlateTaking();
  PlateTaking(const PlateTaking&) = delete;
  PlateTaking& operator=(const PlateTaking&) = delete;

  // One more picture, (height, width, 3), of the size of those before, if the plate is not there.
  void add(std::shared_ptr<const capture::Image> shot);
  const std::optional<calibrate::Lens>& lens() const { return lens_; }
  // Pictures that it has.
  std::size_t given();
  // Null until it is there. Throws what went wrong while it was made.
  std::shared_ptr<const compositing::CleanPlate> plate();
  // Once it is there: what speaks against it, in words, or "". Nothing from the second call on.
  std::optional<std::string> take_doubts();

 private:
  void count(const capture::Image& shot);
  void watch(const capture::Image& shot);
  void finish();

  const std::vector<std::uint8_t> garbage_;
  const bool screen_, waits_;
  const std::optional<compositing::ScreenColour> colour_;
  const std::optional<calibrate::Lens> lens_;
  std::mutex mutex_;
  std::future<void> work_;
  std::size_t given_ = 0;
  bool told_ = false;
  // The work's own while it runs.
  std::optional<compositing::PlateShots> shots_{std::in_place};
  std::vector<float> first_cells_;  // light of the first picture, by squares and colours
  float most_moved_ = 0;            // share of them that was ever unlike it
  std::shared_ptr<const compositing::CleanPlate> plate_;
  std::string doubts_;
};

}  // namespace studio
