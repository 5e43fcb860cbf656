// From display or camera codes to scene-linear values (Rec.709 primaries) and back.
#pragma once

#include <array>
#include <string>
#include <string_view>

namespace capture {

// How a non-linear value 0..1 and light relate. Values beyond 0..1 continue the curve: odd about 0.
enum class Transfer {
  rec1886,  // light = v^2.4: a Rec.1886 display, and so the inverse of its un-tone-mapped view
  srgb,     // IEC 61966-2-1, piecewise
  rec709_camera,  // inverse of the BT.709 camera curve
  linear,
};

// The working values of a plate: how its codes are decoded.
struct PlateColour {
  Transfer transfer = Transfer::rec1886;
};

// light of value and value of light, in double: the definition that tables are made from.
double decode(Transfer transfer, double value);
double encode(Transfer transfer, double light);

// "Rec.1886", "sRGB", "Rec.709 camera", "linear"; throws std::invalid_argument listing these.
Transfer transfer_from_name(std::string_view name);
std::string_view name_of(Transfer transfer);

}  // namespace capture
