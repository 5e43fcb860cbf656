// Patches of the plate, followed.
#include "compositing/plate_watch.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <stdexcept>
#include <vector>

#include <Eigen/Dense>

#include "capture/median.h"

namespace compositing {
namespace {

constexpr int regions_across = 8, regions_down = 6;  // the best patch of each
constexpr int stride = 6;                            // of places that are tried, in cells
constexpr int cells_afar = 8;                        // along a coarse one, of those far away
constexpr int beside = 4;                            // cells: as far as patches surely find
constexpr float most_sigma = 0.1F;                   // of a patch that is worth following, in cells
constexpr float own_error = 0.004F;                  // of light: what is neither noise nor shift
constexpr int fewest = 4;                            // patches that must agree
constexpr float agreed = 0.5F;                       // cells: patches that agree with their middle
constexpr float most_of_seen = 0.6F;                 // share that must

}  // namespace

PlateWatch::PlateWatch(const CleanPlate& plate)
    : height_(plate.light.height),
      width_(plate.light.width),
      pixels_(std::max(
          2,
          static_cast<int>(std::lround(std::max(plate.light.width, plate.light.height) / 480.0)))),
      noise_gain_(plate.noise_gain),
      noise_floor_(plate.noise_floor) {
  if (plate.light.empty() || plate.light.channels != 3) {
    throw std::invalid_argument("the clean plate is empty");
  }
  Grid& fine = plate_[0];
  fine.rows = height_ / pixels_, fine.columns = width_ / pixels_;
  fine.cells.reserve(static_cast<std::size_t>(fine.rows) * static_cast<std::size_t>(fine.columns));
  const float share = 1 / static_cast<float>(pixels_ * pixels_);
  for (int row = 0; row < fine.rows; ++row) {
    for (int column = 0; column < fine.columns; ++column) {
      float sum = 0;
      for (int y = row * pixels_; y < (row + 1) * pixels_; ++y) {
        for (int x = column * pixels_; x < (column + 1) * pixels_; ++x) {
          for (int c = 0; c < 3; ++c) {
            const float light = plate.light.at(y, x, c);
            if (light > 0 && light < 1e9F) sum += light;
          }
        }
      }
      fine.cells.push_back(sum * share);
    }
  }
  Grid& coarse = plate_[1];
  coarse.rows = fine.rows / 2, coarse.columns = fine.columns / 2;
  for (int row = 0; row < coarse.rows; ++row) {
    for (int column = 0; column < coarse.columns; ++column) {
      const int r = 2 * row, c = 2 * column;
      coarse.cells.push_back(
          0.25F * (fine.at(r, c) + fine.at(r, c + 1) + fine.at(r + 1, c) + fine.at(r + 1, c + 1)));
    }
  }
  choose_patches();
  const int rows = fine.rows / cells_afar, columns = fine.columns / cells_afar;
  std::vector<float> light;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      float sum = 0;
      for (int y = 0; y < cells_afar; ++y) {
        for (int x = 0; x < cells_afar; ++x)
          sum += fine.at(row * cells_afar + y, column * cells_afar + x);
      }
      light.push_back(sum / (cells_afar * cells_afar));
    }
  }
  if (!light.empty()) afar_.emplace(rows, columns, light);
  seen_afar_.resize(light.size());
  middle_.reserve(patches_.size());
  rights_.reserve(patches_.size());
  downs_.reserve(patches_.size());
}

// Variance of a cell, of which two rows of pixels are looked at.
float PlateWatch::noise_of(float light) const {
  const auto pixels = static_cast<float>(2 * pixels_);
  return (noise_gain_ * light + 3 * noise_floor_) / pixels + own_error * own_error * light * light;
}

// In each region, the patch whose own shift is most certain, apart from its gain and offset.
void PlateWatch::choose_patches() {
  const Grid& grid = plate_[0];
  const int margin = static_cast<int>(farthest) + 2;
  const int last_row = grid.rows - side - margin, last_column = grid.columns - side - margin;
  for (int region = 0; region < regions_across * regions_down; ++region) {
    const int r0 = margin + (last_row - margin) * (region / regions_across) / regions_down;
    const int r1 = margin + (last_row - margin) * (region / regions_across + 1) / regions_down;
    const int c0 = margin + (last_column - margin) * (region % regions_across) / regions_across;
    const int c1 = margin + (last_column - margin) * (region % regions_across + 1) / regions_across;
    Patch best;
    best.sigma = std::numeric_limits<float>::infinity();
    for (int row = r0; row < r1; row += stride) {
      for (int column = c0; column < c1; column += stride) {
        Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
        double sum = 0, squares = 0;
        for (int y = row; y < row + side; ++y) {
          for (int x = column; x < column + side; ++x) {
            const double value = grid.at(y, x);
            const Eigen::Vector4d a(0.5 * (grid.at(y, x + 1) - grid.at(y, x - 1)),
                                    0.5 * (grid.at(y + 1, x) - grid.at(y - 1, x)), value, 1);
            normal += a * a.transpose();
            sum += value, squares += value * value;
          }
        }
        const double mean = sum / (side * side), variance = squares / (side * side) - mean * mean;
        if (!(variance > 1e-4 * mean * mean + 1e-10)) continue;
        normal += 1e-9 * normal.trace() * Eigen::Matrix4d::Identity();
        const Eigen::Matrix4d inverse = normal.inverse();
        const double worst = std::max(inverse(0, 0), inverse(1, 1));
        const auto sigma =
            static_cast<float>(std::sqrt(worst * noise_of(static_cast<float>(mean))));
        if (sigma < best.sigma)
          best = {row, column, sigma, static_cast<float>(std::sqrt(variance))};
      }
    }
    if (best.sigma <= most_sigma) patches_.push_back(best);
  }
}

