// The person, part by part, from the back hair to what is held in front.
#include "compositing/made_actor.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "capture/counter_random.h"
#include "render/made_noise.h"

namespace compositing {
namespace {

using capture::Image;
using render::fractal_noise;
using render::smooth_step;

ActorColour scaled(ActorColour c, float by) { return {c[0] * by, c[1] * by, c[2] * by}; }

// Random numbers in the order in which they are drawn.
class Draws {
 public:
  explicit Draws(std::uint64_t seed) : seed_(seed) {}
  float next() {
    return static_cast<float>(capture::uniform_high(capture::mixed_bits(seed_, ++drawn_)));
  }
  float signed_next() { return 2 * next() - 1; }

 private:
  std::uint64_t seed_;
  std::uint64_t drawn_ = 0;
};

// Where the person's parts are, in texels of the layer.
struct Build {
  float head_x, head_y, head_rx, head_ry, unit;  // unit: the layer's height
};

class Canvas {
 public:
  Canvas(int height, int width) : layer_(capture::make_image(height, width, actor_channels)) {}

  int height() const { return layer_.height; }
  int width() const { return layer_.width; }
  Image take() { return std::move(layer_); }

  void over(int x, int y, ActorColour colour, float alpha, float spill) {
    if (x < 0 || y < 0 || x >= layer_.width || y >= layer_.height || alpha <= 0) return;
    float* texel = &layer_.pixels[layer_.index(y, x)];
    const std::array<float, actor_channels> added{colour[0], colour[1], colour[2], 1, spill};
    for (std::size_t c = 0; c < actor_channels; ++c) {
      texel[c] = added[c] * alpha + texel[c] * (1 - alpha);
    }
  }

  // A disc, soft at its rim; thinner than a texel it is fainter.
  void dot(float x, float y, float radius, ActorColour colour, float alpha, float spill) {
    const int reach = static_cast<int>(std::ceil(radius + 0.5F));
    const int cx = static_cast<int>(x), cy = static_cast<int>(y);
    const float share = alpha * std::min(1.0F, 2 * radius);
    for (int j = cy - reach; j <= cy + reach; ++j) {
      for (int i = cx - reach; i <= cx + reach; ++i) {
        const float away =
            std::hypot(static_cast<float>(i) + 0.5F - x, static_cast<float>(j) + 0.5F - y);
        over(i, j, colour, share * std::clamp(radius + 0.5F - away, 0.0F, 1.0F), spill);
      }
    }
  }

