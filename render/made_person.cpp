// The made person, painted part over part from signed distances.
#include "render/made_person.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <stdexcept>
#include <vector>

#include "capture/colour.h"
#include "capture/parallel_loop.h"
#include "render/made_noise.h"
#include "render/texture.h"

namespace render {
namespace {

struct Point {
  float x = 0, y = 0;
};

// Distance to a straight limb whose thickness runs from one radius to the other: below 0 inside.
float limb(Point p, Point a, Point b, float radius_a, float radius_b) {
  const float dx = b.x - a.x, dy = b.y - a.y;
  const float along = std::clamp(
      ((p.x - a.x) * dx + (p.y - a.y) * dy) / std::max(dx * dx + dy * dy, 1e-9F), 0.0F, 1.0F);
  return std::hypot(p.x - a.x - along * dx, p.y - a.y - along * dy) -
         (radius_a + (radius_b - radius_a) * along);
}

float ellipse(Point p, Point middle, float rx, float ry) {
  const float x = (p.x - middle.x) / rx, y = (p.y - middle.y) / ry;
  const float r = std::hypot(x, y);
  const float slope = std::hypot(x / rx, y / ry);
  return slope > 0 ? r * (r - 1) / slope : -std::min(rx, ry);
}

// Distance to a polygon whose corners are rounded by `radius`.
float rounded(Point p, std::span<const Point> corners, float radius) {
  float nearest = std::numeric_limits<float>::max();
  bool inside = false;
  for (std::size_t i = 0, j = corners.size() - 1; i < corners.size(); j = i++) {
    const Point a = corners[i], b = corners[j];
    nearest = std::min(nearest, limb(p, a, b, 0, 0));
    if ((a.y > p.y) != (b.y > p.y) && p.x < (b.x - a.x) * (p.y - a.y) / (b.y - a.y) + a.x)
      inside = !inside;
  }
  return (inside ? -nearest : nearest) - radius;
}

// A picture in the making at one point.
class Layers {
 public:
  explicit Layers(float soft_m) : soft_m_(soft_m) {}

  // `thickness` is how far from the edge a part is flat; darker towards the edge, as round things
  // are that are lit from the front.
  void add(float distance, Vec3f colour, float thickness) {
    const float round = smooth_step(-0.3F, 1, -distance / thickness);
    const Vec3f shaded = colour * (0.55F + 0.45F * round);
    const float covered = 1 - smooth_step(-soft_m_, soft_m_, distance);
    const float alpha = covered + alpha_ * (1 - covered);
    if (alpha > 0) {
      colour_ = colour_ + (shaded - colour_) * (covered / alpha);
    } else if (distance < nearest_) {
      // Outside of everything the nearest part's colour goes on: no fringe is filtered in.
      colour_ = shaded;
    }
    alpha_ = alpha;
    nearest_ = std::min(nearest_, distance);
  }
  void tint(float distance, Vec3f colour, float strength) {
    colour_ =
        colour_ + (colour - colour_) * (strength * (1 - smooth_step(-soft_m_, soft_m_, distance)));
  }
  Vec3f colour() const { return colour_; }
  float alpha() const { return alpha_; }

