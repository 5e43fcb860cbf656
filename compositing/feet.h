// Where a person's feet meet the floor: found in the matte, followed over time.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "calibrate/lens.h"
#include "calibrate/pose.h"
#include "capture/image.h"

namespace compositing {

enum class FeetStatus : std::uint8_t {
  seen,
  cut_off,    // by the picture's lower edge, or a mask
  uncertain,  // somebody is there, but these need not be the feet
  absent,
};
std::string_view name_of(FeetStatus status);

// The feet in one matte.
struct Feet {
  calibrate::Vec2 q;    // lower edge of the foot that is lowest in the picture; pixels of the matte
  double sigma_px = 0;  // of q, downwards; 0 if absent
  FeetStatus status = FeetStatus::absent;
  // Edges of what belongs to the person, things in hands too: left, top, right, bottom in pixels of
  // the matte; all 0 if absent.
  std::array<float, 4> box{};
  // Lower convex hull of what stands, both feet and what hangs beside them no lower: corners from
  // left to right, pixels of the matte, a sigma above its edge. Empty if no end is surely a foot.
  std::vector<calibrate::Vec2> lower{};
};

// Finds the feet in a matte: alpha (height, width, 1), may be smaller than the video. The person
// is the largest connected thing; its feet are the ends that the body stands over, so that what
// hangs lower beside it is none (billboards.md). If the feet are not whole in the picture, q is
// still the lowest place. An empty image shows nobody. Values that are not finite count as 0.
// `turns`: quarter turns to the right after which the picture is upright; what is found is in
// pixels of the matte as it came. `mask` (of the matte's size, or empty): 1 where the matte is cut
// off by a garbage mask. Throws std::invalid_argument if the channels are not one or the pixels do
// not match the size.
Feet find_feet(const capture::Image& alpha, int turns = 0, const capture::Image& mask = {});

// After how many quarter turns to the right, 0..3, the camera's picture is as upright as may be.
int turns_to_upright(const calibrate::Pose& cam_from_set);

// Where the person stands in the set.
struct Standing {
  calibrate::Vec3 p_set;  // on the floor
  double sigma_m = 0;     // along the direction in which it is largest
  FeetStatus status = FeetStatus::absent;
  bool held = false;  // where the feet were last seen; sigma_m then grows with time
};

// Follows the point where the feet's ray meets the floor. A value: copies go on independently.
//
// Kalman filter with white-noise acceleration: Bar-Shalom, Li and Kirubarajan, "Estimation with
// Applications to Tracking and Navigation", Wiley 2001, section 6.3.2, on both axes of the floor,
// with measurement noise from each picture's geometry. Departures: the step to the other foot is
// taken at once; places that cannot be reached are held, until they are seen for a while.
class FeetTracker {
 public:
  // Throws std::invalid_argument as calibrate::check, or if pose or floor are not finite.
  FeetTracker(const calibrate::Lens& lens, const calibrate::Pose& cam_from_set, double floor_z);

  // feet.q in pixels of the lens's picture, found with turns_to_upright(); time in seconds. Nothing
  // until feet were first seen. Followed, but `uncertain`, where a ray more than 45 degrees below
  // the horizon sees them, or the person leans by more than 25 in the picture.
  // Where time returns, as after restart(), the place is held and then taken up anew. Never throws,
  // and all results are finite.
  std::optional<Standing> update(double time_s, const Feet& feet);
  // A clip begins again: what was seen before tells nothing about the next place.
  void restart();

 private:
  struct Seen {
    calibrate::Vec2 at;      // on the floor
    calibrate::Vec2 away;    // unit vector, horizontally away from the camera
    double sigma_along = 0;  // metres
    double sigma_across = 0;
    bool doubted = false;  // seen too steeply, or leaning: the lowest place need be no foot
  };
  std::optional<Seen> see(const Feet& feet) const;
  void start(const Seen& seen);
  void predict(double seconds);
  bool correct(const Seen& seen, calibrate::Vec2 last, double further);
  Standing standing(FeetStatus status) const;
  bool is_doubted(calibrate::Vec2 q, calibrate::Vec3 v_cam) const;

  calibrate::Lens lens_;
  calibrate::Pose set_from_cam_;
  calibrate::Vec2 down_;  // unit vector, in pictures as the camera takes them
  double floor_z_ = 0;
  bool started_ = false;
  double time_s_ = 0;                       // of the last update
  double seen_s_ = 0;                       // when the feet were last followed
  double looked_s_ = 0;                     // when they were last seen, followed or not
  std::array<double, 4> state_{};           // x, y, their velocities
  std::array<double, 16> covariance_{};     // of the state, row by row
  std::optional<calibrate::Vec2> strange_;  // where they were seen, out of reach
  double strange_since_s_ = 0;
};

}  // namespace compositing