template <class Rows>
void PlateWatch::sample(const Rows& frame, const Patch& patch) {
  auto& fine = seen_[0];
  fine.fill(0);
  const float share = 0.5F / static_cast<float>(pixels_);
  const int left = patch.column * pixels_, right = left + side * pixels_;
  for (int row = 0; row < side; ++row) {
    for (const int y : {(pixels_ - 1) / 2, pixels_ / 2}) {
      for (int x = left; x < right; x += key_lanes) {
        const int count = std::min(key_lanes, right - x);
        std::array<F8, 3> c;
        frame.load((patch.row + row) * pixels_ + y, x, count, c);
        const F8 light = c[0] + c[1] + c[2];
        for (int i = 0; i < count; ++i)
          fine[static_cast<std::size_t>(row * side + (x + i - left) / pixels_)] += light[i] * share;
      }
    }
  }
  constexpr int half = side / 2;
  for (int row = 0; row < half; ++row) {
    for (int column = 0; column < half; ++column) {
      const std::size_t from = static_cast<std::size_t>(2 * row * side + 2 * column);
      seen_[1][static_cast<std::size_t>(row * half + column)] =
          0.25F * (fine[from] + fine[from + 1] + fine[from + side] + fine[from + side + 1]);
    }
  }
}

// The plate, shifted, with gain and offset, against what is seen: one step of Gauss and Newton.
bool PlateWatch::step(
    const Patch& patch, int level, float& right, float& down, float* misfit) const {
  const Grid& grid = plate_[static_cast<std::size_t>(level)];
  const auto& seen = seen_[static_cast<std::size_t>(level)];
  const int scale = 1 << level, across = side / scale;
  // A patch may begin in the middle of a coarse cell.
  const auto begin = [scale](int fine) {
    return static_cast<float>(fine) / static_cast<float>(scale);
  };
  const float x0 = begin(patch.column) - right, y0 = begin(patch.row) - down;
  const int column = static_cast<int>(std::floor(x0)), row = static_cast<int>(std::floor(y0));
  const float u = x0 - static_cast<float>(column), v = y0 - static_cast<float>(row);
  if (column < 1 || row < 1 || column + across + 2 >= grid.columns || row + across + 2 >= grid.rows)
    return false;
  Eigen::Matrix4f normal = Eigen::Matrix4f::Zero();
  Eigen::Vector4f towards = Eigen::Vector4f::Zero();
  float squares = 0;
  const auto between = [&](int y, int x) {
    const float top = grid.at(y, x) + u * (grid.at(y, x + 1) - grid.at(y, x));
    const float low = grid.at(y + 1, x) + u * (grid.at(y + 1, x + 1) - grid.at(y + 1, x));
    return top + v * (low - top);
  };
  for (int y = 0; y < across; ++y) {
    for (int x = 0; x < across; ++x) {
      const int gy = row + y, gx = column + x;
      // A frame that moved to the right shows what the plate has further left.
      const Eigen::Vector4f a(-0.5F * (between(gy, gx + 1) - between(gy, gx - 1)),
                              -0.5F * (between(gy + 1, gx) - between(gy - 1, gx)), between(gy, gx),
                              1);
      const float value = seen[static_cast<std::size_t>(y * across + x)];
      normal += a * a.transpose();
      towards += value * a;
      squares += value * value;
    }
  }
  normal += 1e-7F * normal.trace() * Eigen::Matrix4f::Identity();
  const Eigen::LDLT<Eigen::Matrix4f> solver(normal);
  if (solver.info() != Eigen::Success) return false;
  const Eigen::Vector4f x = solver.solve(towards);
  // The gain stands before the shift: gain * (plate + shift * slope) + offset.
  const float gain = x[2];
  if (!(gain > 0.2F && gain < 5)) return false;
  right += x[0] / gain, down += x[1] / gain;
  const float limit = farthest / static_cast<float>(scale);
  if (!(std::abs(right) <= limit && std::abs(down) <= limit)) return false;
  if (misfit != nullptr) {
    const auto cells = static_cast<float>(across * across);
    *misfit = std::sqrt(std::max(0.0F, squares - towards.dot(x)) / cells) / gain;
  }
  return true;
}

