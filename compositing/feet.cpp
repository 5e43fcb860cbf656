// Feet in a matte: the lowest end of the person's body that stands under it.
#include "compositing/feet.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "capture/turn.h"
#include "compositing/matte_parts.h"

namespace compositing {

namespace {

constexpr float solid = 0.5F;           // alpha of what counts as the person
constexpr float faint = 0.1F;           // alpha of what the box holds
constexpr int margin = 8;               // pixels round the person
constexpr std::size_t least_area = 24;  // pixels; smaller things are specks
constexpr double second_person = 0.4;   // of the largest thing's area
// Shares of the silhouette's height H, and of the torso's half width R. Ankles are 0.04 H thick.
constexpr double thin_h = 0.012, thin_r = 0.22;  // half of what legs are thicker than
constexpr double end_h = 0.04;                   // a foot sticks out by more than that
constexpr double beside_h = 0.06;                // what hangs further from the axis is doubted
constexpr double far_h = 0.12;                   // further out legs do not hide each other
constexpr double nearer = 0.8;                   // than that, is another end that stands instead
constexpr double tapers = 1.15;    // a leg's lowest third is not wider than its highest by this
constexpr double leg_h = 0.25;     // legs are longer
constexpr double ankle_h = 0.06;   // above it a foot does not turn the leg aside
constexpr double straight = 0.14;  // how far a leg's middle leaves the line, as part of its length
constexpr double deep = 0.6;       // of the lowest end's depth under the torso: hands end higher

// Rows and columns from the first ones given to before the last ones.
Field cut(const Field& field, int from_y, int from_x, int to_y, int to_x) {
  Field part{to_y - from_y, to_x - from_x, {}};
  for (int y = from_y; y < to_y; ++y) {
    const auto row = field.of.begin() + static_cast<std::ptrdiff_t>(field.index(y, 0));
    part.of.insert(part.of.end(), row + from_x, row + to_x);
  }
  return part;
}

Part moved_by(Part part, int rows, int columns) {
  part.top += rows, part.bottom += rows, part.left += columns, part.right += columns;
  for (PixelRun& run : part.runs) {
    run.y += rows, run.left += columns, run.right += columns;
  }
  return part;
}

// One of the places where the body ends downwards.
struct End {
  int y = 0, left = 0, right = 0;  // its lowest run of pixels
  int length = 0;                  // rows from there up to where it joins a lower one
  int free = 0;                    // rows up to where it meets any other that is longer than least
  std::vector<double> middles = {}, widths = {};  // of its runs, going up
  double x() const { return 0.5 * (left + right); }
};

// The downward ends that are longer than `least` rows, lowest first: rows are joined from below;
// where two branches meet, the one that hangs less low ends. (The merge tree of the height:
// Edelsbrunner and Harer, "Computational Topology", AMS 2010, section VII.1.)
std::vector<End> ends_of(const Field& body, double least) {
  struct Run {
    int left, right;
    std::size_t end;
  };
  std::vector<End> ends;
  std::vector<std::size_t> joined;  // by which end each goes on
  const auto root = [&](std::size_t i) {
    while (joined[i] != i) i = joined[i];
    return i;
  };
  std::vector<Run> below, runs;
  for (int y = body.height - 1; y >= 0; --y) {
    runs.clear();
    for (int x = 0; x < body.width; ++x) {
      if (body.at(y, x) == 0) continue;
      const std::size_t none = ends.size();
      Run run{x, x, none};
      while (run.right + 1 < body.width && body.at(y, run.right + 1) != 0) ++run.right;
      x = run.right;
      for (const Run& under : below) {
        if (under.right < run.left - 1 || under.left > run.right + 1) continue;
        std::size_t high = root(under.end);
        std::size_t low = run.end == none ? high : root(run.end);
        if (ends[low].y < ends[high].y) std::swap(low, high);
        run.end = low;
        if (low == high) continue;
        ends[high].length = ends[high].y - y;
        joined[high] = low;
        if (ends[high].length < least) continue;
        for (const std::size_t i : {high, low})
          if (ends[i].free == 0) ends[i].free = ends[i].y - y;
      }
      if (run.end == none) {
        joined.push_back(none);
        ends.push_back({y, run.left, run.right});
      }
      runs.push_back(run);
    }
    for (const Run& run : runs) {
      End& end = ends[root(run.end)];
      const auto row = static_cast<std::size_t>(end.y - y);
      end.middles.resize(row + 1, 0.5 * (run.left + run.right));
      end.widths.resize(row + 1, run.right - run.left + 1);
    }
    below.swap(runs);
  }
  for (std::size_t i = 0; i < ends.size(); ++i)
    if (joined[i] == i) ends[i].length = body.height;  // the lowest of all
  std::erase_if(ends, [&](const End& end) { return end.length < least; });
  std::ranges::stable_sort(ends, std::greater<>(), &End::y);
  return ends;
}

// Whether it leads up as a leg does: straight, not thinner than below, and, if `whole`, far enough.
bool is_leg(const End& end, double tall, bool whole) {
  if (end.free == 0) return true;
  if (end.free < leg_h * tall) return !whole;
  const auto first = static_cast<std::size_t>(ankle_h * tall);
  const auto last = std::min(static_cast<std::size_t>(end.free), end.middles.size()) - 1;
  if (last <= first) return false;
  const auto rows = static_cast<double>(last - first);
  double most = 0;
  for (std::size_t i = first; i <= last; ++i) {
    const double s = static_cast<double>(i - first) / rows;
    const double line = (1 - s) * end.middles[first] + s * end.middles[last];
    most = std::max(most, std::abs(end.middles[i] - line));
  }
  const auto width = [&](std::size_t from, std::size_t to) {
    std::vector<double> widths(end.widths.begin() + static_cast<std::ptrdiff_t>(from),
                               end.widths.begin() + static_cast<std::ptrdiff_t>(to));
    std::ranges::nth_element(widths,
                             widths.begin() + static_cast<std::ptrdiff_t>(widths.size() / 2));
    return widths[widths.size() / 2];
  };
  const std::size_t third = (last - first) / 3;
  if (third < 1) return false;
  return most < straight * rows && width(first, first + third) < tapers * width(last - third, last);
}

// Where an end's outline is lowest, to parts of a pixel: alpha down each column is how far the
// foot reaches.
void refine(Feet& feet, const Field& alpha, const Field& body, const End& end, double tall) {
  constexpr int rows = 3;
  const int wide = std::max(1, static_cast<int>(std::lround(0.004 * tall)));
  const int first = std::max(0, end.left - 2 * wide),
            last = std::min(alpha.width - 1, end.right + 2 * wide);
  const int top = std::max(0, end.y - rows);
  std::vector<double> edges, soft;
  for (int x = first; x <= last; ++x) {
    double edge = top - 0.5, partly = 0;
    for (int y = top; y <= std::min(alpha.height - 1, end.y + rows); ++y) {
      const double a = alpha.at(y, x);
      edge += a;
      partly += 4 * a * (1 - a);
    }
    edges.push_back(body.at(top, x) != 0 ? edge : -1);
    soft.push_back(partly);
  }
  feet.q = {end.x(), end.y + 0.5};
  feet.sigma_px = 0.5;
  double lowest = -1;
  for (int x = first; x <= last; ++x) {
    double sum = 0, partly = 0;
    int n = 0;
    for (int u = std::max(first, x - wide); u <= std::min(last, x + wide); ++u) {
      const double edge = edges[static_cast<std::size_t>(u - first)];
      if (edge < 0) continue;
      sum += edge;
      partly += soft[static_cast<std::size_t>(u - first)];
      ++n;
    }
    if (n < 2 || !(sum / n > lowest)) continue;
    lowest = sum / n;
    feet.q = {static_cast<double>(x), lowest};
    feet.sigma_px = 0.2 + 0.2 * partly / n;
  }
}

// Takes an end's own rows off the body, up to where it meets another one.
void take_off(Field& body, const End& end) {
  const auto rows =
      std::min(static_cast<std::size_t>(end.free > 0 ? end.free : end.length), end.middles.size());
  for (std::size_t row = 0; row < rows; ++row) {
    const double half = 0.5 * (end.widths[row] - 1);
    const int y = end.y - static_cast<int>(row);
    const int left = static_cast<int>(end.middles[row] - half),
              right = static_cast<int>(end.middles[row] + half);
    for (int x = left; x <= right; ++x) body.at(y, x) = 0;
  }
}

// Corners of the body's lower convex hull, from left to right: Andrew, "Another Efficient Algorithm
// for Convex Hulls in Two Dimensions", Information Processing Letters 9, 1979. To parts of a pixel
// as refine() has it.
std::vector<calibrate::Vec2> lower_hull(const Field& alpha, const Field& body, double tall) {
  constexpr int rows = 3;
  const int wide = std::max(1, static_cast<int>(std::lround(0.004 * tall)));
  std::vector<double> edges;
  for (int x = 0; x < body.width; ++x) {
    int y = body.height - 1;
    while (y >= 0 && body.at(y, x) == 0) --y;
    double edge = y - 0.5;
    for (int v = y; y >= 0 && v <= std::min(body.height - 1, y + rows); ++v) edge += alpha.at(v, x);
    edges.push_back(edge);
  }
  std::vector<calibrate::Vec2> hull;
  for (int x = 0; x < body.width; ++x) {
    const double own = edges[static_cast<std::size_t>(x)];
    if (own < 0) continue;
    // The mean of what lies beside, not of another height.
    double sum = 0;
    int n = 0;
    for (int u = std::max(0, x - wide); u <= std::min(body.width - 1, x + wide); ++u) {
      const double edge = edges[static_cast<std::size_t>(u)];
      if (std::abs(edge - own) > rows) continue;
      sum += edge;
      ++n;
    }
    const calibrate::Vec2 q{static_cast<double>(x), sum / n};
    const auto is_above = [&] {
      const calibrate::Vec2 a = hull[hull.size() - 2], b = hull.back();
      return (b.x - a.x) * (q.y - a.y) >= (q.x - a.x) * (b.y - a.y);
    };
    while (hull.size() > 1 && is_above()) hull.pop_back();
    hull.push_back(q);
  }
  return hull;
}

// Whether a mask begins just below a run of pixels; an empty mask does not.
bool ends_at(const Field& mask, int y, int left, int right) {
  constexpr int rows = 3;
  for (int v = y; v <= std::min(mask.height - 1, y + rows); ++v)
    for (int x = std::max(0, left - 1); x <= std::min(mask.width - 1, right + 1); ++x)
      if (mask.at(v, x) >= faint) return true;
  return false;
}

std::array<float, 4> box_of(const Field& alpha, std::size_t person) {
  std::array<float, 4> box{1e9F, 1e9F, -1, -1};
  for (const Part& part : parts_of(alpha, faint)) {
    double full = 0;
    for (const auto& [y, left, right] : part.runs) {
      const float* const row = &alpha.of[alpha.index(y, 0)];
      full += static_cast<double>(
          std::count_if(row + left, row + right + 1, [](float a) { return a >= solid; }));
    }
    if (full < 3 || full < 0.005 * static_cast<double>(person)) continue;
    box[0] = std::min(box[0], static_cast<float>(part.left) - 1.5F);
    box[1] = std::min(box[1], static_cast<float>(part.top) - 1.5F);
    box[2] = std::max(box[2], static_cast<float>(part.right) + 1.5F);
    box[3] = std::max(box[3], static_cast<float>(part.bottom) + 1.5F);
  }
  return {std::max(box[0], -0.5F), std::max(box[1], -0.5F),
          std::min(box[2], static_cast<float>(alpha.width) - 0.5F),
          std::min(box[3], static_cast<float>(alpha.height) - 0.5F)};
}

// The thick part of the person, and the middle of its upper half.
struct Body {
  Field mask;
  double axis_x = 0, torso_y = 0;
};

Body body_of(const Part& person, int height, int width) {
  const double tall = person.bottom - person.top + 1;
  Body body{only(person, height, width)};
  const Grid<int> inside = thirds_to(body.mask, 0);
  const int thickest = *std::ranges::max_element(inside.of);
  const double thin = std::min(3 * thin_h * tall, thin_r * thickest);  // thirds, too
  Field core{height, width, {}};
  core.of.reserve(inside.of.size());
  for (const int thirds : inside.of) core.of.push_back(thirds > thin ? 1.0F : 0.0F);
  const auto cores = parts_of(core, solid);
  const Part& trunk = *largest(cores);
  const Grid<int> from_trunk = thirds_to(only(trunk, height, width), 1);
  for (std::size_t i = 0; i < body.mask.of.size(); ++i)
    if (from_trunk.of[i] > thin + 3) body.mask.of[i] = 0;
  double weight = 0;
  for (const auto& [y, left, right] : trunk.runs) {
    if (y > 0.5 * (trunk.top + trunk.bottom)) break;
    for (int x = left; x <= right; ++x) {
      const double d = inside.at(y, x), w = d * d;
      weight += w;
      body.axis_x += w * x;
      body.torso_y += w * y;
    }
  }
  body.axis_x /= weight;
  body.torso_y /= weight;
  return body;
}

}  // namespace

std::string_view name_of(FeetStatus status) {
  switch (status) {
    case FeetStatus::seen:
      return "seen";
    case FeetStatus::cut_off:
      return "cut off";
    case FeetStatus::uncertain:
      return "uncertain";
    case FeetStatus::absent:
      break;
  }
  return "absent";
}

namespace {

Feet find_upright(const Field& whole, const Field& mask) {
  const auto parts = parts_of(whole, solid);
  const Part* found = largest(parts);
  Feet feet;
  if (found == nullptr || found->area < least_area) return feet;
  feet.box = box_of(whole, found->area);
  const auto persons = std::ranges::count_if(parts, [&](const Part& part) {
    return static_cast<double>(part.area) >= second_person * static_cast<double>(found->area);
  });

  // What follows looks at no more than the person.
  const int from_x = std::max(0, found->left - margin), from_y = std::max(0, found->top - margin);
  const Field alpha = cut(whole, from_y, from_x, std::min(whole.height, found->bottom + 1 + margin),
                          std::min(whole.width, found->right + 1 + margin));
  const Part person = moved_by(*found, -from_y, -from_x);
  const double tall = person.bottom - person.top + 1;

  Body body = body_of(person, alpha.height, alpha.width);
  std::vector<End> ends = ends_of(body.mask, end_h * tall);
  feet.status = FeetStatus::uncertain;
  feet.q = {0.5 * (found->left + found->right), found->bottom + 0.5};
  feet.sigma_px = 0.1 * tall;
  if (ends.empty()) return feet;
  const double least_y = body.torso_y + deep * (ends.front().y - body.torso_y);
  std::erase_if(ends, [&](const End& end) { return end.y < least_y; });

  // The body's weight rests on its legs, at or between their feet: what ends far from its axis, and
  // does not lead up as legs do, gives way to a leg, or to what is nearer.
  const auto beside = [&](const End& end) { return std::abs(end.x() - body.axis_x); };
  const auto doubted = [&](const End& end) {
    return beside(end) > beside_h * tall && !is_leg(end, tall, beside(end) > far_h * tall);
  };
  std::size_t chosen = 0;
  if (doubted(ends[0])) {
    for (std::size_t i = 1; i < ends.size() && chosen == 0; ++i) {
      const bool near = beside(ends[i]) < nearer * beside(ends[0]);
      if (near ? !doubted(ends[i]) : is_leg(ends[i], tall, true)) chosen = i;
    }
  }
  const bool sure = !doubted(ends[chosen]);
  const End& end = ends[chosen];
  refine(feet, alpha, body.mask, end, tall);
  feet.q = {feet.q.x + from_x, feet.q.y + from_y};
  if (end.y + from_y >= whole.height - 1) {
    feet.status = FeetStatus::cut_off;
    feet.q.y = whole.height - 0.5;
  } else if (ends_at(mask, end.y + from_y, end.left + from_x, end.right + from_x)) {
    feet.status = FeetStatus::cut_off;
  } else if (sure && persons == 1) {
    feet.status = FeetStatus::seen;
  }
  if (!sure) return feet;
  for (std::size_t i = 0; i < ends.size(); ++i)
    if (i < chosen || doubted(ends[i])) take_off(body.mask, ends[i]);
  feet.lower = lower_hull(alpha, body.mask, tall);
  for (auto& q : feet.lower) q = {q.x + from_x, q.y + from_y - feet.sigma_px};
  return feet;
}

Field field_of(const capture::Image& image, const char* what) {
  if (image.channels != 1 || image.height < 0 || image.width < 0 ||
      image.pixels.size() !=
          static_cast<std::size_t>(image.height) * static_cast<std::size_t>(image.width)) {
    throw std::invalid_argument(std::string("find_feet: the ") + what +
                                " must be (height, width, 1)");
  }
  Field field{image.height, image.width, image.pixels};
  for (float& a : field.of) a = std::isfinite(a) ? std::clamp(a, 0.0F, 1.0F) : 0.0F;
  return field;
}

// What was found in a picture that was turned by a quarter to the right, from one of that height.
Feet turned_back(Feet feet, int height) {
  const auto back = [&](calibrate::Vec2& q) { q = {q.y, height - 1 - q.x}; };
  back(feet.q);
  std::ranges::for_each(feet.lower, back);
  const auto below = static_cast<float>(height - 1);
  const auto [left, top, right, bottom] = feet.box;
  feet.box = {top, below - right, bottom, below - left};
  return feet;
}

}  // namespace

Feet find_feet(const capture::Image& image, int turns, const capture::Image& mask) {
  if (image.empty()) return {};
  Field alpha = field_of(image, "matte"), masked;
  if (!mask.empty()) masked = field_of(mask, "mask");
  if (!mask.empty() && (mask.height != image.height || mask.width != image.width))
    throw std::invalid_argument("find_feet: the mask must be of the matte's size");
  const int quarters = (turns % 4 + 4) % 4;
  if (quarters == 0) return find_upright(alpha, masked);
  static constexpr std::array<capture::Turn, 4> to_the_right{
      {{},
       {.transposed = true, .mirrored = true},
       {.mirrored = true, .upended = true},
       {.transposed = true, .upended = true}}};
  const auto turned = [&](const Field& field) {
    capture::Image from = capture::make_image(field.height, field.width, 1), to;
    from.pixels = field.of;
    capture::turn_image(to_the_right[static_cast<std::size_t>(quarters)], from, to);
    return Field{to.height, to.width, std::move(to.pixels)};
  };
  Feet feet = find_upright(turned(alpha), mask.empty() ? masked : turned(masked));
  if (feet.status == FeetStatus::absent) return feet;
  // The last quarter first: what was before it is as high as the picture, or as wide.
  for (int i = quarters; i > 0; --i) {
    feet = turned_back(std::move(feet), i % 2 == 1 ? image.height : image.width);
  }
  return feet;
}

int turns_to_upright(const calibrate::Pose& cam_from_set) {
  const calibrate::Vec3 down = cam_from_set.R * calibrate::Vec3{0, 0, -1};
  const double quarters = std::atan2(down.x, down.y) / (std::numbers::pi / 2);
  return std::isfinite(quarters) ? (static_cast<int>(std::lround(quarters)) + 4) % 4 : 0;
}

}  // namespace compositing
