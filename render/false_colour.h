// Pictures of what pixels took, in a few colours that tell the classes apart.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "render/ray_counts.h"

namespace render {

enum class RayView { depth, rays, shadow_rays, error };
inline constexpr std::size_t ray_views = 4;
// "depth", "rays", "shadow_rays", "error", in the order of the views.
const std::vector<std::string>& ray_view_names();
std::optional<RayView> ray_view_named(std::string_view name);

// Values above the class before, up to and with `most`.
struct ColourClass {
  std::uint8_t red, green, blue;
  float most;  // of the last class, infinity
};

// A view's six classes: black, blue, magenta, green, yellow, red.
//
// Those of depth (0, 5, 10, 15, 20) and of rays (below 1, 10, 20, 30, 40) are of Benthin, Wald,
// Dahmen and Slusallek, "Interactive Headlight Simulation: A Case Study of Interactive Distributed
// Ray Tracing", EGPGV 2002, figures 2 and 3. There, red begins above 25 and 50, and what is between
// yellow and red has no name; here red begins where yellow ends.
std::span<const ColourClass, 6> classes_of(RayView view);

float value_of(const RayCount& pixel, RayView view);
// Of a value; NaN, which no count is, as the last.
const ColourClass& class_of(float value, RayView view);

// Fills (height, width, 3) codes. Throws std::invalid_argument if the sizes do not agree.
void draw_false_colour(const RayCounts& counts, RayView view, std::span<std::uint8_t> rgb8);

// Draws the classes and their limits into the lower left corner of (height, width, 3) codes; into
// pictures too small for it, as much as there is room for.
void draw_legend(RayView view, int width, int height, std::span<std::uint8_t> rgb8);

struct RayViewFigures {
  double mean = 0, max = 0;  // over the pixels
};
// In the order of the views.
std::array<RayViewFigures, ray_views> figures_of(const RayCounts& counts);

}  // namespace render
