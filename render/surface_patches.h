// Meshes from smooth surfaces that are given as functions: grids, patches laid on them, lathes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "render/mesh.h"

namespace render {

// A point of a smooth surface, metres, of its two parameters. Outside is du x dv.
using SmoothSurface = std::function<Vec3(double u, double v)>;

// A closed line in the parameters of a surface, counter-clockwise.
using ParameterLine = std::vector<std::array<double, 2>>;

// The line through given corners with its corners rounded, as `count` points evenly along it.
ParameterLine make_rounded_line(std::span<const std::array<double, 2>> corners, int count);
// The line drawn towards the mean of its points by a factor.
ParameterLine scaled(const ParameterLine& line, double factor);
bool lies_inside(const ParameterLine& line, double u, double v);

// The unit outside normal.
Vec3 normal_of(const SmoothSurface& surface, double u, double v);

// A grid of rows x columns vertices. `parameters(row, column)` places one; `material(row, column)`
// is that of the two triangles after it, nothing for a hole; `depth_m(row, column)` sinks a vertex
// below the surface (a seam), and may be empty. Normals are the surface's.
struct GridPatch {
  int rows = 0;
  int columns = 0;
  std::function<std::array<double, 2>(int row, int column)> parameters;
  std::function<std::optional<std::uint32_t>(int row, int column)> material;
  std::function<double(int row, int column)> depth_m;
};
void add_grid(Mesh& mesh, const SmoothSurface& surface, const GridPatch& patch);

// A patch within `line`, lifted off the surface, its rim sunk into it. The line must see all its
// points from their mean. The outermost `rim_rings` of `rings` take the material `rim`.
struct LaidPatch {
  ParameterLine line;
  double lift_m = 0.003;
  int rings = 8;
  int rim_rings = 1;
  std::uint32_t material = 0;
  std::uint32_t rim = 0;
  std::vector<ParameterLine> covers;  // what lies on the patch: triangles inside them are left out
};
void add_laid(Mesh& mesh, const SmoothSurface& surface, const LaidPatch& patch);

// An area of a surface that a patch hides, and its mirror image if it is on both sides.
class CoveredArea {
 public:
  CoveredArea(ParameterLine line, bool both_sides);
  bool both_sides() const { return both_sides_; }
  bool covers(const std::array<double, 2>& place) const;

 private:
  ParameterLine line_;
  bool both_sides_;
  std::array<double, 2> lower_, upper_;  // bounds
};

// Gives every vertex the mean of its triangles' normals, weighted by area.
void smooth_normals(Mesh& mesh);

// Halves the largest triangles along their longest edges until there are `count` more: no shape is
// changed. Their neighbours are left as they are.
void halve_largest(Mesh& mesh, std::size_t count);

// Mirrors at y = 0.
void add_mirrored(Mesh& mesh, const Mesh& part);
void append_mesh(Mesh& mesh, const Mesh& part);

// Smooth interpolation through points of rising x, without overshoot (constant beyond the ends).
//
// Fritsch and Butland, "A Method for Constructing Local Monotone Piecewise Cubic Interpolants",
// SIAM Journal on Scientific and Statistical Computing 5, 1984.
class MonotoneCurve {
 public:
  explicit MonotoneCurve(std::vector<std::array<double, 2>> points);
  double operator()(double x) const;

 private:
  std::vector<std::array<double, 2>> points_;
  std::vector<double> slopes_;
};

}  // namespace render
