// Patches of the plate, followed.
#include "compositing/plate_watch.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <stdexcept>
#include <utility>
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
constexpr int fewest_turned = 6;                     // and on more than a shift
constexpr float agreed = 0.5F;                       // cells: patches that agree
constexpr float most_of_seen = 0.6F;                 // share that must
constexpr float most_if_turned = 0.7F;               // and on more than a shift, which fits more
constexpr float most_turn = 0.26F, most_growth = 0.4F;
constexpr float told_px = 1;  // at the corners of the picture: what is less is no turn, or no push
// Patches that tell that they agree on nothing, and how far they are off: such that show more than
// fits by chance, for where a plate was put together of frames there are faint steps.
constexpr int many = 8;
constexpr float elsewhere_px = 1.5F;
constexpr float clear_contrast = 12;  // over the noise
// Pictures of another lens, and of a camera that has tilted, in which patches are looked for where
// nothing else is found: all of them in the first looks, then some of them in each.
constexpr int first_looks = 3, some = 2;
constexpr std::array<std::array<float, 2>, 14> turns{{{1, -0.05F},
                                                      {1, 0.05F},
                                                      {1, -0.1F},
                                                      {1, 0.1F},
                                                      {1.06F, 0},
                                                      {1 / 1.06F, 0},
                                                      {1.12F, 0},
                                                      {1 / 1.12F, 0},
                                                      {1.18F, 0},
                                                      {1 / 1.18F, 0},
                                                      {1.25F, 0},
                                                      {1 / 1.25F, 0},
                                                      {1.32F, 0},
                                                      {1 / 1.32F, 0}}};  // scale, roll

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
  pairs_.reserve(patches_.size());
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

// The plate, moved, with gain and offset, against what is seen: one step of Gauss and Newton.
bool PlateWatch::step(
    const Motion& about, int level, float x, float y, Found& found, float* misfit) const {
  const Grid& grid = plate_[static_cast<std::size_t>(level)];
  const auto& seen = seen_[static_cast<std::size_t>(level)];
  const int across = side >> level;
  // The middle of a coarse cell is between two fine ones.
  const float shrink = 1 / static_cast<float>(1 << level), offset = 0.5F * (1 - shrink);
  const float x0 = x * shrink - offset - found.right, y0 = y * shrink - offset - found.down;
  // From the frame to the plate.
  const float square = (1 + about.a) * (1 + about.a) + about.b * about.b;
  const float along = (1 + about.a) / square, aside = about.b / square;
  const float half = 0.5F * static_cast<float>(across - 1);
  const float reach = half * (along + std::abs(aside)) + 2;
  if (!(x0 >= reach && y0 >= reach && x0 + reach < static_cast<float>(grid.columns - 1) &&
        y0 + reach < static_cast<float>(grid.rows - 1)))
    return false;
  Eigen::Matrix4f normal = Eigen::Matrix4f::Zero();
  Eigen::Vector4f towards = Eigen::Vector4f::Zero();
  float squares = 0;
  for (int row = 0; row < across; ++row) {
    for (int column = 0; column < across; ++column) {
      const float right = static_cast<float>(column) - half, down = static_cast<float>(row) - half;
      const float px = x0 + along * right + aside * down, py = y0 + along * down - aside * right;
      const int gx = static_cast<int>(px), gy = static_cast<int>(py);
      const float u = px - static_cast<float>(gx), v = py - static_cast<float>(gy);
      const auto between = [&](int r, int c) {
        const float top = grid.at(r, c) + u * (grid.at(r, c + 1) - grid.at(r, c));
        const float low = grid.at(r + 1, c) + u * (grid.at(r + 1, c + 1) - grid.at(r + 1, c));
        return top + v * (low - top);
      };
      // A frame that moved to the right shows what the plate has further left.
      const Eigen::Vector4f a(-0.5F * (between(gy, gx + 1) - between(gy, gx - 1)),
                              -0.5F * (between(gy + 1, gx) - between(gy - 1, gx)), between(gy, gx),
                              1);
      const float value = seen[static_cast<std::size_t>(row * across + column)];
      normal += a * a.transpose();
      towards += value * a;
      squares += value * value;
    }
  }
  normal += 1e-7F * normal.trace() * Eigen::Matrix4f::Identity();
  const Eigen::LDLT<Eigen::Matrix4f> solver(normal);
  if (solver.info() != Eigen::Success) return false;
  const Eigen::Vector4f fit = solver.solve(towards);
  // The gain stands before the shift: gain * (plate + shift * slope) + offset.
  const float gain = fit[2];
  if (!(gain > 0.2F && gain < 5)) return false;
  found.right += fit[0] / gain, found.down += fit[1] / gain;
  const float limit = farthest * shrink;
  if (!(std::abs(found.right) <= limit && std::abs(found.down) <= limit)) return false;
  if (misfit != nullptr) {
    const auto cells = static_cast<float>(across * across);
    *misfit = std::sqrt(std::max(0.0F, squares - towards.dot(fit)) / cells) / gain;
  }
  return true;
}