 private:
  Image layer_;
};

// One hair from (x, y) on, bending and falling, now and then with a branch.
struct Hair {
  float x, y, angle, length, width;
};

void paint_hair(
    Canvas& canvas, Draws& draws, Hair hair, ActorColour colour, float spill, int branches) {
  const float step = std::max(0.6F, hair.width * 0.45F);
  const int steps = static_cast<int>(hair.length / step);
  float bend = 0.011F * draws.signed_next();
  for (int i = 0; i < steps; ++i) {
    const float along = static_cast<float>(i) / static_cast<float>(steps);
    bend += 0.0014F * step * draws.signed_next();
    hair.angle += bend * step;
    hair.angle += 0.004F * step * std::cos(hair.angle);  // falls: towards straight down
    hair.x += std::cos(hair.angle) * step;
    hair.y += std::sin(hair.angle) * step;
    const float shine = 0.85F + 0.35F * std::sin(0.09F * static_cast<float>(i) * step + hair.width);
    canvas.dot(hair.x, hair.y, 0.5F * hair.width * (1 - 0.8F * along), scaled(colour, shine), 0.7F,
               spill * (0.4F + 0.8F * along));
    if (branches > 0 && draws.next() < 0.004F * step) {
      const float turned = hair.angle + 0.7F * draws.signed_next();
      paint_hair(canvas, draws,
                 {hair.x, hair.y, turned, hair.length * (1 - along) * 0.8F, hair.width * 0.7F},
                 colour, spill, branches - 1);
    }
  }
}

// Any hue and light, with no more of green or blue than muted clothes have.
ActorColour any_colour(std::uint32_t seed) {
  Draws draws(seed);
  const float light = 0.02F * std::pow(40.0F, draws.next());
  const float grey = draws.next();
  ActorColour colour{};
  for (float& c : colour) c = light * (grey + (1 - grey) * 1.5F * draws.next());
  for (const std::size_t primary : {std::size_t{1}, std::size_t{2}}) {
    const float others = 0.5F * (colour[0] + colour[primary == 1 ? 2 : 1]);
    colour[primary] = std::min(colour[primary], 1.4F * others + 0.02F);
  }
  return colour;
}

// Of cloth with some green in it: yellow, lime and olive, pale and muted greens down to mint, teal.
// None is as green as a screen.
ActorColour greenish_colour(std::uint32_t seed) {
  Draws draws(seed);
  const float kind = draws.next(), green = 0.06F * std::pow(10.0F, draws.next());
  const float a = draws.next(), b = draws.next();
  if (kind < 0.4F) return {green * (0.75F + 0.5F * a), green, green * (0.08F + 0.62F * b)};
  if (kind < 0.8F) return {green * (0.55F + 0.35F * a), green, green * (0.15F + 0.7F * b)};
  return {green * (0.3F + 0.4F * a), green, green * (0.9F + 0.3F * b)};
}

ActorColour hair_colour(const MadeActor& actor, std::uint32_t seed) {
  if (actor.hair == MadeHair::white) {  // yellowish to bluish
    Draws draws(seed * 13 + 2);
    const float cold = draws.next(), light = 0.75F + 0.35F * draws.next();
    return scaled({0.66F - 0.12F * cold, 0.62F - 0.02F * cold, 0.52F + 0.16F * cold}, light);
  }
  if (actor.any_colours) return any_colour(seed * 11 + 2);
  switch (actor.hair) {
    case MadeHair::blond:
      return {0.46F, 0.32F, 0.14F};
    case MadeHair::black:
      return {0.012F, 0.010F, 0.009F};
    default:
      return {0.10F, 0.056F, 0.03F};
  }
}

// `around`: hair that frames the head; else hair on top of it.
void paint_hairs(Canvas& canvas,
                 Draws& draws,
                 const Build& at,
                 const MadeActor& actor,
                 std::uint32_t seed,
                 int count,
                 bool around) {
  const float pi = std::numbers::pi_v<float>;
  const ActorColour colour = hair_colour(actor, seed);
  for (int i = 0; i < count; ++i) {
    const bool wild = around && draws.next() < 0.25F;
    const float angle = pi * (wild ? 0.8F + 1.4F * draws.next() : 1.02F + 0.96F * draws.next());
    const float out = around ? 0.86F + 0.2F * draws.next() : 0.5F + 0.5F * draws.next();
    const float length =
        at.unit * (around ? 0.09F + 0.19F * draws.next() : 0.05F + 0.1F * draws.next());
    const float thin = draws.next();
    const Hair hair{at.head_x + std::cos(angle) * at.head_rx * out,
                    at.head_y + std::sin(angle) * at.head_ry * out - 0.06F * at.head_ry,
                    angle + (wild ? 0.9F : 0.5F) * draws.signed_next(), length,
                    0.6F + 3.0F * thin * thin};
    paint_hair(canvas, draws, hair, scaled(colour, 0.6F + 0.7F * draws.next()), 0.8F * actor.spill,
               around ? 2 : 0);
  }
}

// Half the width of the shoulders and what is below, where `down` is 0 .. 1 from neck to the edge.
float half_width(const Build& at, float down) {
  return at.unit * (0.3F * std::pow(std::min(3 * down, 1.0F), 0.55F) + 0.03F * down);
}

// Fur is light, in patches: what is dark shows hardly anything of its own colour before a screen.
// Of any tint, but hardly greener than grey.
ActorColour patch_of_fur(const Build& at, float x, float y, std::uint32_t seed) {
  const float patch = 0.06F * at.unit;
  Draws draws(capture::mixed_bits(capture::mixed_bits(seed, static_cast<std::uint64_t>(x / patch)),
                                  static_cast<std::uint64_t>(y / patch)));
  const float light = 0.8F * std::pow(0.25F, draws.next());
  ActorColour colour{};
  for (float& c : colour) c = light * (1 + 0.6F * draws.signed_next());
  colour[1] = std::min(colour[1], 0.6F * (colour[0] + colour[2]));
  return colour;
}

// Short hairs all over head and body, combed outwards.
void paint_fur(Canvas& canvas, Draws& draws, const Build& at, const MadeActor& actor) {
  const float pi = std::numbers::pi_v<float>;
  const auto seed = static_cast<std::uint32_t>(0xFFFF * draws.next());
  const float longest = at.unit * actor.fur * (0.4F + 0.6F * draws.next());
  for (int i = 0; i < 12000; ++i) {
    Hair hair{};
    if (draws.next() < 0.4F) {
      const float out = 1.02F * std::sqrt(draws.next());
      hair.angle = 2 * pi * draws.next();
      hair.x = at.head_x + std::cos(hair.angle) * at.head_rx * out;
      hair.y = at.head_y + std::sin(hair.angle) * at.head_ry * out;
    } else {
      const float down = draws.next(), side = draws.signed_next();
      hair.x = at.head_x + side * half_width(at, down);
      hair.y = at.head_y + 1.25F * at.head_ry + down * 0.5F * at.unit;
      hair.angle = 0.5F * pi - (0.5F * pi - 0.3F) * side;
      if (down < 0.1F) hair.angle = -hair.angle;  // on the shoulders it stands up
    }
    hair.angle += 0.5F * draws.signed_next();
    hair.length = longest * (0.3F + 0.7F * draws.next());
    const float thin = draws.next();
    hair.width = 0.6F + 3 * thin * thin;
    ActorColour colour =
        scaled(patch_of_fur(at, std::max(hair.x, 0.0F), std::max(hair.y, 0.0F), seed),
               0.6F + 0.8F * draws.next());
    for (float& c : colour) c *= 1 + 0.2F * draws.signed_next();
    paint_hair(canvas, draws, hair, colour, 0.8F * actor.spill, 0);
  }
}

// Spill is strongest at the rim, which faces the screen sideways.
float rim_spill(float spill, float inside, float unit) {
  return spill * (0.4F + 2 * std::exp(-inside / (0.035F * unit)));
}

struct Wardrobe {
  ActorColour jacket, shirt, scarf;
};

Wardrobe wardrobe_of(const MadeActor& actor, std::uint32_t seed) {
  if (actor.green_clothes) {
    return {greenish_colour(seed * 11 + 6), greenish_colour(seed * 11 + 7),
            greenish_colour(seed * 11 + 8)};
  }
  if (actor.any_colours) {
    return {any_colour(seed * 11 + 3), any_colour(seed * 11 + 4), any_colour(seed * 11 + 5)};
  }
  Draws draws(seed * 7 + 3);
  const bool red = draws.next() < 0.5F;
  return {red ? ActorColour{0.22F, 0.03F, 0.03F} : ActorColour{0.05F, 0.06F, 0.09F},
          {0.75F, 0.75F, 0.73F},
          {0.12F, 0.10F, 0.45F}};
}

void paint_body(Canvas& canvas, const Build& at, const MadeActor& actor, std::uint32_t seed) {
  const Wardrobe wears = wardrobe_of(actor, seed);
  const ActorColour skin = skin_of(actor, seed);
  for (int y = static_cast<int>(at.head_y); y < canvas.height(); ++y) {
    for (int x = 0; x < canvas.width(); ++x) {
      const float fx = static_cast<float>(x), fy = static_cast<float>(y);
      const float side = std::abs(fx - at.head_x), below = fy - at.head_y;
      const float cloth = 0.8F + 0.3F * fractal_noise(fx * 0.02F, fy * 0.02F, 3, seed + 1);
      const float weave = 1 + 0.15F * fractal_noise(fx * 0.2F, fy * 0.2F, 2, seed + 2);
      const float neck = 0.45F * at.head_rx - side;
      if (neck > 0 && below < 1.5F * at.head_ry) {
        const float shade = 0.55F + 0.4F * smooth_step(0, 0.5F * at.head_rx, neck);
        canvas.over(x, y, scaled(skin, shade * cloth), 1, rim_spill(actor.spill, neck, at.unit));
      }
      const float down = (below - 1.25F * at.head_ry) / (0.5F * at.unit);
      if (down <= 0) continue;
      const float inside = half_width(at, down) - side;
      if (inside <= -1) continue;
      ActorColour colour = wears.jacket;
      if (side < at.unit * (0.16F - 0.16F * down)) colour = wears.shirt;
      if (side < at.unit * (0.018F + 0.02F * down)) colour = wears.scarf;
      const float shade = (0.45F + 0.6F * smooth_step(0, 0.12F * at.unit, inside)) * cloth * weave;
      canvas.over(x, y, scaled(colour, shade), std::clamp(inside + 0.5F, 0.0F, 1.0F),
                  rim_spill(actor.spill, std::max(inside, 0.0F), at.unit));
    }
  }
}

void paint_head(Canvas& canvas, const Build& at, const MadeActor& actor, std::uint32_t seed) {
  const ActorColour skin = skin_of(actor, seed);
  const int top = static_cast<int>(at.head_y - at.head_ry) - 1;
  const int bottom = static_cast<int>(at.head_y + at.head_ry) + 1;
  for (int y = std::max(0, top); y < std::min(bottom, canvas.height()); ++y) {
    for (int x = 0; x < canvas.width(); ++x) {
      const float fx = static_cast<float>(x), fy = static_cast<float>(y);
      const float nx = (fx - at.head_x) / at.head_rx, ny = (fy - at.head_y) / at.head_ry;
      const float r = std::hypot(nx, ny);
      const float inside = (1 - r) * at.head_rx;
      if (inside <= -1) continue;
      const float nz = std::sqrt(std::max(0.0F, 1 - r * r));
      float shade = std::clamp(0.35F + 0.5F * nz - 0.25F * nx - 0.15F * ny, 0.15F, 1.1F);
      shade *= 0.95F + 0.2F * fractal_noise(fx * 0.03F, fy * 0.03F, 3, seed + 4);
      const bool eye = std::abs(std::abs(nx) - 0.4F) < 0.14F && std::abs(ny + 0.05F) < 0.05F;
      ActorColour colour = scaled(skin, eye ? 0.25F * shade : shade);
      const float shine = 0.08F * std::pow(std::max(0.0F, nz - 0.1F * nx), 20.0F);
      for (float& c : colour) c += shine;
      canvas.over(x, y, colour, std::clamp(inside + 0.5F, 0.0F, 1.0F),
                  rim_spill(actor.spill, std::max(inside, 0.0F), at.unit));
    }
  }
}

void paint_veil(Canvas& canvas, const Build& at, const MadeActor& actor, std::uint32_t seed) {
  for (int y = 0; y < canvas.height(); ++y) {
    for (int x = 0; x < canvas.width(); ++x) {
      const float dx = static_cast<float>(x) - at.head_x, dy = static_cast<float>(y) - at.head_y;
      const float half = 1.6F * at.head_rx + 0.32F * std::max(0.0F, dy + at.head_ry) +
                         0.02F * at.unit * std::sin(0.02F * dy);
      const float inside = half - std::abs(dx);
      if (dy < -1.2F * at.head_ry || dy > 0.42F * at.unit || inside <= 0) continue;
      const float wave = 0.03F * dx + 4 * fractal_noise(dx * 0.004F, dy * 0.004F, 2, seed + 6);
      const float fold = 0.55F + 0.45F * std::sin(wave);
      const float alpha = actor.veil * (0.35F + 0.65F * fold) * std::min(inside / 6, 1.0F);
      canvas.over(x, y, scaled({0.62F, 0.62F, 0.64F}, 0.7F + 0.3F * fold), alpha, actor.spill);
    }
  }
}

// Thin at the middle, dense at the rim, with two bright lines: a bottle, and a pane beside it.
void paint_glass(Canvas& canvas, const Build& at) {
  const float bottle_x = at.head_x - 0.42F * at.unit, pane_x = at.head_x + 0.36F * at.unit;
  for (int y = static_cast<int>(0.3F * at.unit); y < canvas.height(); ++y) {
    for (int x = 0; x < canvas.width(); ++x) {
      const float fx = static_cast<float>(x), fy = static_cast<float>(y) / at.unit;
      const float radius =
          at.unit * (fy < 0.5F ? 0.03F : 0.03F + 0.045F * smooth_step(0.5F, 0.6F, fy));
      const float across = (fx - bottle_x) / radius;
      if (std::abs(across) < 1) {
        const float rim = std::pow(std::abs(across), 6.0F);
        canvas.over(x, y, {0.10F, 0.11F, 0.12F}, 0.12F + 0.5F * rim, 0.02F);
        const float line = std::exp(-200 * (across + 0.55F) * (across + 0.55F));
        canvas.over(x, y, {0.95F, 0.95F, 0.95F}, 0.85F * line, 0);
      }
      const float side = (fx - pane_x) / (0.09F * at.unit);
      if (std::abs(side) < 1 && fy > 0.42F) {
        const float sheen = smooth_step(-0.2F, 0.3F, std::sin(9 * fy + 2 * side));
        canvas.over(x, y, {0.7F, 0.72F, 0.75F}, 0.06F + 0.2F * sheen, 0);
      }
    }
  }
}

// Each texel the mean of actor_detail^2 around it.
void average_pixels(Image& layer) {
  static_assert(actor_detail == 3);
  const auto pass = [&](std::size_t count, std::size_t stride, std::size_t lines,
                        std::size_t line) {
    std::vector<float> row(count * actor_channels);
    for (std::size_t l = 0; l < lines; ++l) {
      float* base = &layer.pixels[l * line];
      for (std::size_t i = 0; i < count; ++i) {
        std::copy_n(base + i * stride, actor_channels, &row[i * actor_channels]);
      }
      for (std::size_t i = 0; i < count; ++i) {
        const std::size_t before = i == 0 ? 0 : i - 1, after = std::min(i + 1, count - 1);
        for (std::size_t c = 0; c < actor_channels; ++c) {
          base[i * stride + c] = (row[before * actor_channels + c] + row[i * actor_channels + c] +
                                  row[after * actor_channels + c]) /
                                 3;
        }
      }
    }
  };
  const auto width = static_cast<std::size_t>(layer.width);
  const auto height = static_cast<std::size_t>(layer.height);
  pass(width, actor_channels, height, width * actor_channels);
  pass(height, width * actor_channels, width, actor_channels);
}

}  // namespace

ActorColour skin_of(const MadeActor& actor, std::uint32_t seed) {
  if (actor.any_colours) return any_colour(seed * 11 + 1);
  Draws draws(seed * 5 + 1);
  return draws.next() < 0.4F ? ActorColour{0.20F, 0.105F, 0.065F}
                             : ActorColour{0.55F, 0.32F, 0.22F};
}

ActorColour sleeve_of(const MadeActor& actor, std::uint32_t seed) {
  return wardrobe_of(actor, seed).jacket;
}

Image paint_actor(const MadeActor& actor, std::uint32_t seed, int height, int width) {
  Canvas canvas(height * actor_detail, width * actor_detail);
  const float unit = static_cast<float>(canvas.height());
  Draws draws(seed);
  const Build at{static_cast<float>(canvas.width()) * (0.46F + 0.08F * draws.next()),
                 unit * (0.34F + 0.04F * draws.next()), 0.105F * unit, 0.145F * unit, unit};
  paint_hairs(canvas, draws, at, actor, seed, 800, true);
  paint_body(canvas, at, actor, seed);
  paint_head(canvas, at, actor, seed);
  paint_hairs(canvas, draws, at, actor, seed, 450, true);
  paint_hairs(canvas, draws, at, actor, seed, 600, false);
  if (actor.fur > 0) paint_fur(canvas, draws, at, actor);
  if (actor.veil > 0) paint_veil(canvas, at, actor, seed);
  if (actor.glass) paint_glass(canvas, at);
  Image layer = canvas.take();
  average_pixels(layer);
  return layer;
}

}  // namespace compositing
