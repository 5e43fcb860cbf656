// Directions all over the regions that lights stand for.
#include "render/soft_lights.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace render {
namespace {

constexpr float golden_angle = 2.3999632F;
constexpr float widest_rad = 1;  // wider regions are no disc
// The parts are the middles of sixteen pieces of a disc: so much further out they spread as much as
// the disc itself does.
constexpr float further_out = 1.069F;

// A place in the square -1 to 1, on the unit disc; equal areas stay equal. Shirley and Chiu, "A Low
// Distortion Map between Disk and Square", JGT 1997.
std::array<float, 2> on_disc(float u, float v) {
  constexpr float eighth = std::numbers::pi_v<float> / 4;
  const bool steep = std::abs(v) > std::abs(u);
  const float radius = steep ? v : u;
  const float angle = steep ? 2 * eighth - eighth * (u / v) : eighth * (v / u);
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

// The parts of a region that is a disc, of the light of a number: turned from light to light, so
// that what their parts miss does not add up.
std::array<Vec3f, SoftLights::count> parts_of_disc(const DirectionalLight& light,
                                                   std::size_t number) {
  constexpr std::size_t side = SoftLights::side;
  const Vec3f d = light.direction;
  const Vec3f aside = std::abs(d.z) < 0.9F ? Vec3f{0, 0, 1} : Vec3f{1, 0, 0};
  const Vec3f a = normalize(cross(aside, d)), b = cross(d, a);
  const float turn = golden_angle * static_cast<float>(number);
  const Vec3f right = a * std::cos(turn) + b * std::sin(turn), up = cross(d, right);
  const float radius = further_out * std::tan(std::min(light.spread, widest_rad));
  const auto place = [](std::size_t k) {
    return (static_cast<float>(k) + 0.5F) * (2.0F / side) - 1;
  };
  std::array<Vec3f, SoftLights::count> parts;
  for (std::size_t part = 0; part < parts.size(); ++part) {
    const auto [u, v] = on_disc(place(part % side), place(part / side));
    parts[part] = normalize(d + (right * u + up * v) * radius);
  }
  return parts;
}

// Of a direction on a Z curve over the octahedron that the sphere unfolds to, its corners at the
// ground.
std::uint32_t place_on_curve(Vec3f d) {
  const float reach = std::abs(d.x) + std::abs(d.y) + std::abs(d.z);
  if (!(reach > 0)) return 0;
  float u = d.x / reach, v = d.y / reach;
  if (d.z < 0) {
    const float folded = std::copysign(1 - std::abs(v), u);
    v = std::copysign(1 - std::abs(u), v);
    u = folded;
  }
  const auto column = static_cast<std::uint32_t>((u + 1) * 32767);
  const auto row = static_cast<std::uint32_t>((v + 1) * 32767);
  std::uint32_t place = 0;
  for (std::uint32_t bit = 0; bit < 16; ++bit) {
    place |= (column >> bit & 1) << (2 * bit) | (row >> bit & 1) << (2 * bit + 1);
  }
  return place;
}

}  // namespace

SoftLights::SoftLights(const LightTable& table, bool in_parts) : regions_(table.lights.size()) {
  for (std::size_t i = 0; i < table.lights.size(); ++i) {
    const DirectionalLight& light = table.lights[i];
    Region& region = regions_[i];
    region.range = {light.direction, light.direction};
    if (!in_parts || !has_parts(light)) continue;
    region.has = true;
    region.directions =
        i < table.parts.size() ? table.parts[i].directions : parts_of_disc(light, i);
    DirectionRange& range = region.range;
    for (const Vec3f to : region.directions) {
      range.lower = {std::min(range.lower.x, to.x), std::min(range.lower.y, to.y),
                     std::min(range.lower.z, to.z)};
      range.upper = {std::max(range.upper.x, to.x), std::max(range.upper.y, to.y),
                     std::max(range.upper.z, to.z)};
    }
  }
}

std::vector<std::uint16_t> order_by_place(std::span<const DirectionalLight> lights) {
  std::vector<std::uint32_t> places;
  std::vector<std::uint16_t> order;
  for (std::size_t i = 0; i < lights.size(); ++i) {
    places.push_back(place_on_curve(lights[i].direction));
    if (lights[i].compact == 0) order.push_back(static_cast<std::uint16_t>(i));
  }
  std::ranges::stable_sort(order, {}, [&places](std::uint16_t i) { return places[i]; });
  return order;
}

std::uint8_t SoftLights::part_of_sample(std::uint32_t sample) {
  const std::uint32_t x = (sample & 1) * 2 + (sample >> 2 & 1);
  const std::uint32_t y = (sample >> 1 & 1) * 2 + (sample >> 3 & 1);
  return static_cast<std::uint8_t>(y * side + x);
}

}  // namespace render