PlateWatch::Found PlateWatch::find(const Patch& patch,
                                   const Motion& about,
                                   float x,
                                   float y) const {
  Found found;
  for (int i = 0; i < 4; ++i) {
    if (!step(about, 1, x, y, found, nullptr)) return {};
  }
  found.right *= 2, found.down *= 2;
  float misfit = 0;
  for (int i = 0; i < 4; ++i) {
    if (!step(about, 0, x, y, found, &misfit)) return {};
  }
  // By noise, and a part of what there is to see: a plate is smoother than a frame.
  found.fits = misfit <= 3 * std::sqrt(noise_of(mean_of(patch))) + 0.25F * patch.contrast;
  return found;
}

PlateWatch::Consensus PlateWatch::agree_on_shift() {
  Consensus shift;
  const auto middle_of = [&](float Pair::*of) {
    middle_.clear();
    for (const Pair& pair : pairs_) middle_.push_back(pair.*of);
    return capture::median_in_place(middle_);
  };
  shift.motion.right = middle_of(&Pair::right);
  shift.motion.down = middle_of(&Pair::down);
  // Half of what is seen may move by itself; more of it agrees if the camera did.
  middle_.clear();
  for (const Pair& pair : pairs_) {
    const float off = std::max(std::abs(pair.right - shift.motion.right),
                               std::abs(pair.down - shift.motion.down));
    if (off <= agreed) middle_.push_back(off);
  }
  shift.agree = static_cast<int>(middle_.size());
  shift.cost = cost_of(shift.motion, std::numeric_limits<float>::infinity());
  const float off = shift.agree == 0 ? agreed : 1.48F * capture::median_in_place(middle_);
  shift.sigma = off / std::sqrt(static_cast<float>(pairs_.size())) + 0.01F;
  return shift;
}

// No more than a little above `enough`, if it is above it.
float PlateWatch::cost_of(const Motion& motion, float enough) const {
  float cost = 0;
  for (const Pair& pair : pairs_) {
    const float right = motion.a * pair.x - motion.b * pair.y + motion.right - pair.right;
    const float down = motion.b * pair.x + motion.a * pair.y + motion.down - pair.down;
    cost += std::min(right * right + down * down, agreed * agreed);
    if (cost > enough) break;
  }
  return cost;
}

// The similarity by two patches that most agree on.
PlateWatch::Consensus PlateWatch::agree_on_similarity() const {
  Motion best;
  float least = std::numeric_limits<float>::infinity();
  const float span = static_cast<float>(plate_[0].columns) / 6;
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const Pair &p = pairs_[i], &q = pairs_[j];
      const float x = p.x - q.x, y = p.y - q.y, square = x * x + y * y;
      if (square < span * span) continue;
      const float right = p.right - q.right, down = p.down - q.down;
      Motion motion{(right * x + down * y) / square, (down * x - right * y) / square, 0, 0};
      if (std::abs(motion.a) > most_growth || std::abs(motion.b) > most_turn) continue;
      motion.right = p.right - motion.a * p.x + motion.b * p.y;
      motion.down = p.down - motion.b * p.x - motion.a * p.y;
      const float cost = cost_of(motion, least);
      if (cost < least) least = cost, best = motion;
    }
  }
  return refined(best);
}

// By least squares of those that agree.
PlateWatch::Consensus PlateWatch::refined(Motion motion) const {
  Consensus fit;
  for (int i = 0; i < 4; ++i) {
    float count = 0, x = 0, y = 0, right = 0, down = 0;
    const auto each = [&](auto&& visit) {
      for (const Pair& pair : pairs_) {
        const float u = motion.a * pair.x - motion.b * pair.y + motion.right - pair.right;
        const float v = motion.b * pair.x + motion.a * pair.y + motion.down - pair.down;
        if (u * u + v * v <= agreed * agreed) visit(pair, u * u + v * v);
      }
    };
    float left = 0;
    each([&](const Pair& pair, float off) {
      count += 1, x += pair.x, y += pair.y, right += pair.right, down += pair.down, left += off;
    });
    if (count < 3) return {};
    x /= count, y /= count, right /= count, down /= count;
    float square = 0, a = 0, b = 0;
    each([&](const Pair& pair, float) {
      const float px = pair.x - x, py = pair.y - y, u = pair.right - right, v = pair.down - down;
      square += px * px + py * py, a += px * u + py * v, b += px * v - py * u;
    });
    if (!(square > 0)) return {};
    fit.agree = static_cast<int>(count);
    fit.sigma = std::sqrt(left / (2 * count - 4 + 1e-3F)) / std::sqrt(count) + 0.01F;
    fit.spread = std::sqrt(square);
    motion.a = a / square, motion.b = b / square;
    motion.right = right - motion.a * x + motion.b * y;
    motion.down = down - motion.b * x - motion.a * y;
  }
  fit.motion = motion;
  fit.cost = cost_of(motion, std::numeric_limits<float>::infinity());
  return fit;
}

