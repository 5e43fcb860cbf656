// Small vectors and 3x3 matrices.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

namespace calibrate {

template <class T>
struct Vec2T {
  T x{}, y{};
  friend bool operator==(const Vec2T&, const Vec2T&) = default;
};

template <class T>
struct Vec3T {
  T x{}, y{}, z{};

  friend constexpr Vec3T operator+(Vec3T a, Vec3T b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend constexpr Vec3T operator-(Vec3T a, Vec3T b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend constexpr Vec3T operator*(Vec3T a, Vec3T b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
  friend constexpr Vec3T operator*(Vec3T a, T s) { return {a.x * s, a.y * s, a.z * s}; }
  friend constexpr Vec3T operator*(T s, Vec3T a) { return a * s; }
  friend constexpr Vec3T operator/(Vec3T a, T s) { return {a.x / s, a.y / s, a.z / s}; }
  constexpr Vec3T operator-() const { return {-x, -y, -z}; }
  constexpr Vec3T& operator+=(Vec3T b) { return *this = *this + b; }
  constexpr Vec3T& operator-=(Vec3T b) { return *this = *this - b; }
  constexpr Vec3T& operator*=(T s) { return *this = *this * s; }
  friend bool operator==(const Vec3T&, const Vec3T&) = default;
};

template <class T>
constexpr T dot(Vec3T<T> a, Vec3T<T> b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class T>
constexpr Vec3T<T> cross(Vec3T<T> a, Vec3T<T> b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class T>
inline T length(Vec3T<T> a) {
  return std::sqrt(dot(a, a));
}
// Unit vector; the zero vector stays zero.
template <class T>
inline Vec3T<T> normalize(Vec3T<T> a) {
  const T l = length(a);
  return l > T(0) ? a / l : a;
}
template <class T>
bool is_finite(Vec3T<T> a) {
  return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z);
}

using Vec2 = Vec2T<double>;
using Vec3 = Vec3T<double>;
using Vec3f = Vec3T<float>;

inline float mean(Vec3f v) { return (v.x + v.y + v.z) * (1.0F / 3); }
inline float largest(Vec3f v) { return std::max({v.x, v.y, v.z}); }
inline Vec3f mix(Vec3f a, Vec3f b, float t) { return a + (b - a) * t; }
inline double squared(Vec2 v) { return v.x * v.x + v.y * v.y; }

// Without the care of std::hypot for numbers near the limits, and several times as fast.
inline double hypotenuse(double a, double b) { return std::sqrt(a * a + b * b); }
inline float hypotenuse(float a, float b) { return std::sqrt(a * a + b * b); }

inline Vec3f to_float(Vec3 v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}
inline Vec3 to_double(Vec3f v) { return {v.x, v.y, v.z}; }

// Row-major.
struct Mat3 {
  std::array<double, 9> m{1, 0, 0, 0, 1, 0, 0, 0, 1};

  Vec3 operator*(Vec3 v) const {
    return {m[0] * v.x + m[1] * v.y + m[2] * v.z, m[3] * v.x + m[4] * v.y + m[5] * v.z,
            m[6] * v.x + m[7] * v.y + m[8] * v.z};
  }
  Mat3 operator*(const Mat3& b) const;
  Mat3 transposed() const { return {{m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]}}; }
  friend bool operator==(const Mat3&, const Mat3&) = default;
};

}  // namespace calibrate
