// The headlight's bulb: two shells of glass, a coil, its wires and its base.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "render/made_headlight.h"
#include "render/made_shapes.h"

namespace render {
namespace {

using Profile = std::vector<std::array<float, 2>>;

constexpr int segments = 160;

// A tube with round ends, from its lower tip to its upper one.
Profile make_capsule_profile(double radius, double lower, double upper) {
  constexpr int foot = 14, cap = 30, body = 34;  // the foot is in the base, where little is seen
  Profile profile;
  for (int i = 0; i <= foot; ++i) {
    const double angle = 0.5 * std::numbers::pi * i / foot;
    profile.push_back({static_cast<float>(radius * std::sin(angle)),
                       static_cast<float>(lower + radius * (1 - std::cos(angle)))});
  }
  const double straight = upper - lower - 2 * radius;
  for (int i = 1; i < body; ++i) {
    profile.push_back(
        {static_cast<float>(radius), static_cast<float>(lower + radius + straight * i / body)});
  }
  for (int i = cap; i >= 0; --i) {
    const double angle = 0.5 * std::numbers::pi * i / cap;
    profile.push_back({static_cast<float>(i == 0 ? 0 : radius * std::sin(angle)),
                       static_cast<float>(upper - radius * (1 - std::cos(angle)))});
  }
  return profile;
}

// A closed shell of glass about a cavity.
Mesh make_shell(double radius, double wall, double lower, double upper) {
  Mesh shell = make_turned(make_capsule_profile(radius, lower, upper), segments);
  Profile cavity = make_capsule_profile(radius - wall, lower + wall, upper - wall);
  std::reverse(cavity.begin(), cavity.end());
  append(shell, make_turned(cavity, segments));
  return shell;
}

// Points no further apart than `step` along the profile's straight pieces.
Profile refined(const Profile& corners, float step) {
  Profile fine{corners.front()};
  for (std::size_t i = 1; i < corners.size(); ++i) {
    const auto& [r0, z0] = corners[i - 1];
    const auto& [r1, z1] = corners[i];
    const int count = std::max(1, static_cast<int>(std::ceil(std::hypot(r1 - r0, z1 - z0) / step)));
    if (corners[i] == corners[i - 1]) {
      fine.push_back(corners[i]);
      continue;
    }
    for (int k = 1; k < count; ++k) {
      const float share = static_cast<float>(k) / static_cast<float>(count);
      fine.push_back({r0 + (r1 - r0) * share, z0 + (z1 - z0) * share});
    }
    fine.push_back(corners[i]);
  }
  return fine;
}

Mesh make_base() {
  const Profile corners{{0, -0.05F},         {0.0115F, -0.05F},   {0.0115F, -0.05F},
                        {0.0115F, -0.034F},  {0.0115F, -0.034F},  {0.0178F, -0.034F},
                        {0.0178F, -0.034F},  {0.0178F, -0.0305F}, {0.0178F, -0.0305F},
                        {0.0128F, -0.0305F}, {0.0108F, -0.028F},  {0.0108F, -0.0215F},
                        {0.0108F, -0.0215F}, {0.0096F, -0.0215F}, {0.0096F, -0.0215F},
                        {0.0096F, -0.0262F}, {0.0096F, -0.0262F}, {0, -0.0262F}};
  Mesh base = make_turned(refined(corners, 0.0012F), segments);
  for (const float turn : {0.0F, 2.1F, 4.2F}) {
    Mesh blade = make_box({0.0045F, -0.003F, -0.062F}, {0.0053F, 0.003F, -0.05F}, 0.0002F, 1);
    blade.uvs.clear();
    append(base, blade, {}, turn);
  }
  return base;
}

}  // namespace

HeadlightBulb make_headlight_bulb() {
  HeadlightBulb bulb;
  bulb.envelope = make_shell(0.009, 0.0009, -0.0255, 0.026);
  bulb.capsule = make_shell(0.0056, 0.0008, -0.0145, 0.0125);
  bulb.base = make_base();
  constexpr double coil = 0.0011, length = 0.0062;
  constexpr int turns = 9, steps = 68;
  std::vector<Vec3f> line;
  for (int i = 0; i <= turns * steps; ++i) {
    const double angle = 2 * std::numbers::pi * i / steps;
    line.push_back({static_cast<float>(coil * std::cos(angle)),
                    static_cast<float>(coil * std::sin(angle)),
                    static_cast<float>(length * i / (turns * steps) - length / 2)});
  }
  bulb.filament = make_tube(line, 0.00017F, 14);
  // From both ends of the coil down into the base, the far one's wire beside the coil.
  const auto bent = [](std::vector<Vec3f> corners) {
    for (int pass = 0; pass < 4; ++pass) {  // Chaikin's corner cutting
      std::vector<Vec3f> cut{corners.front()};
      for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
        cut.push_back(corners[i] * 0.75F + corners[i + 1] * 0.25F);
        cut.push_back(corners[i] * 0.25F + corners[i + 1] * 0.75F);
      }
      cut.push_back(corners.back());
      corners = std::move(cut);
    }
    return corners;
  };
  constexpr auto r = static_cast<float>(coil);
  constexpr auto z = static_cast<float>(length / 2);
  bulb.wires = make_tube(bent({{r, 0, -z - 0.0001F},
                               {r, 0, -z - 0.003F},
                               {-0.0022F, 0, -z - 0.004F},
                               {-0.0022F, 0, -0.026F}}),
                         0.0003F, 20);
  append(bulb.wires, make_tube(bent({{r, 0, z + 0.0001F},
                                     {r, 0, z + 0.0022F},
                                     {0.0034F, 0, z + 0.0022F},
                                     {0.0034F, 0, z - 0.006F},
                                     {0.0022F, 0, -0.026F}}),
                               0.0003F, 20));
  return bulb;
}

}  // namespace render
