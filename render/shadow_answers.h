// What the shadow rays of a cell came to, so that it stays as it is where things move, but none of
// these comes to something else. Private to the kernel.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "render/cell_visibility.h"
#include "render/light_table.h"
#include "render/scene.h"
#include "render/trace.h"

namespace render {

class SoftLights;
struct GatherWorkspace;
struct LightContext;
struct Receivers;

// Where shadow rays go: to lights of the table or their parts, all the way or only as far as what
// casts narrow penumbrae (GatherWorkspace::sharp_m); to lamps; or anywhere.
enum class ShadowRays : std::uint8_t { to_lights, near_to_lights, to_lamps, anywhere };

// Things that moved, in the light of a table.
class MovedInLight {
 public:
  // What they filled before or fill now.
  MovedInLight(std::span<const Scene::Bounds> where, std::size_t lights, const SoftLights& soft);

  // These, a little larger: no ray from `box` that meets any is told to miss it.
  void seen_from(const Scene::Bounds& box, std::vector<Scene::Bounds>& things) const;
  // Of the lights, a bit each: whether they may be in the way of any of their directions, from
  // anywhere in `box`.
  void find_shaded(std::span<const Scene::Bounds> things,
                   const Scene::Bounds& box,
                   std::vector<std::uint8_t>& lights) const;

 private:
  std::vector<Scene::Bounds> where_;  // those that overlap are one
  // Least and largest coordinates of each light's directions, filled up to whole eights.
  std::array<std::vector<float>, 3> least_, largest_;
};

// All shadow rays of a cell, light by light as they were shot, but those that things block which
// stand still: whatever moves, these stay blocked.
class ShadowAnswers {
 public:
  // Of a cell that takes more, none are kept.
  static constexpr std::size_t most_rays = 24576;

  // None so far; whether they are to be kept.
  void begin(bool keeps);
  void forget() { begin(false); }
  // Whether all are here.
  bool known() const { return known_; }
  // Whether any ray comes to something else in the context's scene, where these moved. False only
  // if all do not. Of a cell whose answers are known, with the light table and effort that it was
  // found with.
  bool differ(const LightContext& context,
              const MovedInLight& moved,
              LivePictures pictures,
              GatherWorkspace& workspace) const;
  std::size_t bytes() const;

 private:
  friend class ShadowNotes;

  enum class Answer : std::uint8_t { passes, blocked, dimmed };
  struct Receiver {
    Vec3f origin;
    std::uint32_t mask;
    float sharp_m;
  };
  struct Ray {
    std::uint16_t receiver;
    std::uint8_t part;  // of a light
    Answer answer;
  };
  struct Way {
    Vec3f direction;
    float far_m;
  };
  struct Run {
    std::uint32_t first;  // of the rays
    std::uint32_t first_free;
    std::uint16_t number;  // of the light, or the lamp
    std::uint16_t group;
    ShadowRays to;
  };
  struct Group {
    Scene::Bounds box;  // of its receivers
    std::uint32_t first_unasked;
  };

  Way way(const LightContext& context, const Run& run, std::size_t ray) const;
  static Answer answer_of(const GatherWorkspace& w, std::size_t ray, bool filters);

  bool known_ = false;
  std::vector<Receiver> receivers_;
  std::vector<Ray> rays_;
  std::vector<Way> free_;  // of those that go anywhere
  std::vector<Run> runs_;
  std::vector<Group> groups_;
  std::vector<std::uint16_t> unasked_;  // lights that nothing could block, group by group
};

// Writes them down.
class ShadowNotes {
 public:
  // Of a cell, where things that may move fill these; null = nobody wants them.
  void begin_cell(ShadowAnswers* to, std::span<const Scene::Bounds> moving = {});
  // Rays that follow begin at these receivers.
  void begin(const LightContext& context, const Receivers& receivers, ShadowRays to);
  void go_on(ShadowRays to) { rays_to_ = to; }
  bool ask_for_reach() const { return wants() && rays_to_ == ShadowRays::anywhere; }
  // No ray goes to a light, for nothing can block it from anywhere in that box.
  void leave_out(std::uint32_t light, const Scene::Bounds& box);
  // The stream's rays, once they are shot.
  void note(const GatherWorkspace& w);
  // One that was shot alone.
  void note(Vec3f origin, std::uint32_t mask, Vec3f direction, bool blocked);

 private:
  static constexpr std::uint16_t none = 0xFFFF;

  bool wants() const { return to_ != nullptr && to_->known_; }
  unsigned meet_moving(const GatherWorkspace& w, std::size_t first) const;
  std::uint16_t receiver(Vec3f origin, std::uint32_t mask, float sharp_m);
  void begin_run(std::uint32_t number, ShadowRays to);

  ShadowAnswers* to_ = nullptr;
  const LightContext* context_ = nullptr;
  const Receivers* from_ = nullptr;
  ShadowRays rays_to_ = ShadowRays::to_lights;
  std::array<std::uint16_t, cell_pixels> number_{};
  static constexpr std::size_t most_moving = 8;  // more are taken for one
  std::vector<Scene::Bounds> moving_;
};

}  // namespace render