PlateWatch::Found PlateWatch::find(const Patch& patch) const {
  Found found;
  for (int i = 0; i < 4; ++i) {
    if (!step(patch, 1, found.right, found.down, nullptr)) return {};
  }
  found.right *= 2, found.down *= 2;
  float misfit = 0;
  for (int i = 0; i < 4; ++i) {
    if (!step(patch, 0, found.right, found.down, &misfit)) return {};
  }
  // By noise, and a part of what there is to see: a plate is smoother than a frame.
  const float mean = plate_[0].at(patch.row + side / 2, patch.column + side / 2);
  found.fits = misfit <= 3 * std::sqrt(noise_of(mean)) + 0.25F * patch.contrast;
  return found;
}

// The shift of all patches that are in sight of the frame, if it is no farther from `about` than
// each is looked for.
template <class Rows>
PlateShift PlateWatch::follow(const Rows& frame, About about) {
  PlateShift shift;
  rights_.clear(), downs_.clear();
  for (const Patch& patch : patches_) {
    Patch there = patch;
    there.row += about.down, there.column += about.right;
    if (there.row < 0 || there.column < 0 || there.row + side > plate_[0].rows ||
        there.column + side > plate_[0].columns)
      continue;
    ++shift.patches;
    sample(frame, there);
    const Found found = find(patch);
    if (!found.fits) continue;
    rights_.push_back(found.right), downs_.push_back(found.down);
  }
  shift.seen = static_cast<int>(rights_.size());
  if (shift.seen < fewest || 3 * shift.seen < shift.patches) return shift;
  middle_.assign(rights_.begin(), rights_.end());
  const float right = capture::median_in_place(middle_);
  middle_.assign(downs_.begin(), downs_.end());
  const float down = capture::median_in_place(middle_);
  // Half of what is seen may move by itself; more of it agrees if the camera did.
  middle_.clear();
  for (std::size_t i = 0; i < rights_.size(); ++i) {
    const float off = std::max(std::abs(rights_[i] - right), std::abs(downs_[i] - down));
    if (off <= agreed) middle_.push_back(off);
  }
  shift.agree = static_cast<int>(middle_.size());
  shift.known = shift.agree >= fewest &&
                static_cast<float>(shift.agree) >= most_of_seen * static_cast<float>(shift.seen);
  const auto pixels = static_cast<float>(pixels_);
  shift.right_px = (static_cast<float>(about.right) + right) * pixels;
  shift.down_px = (static_cast<float>(about.down) + down) * pixels;
  const float spread = shift.agree == 0 ? agreed : 1.48F * capture::median_in_place(middle_);
  shift.sigma_px = (spread / std::sqrt(static_cast<float>(shift.seen)) + 0.01F) * pixels;
  return shift;
}

// About where the edges of the whole frame may lie, by four rows of each coarse cell: that shift
// which most patches agree on.
template <class Rows>
PlateShift PlateWatch::look_afar(const Rows& frame) {
  PlateShift best;
  if (!afar_) return best;
  const int across = cells_afar * pixels_;
  for (int row = 0; row < afar_->rows(); ++row) {
    for (int column = 0; column < afar_->columns(); ++column) {
      float sum = 0;
      for (int i = 0; i < 4; ++i) {
        const int y = row * across + (2 * i + 1) * across / 8;
        for (int x = 0; x < across; x += key_lanes) {
          std::array<F8, 3> c;
          const int count = std::min(key_lanes, across - x);
          frame.load(y, column * across + x, count, c);
          const F8 light = c[0] + c[1] + c[2];
          for (int k = 0; k < count; ++k) sum += light[k];
        }
      }
      seen_afar_[static_cast<std::size_t>(row * afar_->columns() + column)] =
          sum / static_cast<float>(4 * across);
    }
  }
  std::array<CoarseShift::Shift, 6> shifts;
  const std::size_t count = afar_->find(seen_afar_, shifts);
  const auto look_about = [&](About about) {
    const PlateShift shift = follow(frame, about);
    if (!shift.known || shift.agree <= best.agree) return;
    best = shift, about_ = about;
  };
  for (const CoarseShift::Shift& coarse : std::span(shifts).first(count)) {
    const auto cells = [](float at) { return static_cast<int>(std::lround(at * cells_afar)); };
    look_about({cells(coarse.right), cells(coarse.down)});
  }
  if (best.known) return best;
  // What is within one coarse cell shows as none, and may be too far from where it was. What is
  // nearer would have been found there.
  for (int down = -beside; down <= beside; down += beside) {
    for (int right = -beside; right <= beside; right += beside) look_about({right, down});
  }
  if (best.size_px() > farthest / 2 * static_cast<float>(pixels_)) return best;
  about_ = {};
  return {};
}

// Where it was seen last, where it was at first, and then anywhere.
template <class Rows>
PlateShift PlateWatch::look_at(const Rows& frame) {
  const PlateShift near = follow(frame, {});
  if (near.known || static_cast<int>(patches_.size()) < fewest) {
    about_ = {};
    return near;
  }
  if (about_ != About{}) {
    if (const PlateShift again = follow(frame, about_); again.known) return again;
  }
  const PlateShift afar = look_afar(frame);
  return afar.known ? afar : near;
}

template PlateShift PlateWatch::look_at(const LightRows& frame);
template PlateShift PlateWatch::look_at(const CodeRows& frame);

}  // namespace compositing
