// The parameter block of stand-ins, checked.
#include "render/stand_in_parameters.h"

#include <cstring>
#include <stdexcept>
#include <string>
#include <type_traits>

namespace render {

static_assert(std::is_trivially_copyable_v<StandInParameters>);
static_assert(sizeof(StandInParameters) == 32, "blocks travel: no padding, no surprise");

StandInParameters stand_in_parameters(const Material& material) {
  const auto refuse = [&](const std::string& why) {
    throw std::invalid_argument("stand-in '" + material.name + "': " + why);
  };
  StandInParameters parameters;
  if (material.shader != "stand_in")
    refuse("its shader is '" + material.shader + "', not stand_in");
  if (material.parameters.size() != sizeof parameters) refuse("its block has a wrong size");
  std::memcpy(&parameters, material.parameters.data(), sizeof parameters);
  for (const float albedo : parameters.albedo)
    if (!(albedo >= 0 && albedo <= 1)) refuse("albedo must be 0 to 1");
  if (!(parameters.reflectance >= 0 && parameters.reflectance <= 1))
    refuse("reflectance must be 0 to 1");
  if (!(parameters.roughness >= 0 && parameters.roughness <= 1)) refuse("roughness must be 0 to 1");
  return parameters;
}

}  // namespace render
