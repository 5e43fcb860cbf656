// Clean plates, taken on air.
#include "studio/plate_taking.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "studio/clean_plates.h"

namespace studio {
namespace {

constexpr int cell_px = 16;
constexpr float unlike = 0.1F;       // of its light a square is another one's
constexpr float dark = 0.01F;        // less light tells nothing
constexpr float few_moved = 0.005F;  // of all squares: grain
// More of a plate that is no screen may be somebody.
constexpr double small_person = 0.03;

// Means of each colour over whole squares, row by row.
std::vector<float> cells_of(const capture::Image& picture) {
  const int side = std::min({cell_px, picture.width, picture.height});
  std::vector<float> cells;
  for (int top = 0; top + side <= picture.height; top += side) {
    for (int left = 0; left + side <= picture.width; left += side) {
      std::array<float, 3> sums{};
      for (int y = top; y < top + side; ++y) {
        const float* row = &picture.pixels[picture.index(y, left)];
        for (std::size_t i = 0; i < 3 * static_cast<std::size_t>(side); ++i) sums[i % 3] += row[i];
      }
      for (const float sum : sums) cells.push_back(sum / static_cast<float>(side * side));
    }
  }
  return cells;
}

}  // namespace

PlateTaking::PlateTaking(std::vector<std::uint8_t> garbage,
                         bool screen,
                         bool waits,
                         std::optional<compositing::ScreenColour> colour,
                         std::optional<calibrate::Lens> lens)
    : garbage_(std::move(garbage)),
      screen_(screen),
      waits_(waits),
      colour_(colour),
      lens_(std::move(lens)) {}

PlateTaking::~PlateTaking() {
  if (work_.valid()) work_.wait();
}

void PlateTaking::add(std::shared_ptr<const capture::Image> shot) {
  const std::lock_guard lock(mutex_);
  if (given_ == shots_of_plate) return;
  if (work_.valid()) {
    if (!waits_ && work_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
    work_.get();
  }
  const bool last = ++given_ == shots_of_plate;
  work_ = std::async(std::launch::async, [this, shot = std::move(shot), last] {
    count(*shot);
    if (last) finish();
  });
  if (waits_) work_.wait();
}

std::shared_ptr<const compositing::CleanPlate> PlateTaking::plate() {
  const std::lock_guard lock(mutex_);
  if (given_ < shots_of_plate) return nullptr;
  if (work_.valid()) {
    if (work_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return nullptr;
    work_.get();
  }
  return plate_;
}

std::size_t PlateTaking::given() {
  const std::lock_guard lock(mutex_);
  return given_;
}

std::optional<std::string> PlateTaking::take_doubts() {
  if (!plate()) return std::nullopt;
  const std::lock_guard lock(mutex_);
  if (std::exchange(told_, true)) return std::nullopt;
  return doubts_;
}

void PlateTaking::count(const capture::Image& shot) {
  shots_->add(shot);
  watch(shot);
}

// Whether anything is elsewhere than it was, whatever the light does as a whole.
void PlateTaking::watch(const capture::Image& shot) {
  const std::vector<float> cells = cells_of(shot);
  if (first_cells_.empty()) {
    first_cells_ = cells;
    return;
  }
  std::vector<float> ratios;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (first_cells_[i] > dark) ratios.push_back(cells[i] / first_cells_[i]);
  }
  if (ratios.empty()) return;
  const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
  std::ranges::nth_element(ratios, middle);
  const float light = *middle;
  const auto moved = std::ranges::count_if(
      ratios, [&](float ratio) { return std::abs(ratio - light) > unlike * light; });
  most_moved_ = std::max(most_moved_, static_cast<float>(moved) / static_cast<float>(cells.size()));
}

void PlateTaking::finish() {
  auto plate = std::make_shared<const compositing::CleanPlate>(shots_->average(colour_));
  shots_.reset();
  if (most_moved_ > few_moved) {
    doubts_ = fmt::format("something moved in {:.0f} % of the picture meanwhile: take it anew",
                          std::max(100 * most_moved_, 1.0F));
  } else if (screen_) {
    doubts_ = doubts_of_plate(*plate, garbage_, small_person).value_or("");
  }
  plate_ = std::move(plate);
}

}  // namespace studio