 private:
  float soft_m_;
  Vec3f colour_{};
  float alpha_ = 0;
  float nearest_ = std::numeric_limits<float>::max();
};

void paint_legs(Layers& layers, const MadePerson& person, Point p) {
  const Vec3f covered = person.skirt > 0 ? person.skin : person.legs;
  for (const float side : {-1.0F, 1.0F}) {
    const Point ankle{side * 0.105F, 0.085F}, knee{side * 0.1F, 0.49F};
    layers.add(limb(p, {side * 0.105F, 0.05F}, {side * 0.135F, 0.032F}, 0.045F, 0.034F),
               person.shoes, 0.04F);
    layers.add(limb(p, ankle, knee, person.skirt > 0 ? 0.038F : 0.052F, 0.062F), covered, 0.06F);
    layers.add(limb(p, knee, {side * 0.085F, 0.88F}, 0.063F, 0.088F), covered, 0.08F);
  }
  if (person.skirt > 0) {
    const std::vector<Point> corners{{-0.13F, 1.0F}, {-0.2F, 0.52F}, {0.2F, 0.52F}, {0.13F, 1.0F}};
    const float folds = 0.5F + 0.5F * std::sin(p.x * 70 / (1.6F - p.y));
    layers.add(rounded(p, corners, 0.012F), person.legs * (0.75F + 0.25F * folds), 0.12F);
  }
}

void paint_arm(Layers& layers, const MadePerson& person, Point p, float side) {
  const float raised = side > 0 ? person.raised_arm : 0;
  const auto mix = [raised](Point low, Point high) {
    return Point{low.x + (high.x - low.x) * raised, low.y + (high.y - low.y) * raised};
  };
  const Point shoulder{side * 0.185F, 1.385F};
  const Point elbow = mix({side * 0.245F, 1.12F}, {side * 0.31F, 1.17F});
  const Point wrist = mix({side * 0.235F, 0.89F}, {side * 0.405F, 1.4F});
  const Point hand = mix({side * 0.228F, 0.82F}, {side * 0.42F, 1.48F});
  layers.add(limb(p, wrist, hand, 0.03F, 0.036F), person.skin, 0.035F);
  layers.add(limb(p, elbow, wrist, 0.041F, 0.031F), person.sleeve > 0.6F ? person.top : person.skin,
             0.045F);
  const float to = std::max(person.sleeve * 2, 0.0F);
  const Point end{shoulder.x + (elbow.x - shoulder.x) * std::min(to, 1.0F),
                  shoulder.y + (elbow.y - shoulder.y) * std::min(to, 1.0F)};
  layers.add(limb(p, shoulder, elbow, 0.052F, 0.041F), person.skin, 0.05F);
  layers.add(limb(p, shoulder, end, 0.06F, 0.048F), person.top, 0.055F);
}

void paint_body(Layers& layers, const MadePerson& person, Point p) {
  const std::vector<Point> body{{-0.135F, 0.93F}, {0.135F, 0.93F}, {0.118F, 1.14F},
                                {0.175F, 1.39F},  {0.06F, 1.455F}, {-0.06F, 1.455F},
                                {-0.175F, 1.39F}, {-0.118F, 1.14F}};
  const float folds = fractal_noise(p.x * 9, p.y * 5, 3, 11);
  layers.add(rounded(p, body, 0.028F), person.top * (1 + 0.22F * folds), 0.11F);
  const std::vector<Point> neckline{{-0.05F, 1.5F}, {0.05F, 1.5F}, {0, 1.39F}};
  layers.tint(rounded(p, neckline, 0.004F), person.skin * 0.9F, 1);
  if (person.skirt == 0) {
    layers.tint(std::abs(p.y - 0.945F) - 0.016F + (std::abs(p.x) > 0.17F ? 1.0F : 0.0F),
                person.shoes, 0.9F);
  }
}

void paint_head(Layers& layers, const MadePerson& person, Point p) {
  const Point middle{0, 1.635F};
  layers.add(limb(p, {0, 1.44F}, {0, 1.55F}, 0.052F, 0.046F), person.skin * 0.85F, 0.06F);
  layers.add(ellipse(p, middle, 0.079F, 0.108F), person.skin, 0.07F);
  for (const float side : {-1.0F, 1.0F}) {
    layers.tint(ellipse(p, {side * 0.031F, 1.648F}, 0.013F, 0.0065F), {0.03F, 0.025F, 0.02F}, 0.9F);
    layers.tint(limb(p, {side * 0.018F, 1.671F}, {side * 0.047F, 1.672F}, 0.004F, 0.003F),
                person.hair, 0.8F);
  }
  layers.tint(limb(p, {0.008F, 1.65F}, {0.01F, 1.612F}, 0.004F, 0.009F), person.skin * 0.75F, 0.7F);
  layers.tint(limb(p, {-0.022F, 1.581F}, {0.022F, 1.581F}, 0.006F, 0.006F), {0.36F, 0.12F, 0.1F},
              0.8F);
  // Hair over the brow and down both sides.
  const float cap =
      std::max(ellipse(p, {0, 1.66F}, 0.092F, 0.11F), -ellipse(p, {0.012F, 1.61F}, 0.07F, 0.088F));
  const float strands = 1 + 0.35F * fractal_noise(p.x * 90, p.y * 9, 3, 5);
  layers.add(std::max(cap, 1.64F - p.y), person.hair * strands, 0.03F);
  for (const float side : {-1.0F, 1.0F}) {
    layers.add(limb(p, {side * 0.078F, 1.68F}, {side * 0.086F, 1.63F - person.hair_m}, 0.018F,
                    0.012F + 0.12F * person.hair_m),
               person.hair * strands, 0.03F);
  }
}

}  // namespace

Texture make_person_texture(const MadePerson& person, int height) {
  if (height < 2) throw std::invalid_argument("a person's picture is at least 2 texels high");
  const int width = height / 2;
  const float texel_m = made_person_height_m / static_cast<float>(height);
  const auto row = static_cast<std::size_t>(width) * 4;
  std::vector<std::uint8_t> texels(row * static_cast<std::size_t>(height));
  capture::parallel_for(0, height, [&](int y) {
    std::uint8_t* texel = &texels[row * static_cast<std::size_t>(y)];
    for (int x = 0; x < width; ++x) {
      const Point p{((static_cast<float>(x) + 0.5F) * texel_m - made_person_width_m / 2) /
                        person.height_share,
                    (static_cast<float>(height - y) - 0.5F) * texel_m / person.height_share};
      Layers layers(0.75F * texel_m);
      if (person.hair_m > 0.08F) {
        layers.add(limb(p, {0, 1.66F}, {0, 1.6F - person.hair_m}, 0.09F, 0.1F), person.hair * 0.6F,
                   0.05F);
      }
      paint_legs(layers, person, p);
      paint_arm(layers, person, p, -1);
      paint_arm(layers, person, p, 1);
      paint_body(layers, person, p);
      paint_head(layers, person, p);
      const Vec3f colour = layers.colour();
      for (const float channel : {colour.x, colour.y, colour.z}) {
        const double code = 255 * capture::encode(capture::Transfer::srgb, channel);
        *texel++ = static_cast<std::uint8_t>(std::clamp(code + 0.5, 0.0, 255.0));
      }
      *texel++ = static_cast<std::uint8_t>(std::clamp(255 * layers.alpha() + 0.5F, 0.0F, 255.0F));
    }
  });
  return make_texture(width, height, 4, true, texels);
}

}  // namespace render