float PlateWatch::farthest_of(const Motion& motion) const {
  float most = 0;
  for (const float side_x : {-0.5F, 0.5F}) {
    for (const float side_y : {-0.5F, 0.5F}) {
      const float x = side_x * static_cast<float>(plate_[0].columns);
      const float y = side_y * static_cast<float>(plate_[0].rows);
      most = std::max(most, std::hypot(motion.a * x - motion.b * y + motion.right,
                                       motion.b * x + motion.a * y + motion.down));
    }
  }
  return most;
}

// A curtain that waves at one side does not turn the picture: the rest of it stays.
bool PlateWatch::is_clearly_better(const Consensus& similarity, const Consensus& shift) const {
  constexpr float as_good = 0.05F;  // cells
  if (similarity.agree < std::max(fewest_turned, shift.agree)) return false;
  const auto seen = static_cast<float>(pairs_.size());
  if (2 * similarity.cost + as_good * as_good * seen > shift.cost) return false;
  const float corner = farthest_of({similarity.motion.a, similarity.motion.b, 0, 0});
  const float radius = std::hypot(0.5F * static_cast<float>(plate_[0].columns),
                                  0.5F * static_cast<float>(plate_[0].rows));
  const float sigma = similarity.sigma * std::sqrt(static_cast<float>(similarity.agree)) * radius /
                      similarity.spread;
  return corner > told_px / static_cast<float>(pixels_) + 4 * sigma;
}

PlateWatch::Motion PlateWatch::motion_of(const PlateShift& shift) const {
  const auto pixels = static_cast<float>(pixels_);
  return {shift.scale * std::cos(shift.roll_rad) - 1, shift.scale * std::sin(shift.roll_rad),
          shift.right_px / pixels, shift.down_px / pixels};
}

// What all patches that are in sight of the frame say, each looked for no farther from `about` than
// it is found. One that turns may be told but not known: where it was looked for elsewhere.
template <class Rows>
PlateShift PlateWatch::follow(const Rows& frame, const Motion& about) {
  PlateShift shift;
  pairs_.clear();
  const Grid& grid = plate_[0];
  const float middle_x = 0.5F * static_cast<float>(grid.columns - 1);
  const float middle_y = 0.5F * static_cast<float>(grid.rows - 1);
  const float square = (1 + about.a) * (1 + about.a) + about.b * about.b;
  const auto pixels = static_cast<float>(pixels_);
  int clear = 0, elsewhere = 0;
  for (const Patch& patch : patches_) {
    const auto centre = [](int first) { return static_cast<float>(first) + 0.5F * (side - 1); };
    const float px = centre(patch.column) - middle_x, py = centre(patch.row) - middle_y;
    const auto whole = [](float cells) { return static_cast<int>(std::lround(cells)); };
    Patch there = patch;
    there.column += whole(about.a * px - about.b * py + about.right);
    there.row += whole(about.b * px + about.a * py + about.down);
    if (there.row < 0 || there.column < 0 || there.row + side > grid.rows ||
        there.column + side > grid.columns)
      continue;
    ++shift.patches;
    sample(frame, there);
    const float x = centre(there.column) - middle_x, y = centre(there.row) - middle_y;
    const float u = x - about.right, v = y - about.down;
    const float from_x = ((1 + about.a) * u + about.b * v) / square;
    const float from_y = ((1 + about.a) * v - about.b * u) / square;
    const Found found = find(patch, about, from_x + middle_x, from_y + middle_y);
    if (!found.fits) continue;
    const Pair pair{from_x - found.right, from_y - found.down, x - from_x + found.right,
                    y - from_y + found.down};
    pairs_.push_back(pair);
    if (!(patch.contrast > clear_contrast * std::sqrt(noise_of(mean_of(patch))))) continue;
    ++clear;
    elsewhere += std::hypot(pair.right, pair.down) * pixels > elsewhere_px;
  }
  shift.seen = static_cast<int>(pairs_.size());
  if (shift.seen < fewest) return shift;
  Consensus consensus = agree_on_shift();
  if (shift.seen >= fewest_turned) {
    const Consensus similarity = agree_on_similarity();
    if (is_clearly_better(similarity, consensus)) consensus = similarity;
  }
  shift.agree = consensus.agree;
  const bool enough = 3 * shift.seen >= shift.patches;
  const bool turned = consensus.motion.a != 0 || consensus.motion.b != 0;
  shift.known = enough && shift.agree >= fewest &&
                static_cast<float>(shift.agree) >=
                    (turned ? most_if_turned : most_of_seen) * static_cast<float>(shift.seen);
  shift.scattered = enough && !shift.known && clear >= many &&
                    static_cast<float>(elsewhere) >= most_of_seen * static_cast<float>(clear);
  const Motion& m = consensus.motion;
  shift.right_px = m.right * pixels;
  shift.down_px = m.down * pixels;
  shift.sigma_px = shift.farthest_sigma_px = consensus.sigma * pixels;
  shift.farthest_px = farthest_of(m) * pixels;
  if (!turned) return shift;
  shift.roll_rad = std::atan2(m.b, 1 + m.a);
  shift.scale = std::hypot(1 + m.a, m.b);
  const float radius = std::hypot(middle_x, middle_y);
  shift.farthest_sigma_px *=
      1 + radius * std::sqrt(static_cast<float>(consensus.agree)) / consensus.spread;
  return shift;
}

