// From RGB with other primaries to ours: linear Rec.709.
#pragma once

#include <array>

#include "capture/image.h"

namespace capture {

// CIE 1931 xy of the three primaries and of white. XYZ itself is (1,0) (0,1) (0,0), white
// (1/3,1/3).
struct Primaries {
  std::array<double, 2> red{0.64, 0.33};
  std::array<double, 2> green{0.30, 0.60};
  std::array<double, 2> blue{0.15, 0.06};
  std::array<double, 2> white{0.3127, 0.3290};
  friend bool operator==(const Primaries&, const Primaries&) = default;
};

inline constexpr Primaries rec709{};
inline constexpr Primaries xyz{{1, 0}, {0, 1}, {0, 0}, {1.0 / 3, 1.0 / 3}};

// The row-major 3x3 matrix that takes linear RGB of these primaries to linear Rec.709. A white
// other than D65 is adapted (Bradford), so that equal R, G and B stay grey; XYZ is not, since its
// values are colours as they are. Throws std::invalid_argument if the primaries span no colour
// space.
std::array<double, 9> rec709_from(const Primaries& primaries);

// Converts the first three channels in place; images with fewer are left as they are.
void convert_to_rec709(Image& image, const Primaries& primaries);

}  // namespace capture
