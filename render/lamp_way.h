// The way to a lamp, of one point or of eight: T is float or Eight. Private to the renderer.
#pragma once

#include <numbers>

#include "render/lanes.h"
#include "render/light_table.h"

namespace render {

// A ray ends so near before a lamp, as a share of the way.
inline constexpr float before_lamp = 1 - 1e-3F;

template <class T>
struct LampWay {
  calibrate::Vec3T<T> direction;  // unit
  T distance_m{}, per_intensity{};
  decltype(T{} > T{}) shines{};  // where it does not, the rest means nothing
};

template <class T>
struct WayTo {
  calibrate::Vec3T<T> direction;  // unit
  T squared_m2{}, distance_m{};
};

template <class T>
WayTo<T> way_to(const calibrate::Vec3T<T>& from, const Vec3f& to) {
  const calibrate::Vec3T<T> way{to.x - from.x, to.y - from.y, to.z - from.z};
  const T squared = dot(way, way);
  const T distance = root(squared);
  return {way * (1.0F / distance), squared, distance};
}

template <class T>
T dot_with(const calibrate::Vec3T<T>& a, const Vec3f& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

// What must be added to the squared distance so that a lamp's irradiance is that of a disc of its
// area: from afar by the integral's second order, close by as on the disc's axis, where the radius'
// square is exact.
template <class T>
T nearness(const calibrate::Vec3T<T>& normal,
           const LocalLight& lamp,
           const T& cosine,
           const T& facing,
           const T& squared) {
  if (!(lamp.area_m2 > 0)) return T{};
  const float radius_squared = lamp.area_m2 / std::numbers::pi_v<float>;
  T afar = T{} + 1.0F;
  if (lamp.normal != Vec3f{}) {
    const auto clamped = [](T v, T low, T high) {
      v = v < low ? low : v;
      return v > high ? high : v;
    };
    const T along = -dot_with(normal, lamp.normal) * facing;
    const T ratio = clamped(along, -2.0F * cosine, 2.0F * cosine) / cosine;
    afar = clamped(3.0F * facing * facing - 1.0F - ratio, T{} - 2.0F, T{} + 1.0F);
  }
  const T close = radius_squared / (radius_squared + squared);
  return radius_squared * (close + (1.0F - close) * afar);
}

// To a lamp that is not ambient.
template <class T>
LampWay<T> way_to_lamp(const calibrate::Vec3T<T>& origin,
                       const calibrate::Vec3T<T>& normal,
                       const calibrate::Vec3T<T>& geometric_normal,
                       const LocalLight& lamp) {
  const WayTo<T> way = way_to(origin, lamp.position);
  const T cosine = dot(normal, way.direction);
  const T facing = lamp.normal == Vec3f{} ? T{} + 1.0F : T{} - dot_with(way.direction, lamp.normal);
  const T divisor = way.squared_m2 + nearness(normal, lamp, cosine, facing, way.squared_m2);
  LampWay<T> to{way.direction, way.distance_m, cosine * facing / divisor, {}};
  to.shines = (way.distance_m > T{} + 1e-6F) & (cosine > T{}) &
              (dot(geometric_normal, way.direction) > T{}) & (facing > T{});
  return to;
}

}  // namespace render
