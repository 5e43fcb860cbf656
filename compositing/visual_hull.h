// Persons as visual hulls: what two or more keyed, calibrated cameras see of one, in a box.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "compositing/camera_grid.h"
#include "render/mesh.h"

namespace compositing {

struct HullSettings {
  std::array<float, 3> gain{1, 1, 1};  // radiance of the pictures' white, in the plate's units
  // Longest step along a ray, in pixels of the picture that is nearest to it, .25 to 64; but no ray
  // takes more than 4096. Parts that are thinner may be missed.
  float step_px = 1.5F;
  // Colour only from cameras that the hull itself does not hide the place from.
  bool hides = true;
};

// A live picture (render::Scene::pictures) and the camera that it is of. Those that know bounds of
// their alpha (KeyedPicture, `bounded`) are many times as quick: what is empty is found once a
// frame, when the scene is made (HullCells); nobody has to ask for it.
struct HullView {
  std::uint32_t picture = 0;
  BillboardCamera camera;
};

// Registers the shader "hull": a part of register_shaders() (stand_in.h).
//
// Rays are followed through a box. A place in it has the least alpha that any camera sees there;
// cameras that do not see so far have no say, and where none does is nothing. A ray is as opaque as
// the most opaque place on it, and goes on behind: hair stays soft. Its colour is what the cameras
// see where it first has half of that, un-premultiplied, mixed by how near their direction is to
// the ray's, without those that the hull hides the place from. A camera's own view is its picture.
// Camera rays, mirrored, bent and shadow rays see it alike, filtered as wide as the sample's cone;
// shadow rays, which have none, see the finest texels.
//
// Other objects in the box hide what is behind them and are hidden by what is before them. Not so:
// rays that begin in the box do not see the hull, nor does what is in the box take its shadow; a
// lamp in the box shadows what it lights through the person behind it too, for shadow rays are
// followed to the end of the box; of two persons whose boxes overlap, the one whose box is nearer
// is drawn over the other. It has no normals, and is shown as it was filmed, whatever the set's
// light.
//
// Matusik, Buehler, Raskar, Gortler and McMillan, "Image-Based Visual Hulls", SIGGRAPH 2000, here
// with soft alpha, by sampling instead of polygons. Colour: Buehler, Bosse, McMillan, Gortler and
// Cohen, "Unstructured Lumigraph Rendering", SIGGRAPH 2001, section 4, the penalty by angle.
void register_hulls();

// A material of that shader. Throws std::invalid_argument for fewer than 2 or more than 8 views,
// lenses as of make_billboard_material(), or settings beyond their ranges.
render::Material make_hull_material(std::string name,
                                    const HullSettings& settings,
                                    std::span<const HullView> views,
                                    int steps = 96);

// The unit cube 0..1 that hulls are placed by.
render::Mesh make_hull_mesh(std::uint32_t material);
// Its placing (Instance::set_from_object) as the box from `lower` to `upper` in the set, a tenth of
// a millimetre wide at least. What lies in it takes no shadow of the hull, so let it begin a
// millimetre above a floor.
std::array<float, 12> placed_box(calibrate::Vec3f lower, calibrate::Vec3f upper);

}  // namespace compositing