// Of a picture that is turned, those in its middle tell where to look for the others.
template <class Rows>
PlateShift PlateWatch::follow_closely(const Rows& frame, const Motion& about) {
  PlateShift shift = follow(frame, about);
  for (int i = 0; i < 2 && shift.is_turned(); ++i) {
    const PlateShift again = follow(frame, motion_of(shift));
    if (!again.known || (shift.known && again.agree < shift.agree)) break;
    const bool more = again.agree > shift.agree;
    shift = again;
    if (!more) break;
  }
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
  const auto look_about = [&](float right, float down) {
    const Motion about{0, 0, std::round(right), std::round(down)};
    const PlateShift shift = follow_closely(frame, about);
    if (shift.known && shift.agree > best.agree) best = shift, found_about_ = about;
  };
  for (const CoarseShift::Shift& coarse : std::span(shifts).first(count))
    look_about(coarse.right * cells_afar, coarse.down * cells_afar);
  if (best.known) return best;
  // What is within one coarse cell shows as none, and may be too far from where it was. What is
  // nearer would have been found there.
  for (int down = -beside; down <= beside; down += beside) {
    for (int right = -beside; right <= beside; right += beside)
      look_about(static_cast<float>(right), static_cast<float>(down));
  }
  if (best.farthest_px > farthest / 2 * static_cast<float>(pixels_)) return best;
  return {};
}

template <class Rows>
PlateShift PlateWatch::look_turned(const Rows& frame) {
  PlateShift best;
  const std::size_t count = looks_ <= first_looks ? turns.size() : some;
  for (std::size_t i = 0; i < count; ++i) {
    const auto& [scale, roll] = turns[next_turn_];
    next_turn_ = (next_turn_ + 1) % turns.size();
    const Motion about{scale * std::cos(roll) - 1, scale * std::sin(roll), 0, 0};
    const PlateShift shift = follow_closely(frame, about);
    if (shift.known && shift.is_turned() && shift.agree > best.agree)
      best = shift, found_about_ = about;
  }
  return best;
}

// Where it was at first, where it was seen last, and then anywhere. Folds and panels that repeat
// themselves fit also where they are not, and so may a few patches of what moves by itself: more
// fit where the picture is.
template <class Rows>
PlateShift PlateWatch::look_at(const Rows& frame) {
  looks_ = std::min(looks_ + 1, first_looks + 1);
  const PlateShift near = follow_closely(frame, {});
  if (static_cast<int>(patches_.size()) < fewest) return near;
  const bool was_near = std::exchange(is_near_, false);
  if (near.known && near.farthest_px <= told_px) {
    about_ = {};
    return near;
  }
  PlateShift best = near;
  const auto take = [&](const PlateShift& shift) {
    const bool is_better = shift.known && shift.agree > best.agree;
    if (is_better) best = shift, about_ = found_about_;
    return is_better;
  };
  if (about_ != Motion{}) {
    const PlateShift there = follow_closely(frame, about_);
    if (there.known && there.agree >= near.agree) {
      if (there.is_turned()) about_ = motion_of(there);
      return there;
    }
  }
  is_near_ = near.known;
  if (is_near_ && was_near) return near;
  if (take(look_afar(frame)) || (!near.known && take(look_turned(frame)))) is_near_ = false;
  if (best.known && best.is_turned()) {
    about_ = motion_of(best);
  } else if (is_near_) {
    about_ = {};
  }
  return best;
}

template PlateShift PlateWatch::look_at(const LightRows& frame);
template PlateShift PlateWatch::look_at(const CodeRows& frame);

}  // namespace compositing
