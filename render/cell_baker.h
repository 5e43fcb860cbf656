// Finds a cell's transport: camera rays, what they meet, who sees which light, bounces, edges.
// Private to the kernel.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "render/cell_transport.h"
#include "render/environment_places.h"
#include "render/further_samples.h"
#include "render/kernel.h"
#include "render/light_terms.h"
#include "render/met_centres.h"
#include "render/open_lobes.h"
#include "render/place_terms.h"
#include "render/plate_view.h"
#include "render/sample_sequence.h"
#include "render/standard.h"
#include "render/trace.h"

namespace render {

// Of a pixel's first further samples, in terms of the effort's.
inline constexpr float first_tolerance = 0.5F;

struct TraceContext;

// A stream of rays with their hits.
struct RayStream {
  alignas(64) std::array<float, stream_rays> ox, oy, oz, dx, dy, dz, near_m, far_m, time;
  alignas(64) std::array<unsigned, stream_rays> mask, id, flags, geom, prim, inst;
  alignas(64) std::array<float, stream_rays> u, v, ngx, ngy, ngz;
};

// Thrown where a cell takes too long to be found.
struct TakesTooLong {};

// A cell under the planned light while its transport is found: one sample after the other is both
// added up (to decide what is worth more rays) and noted in the transport.
//
// All memory that this takes on one thread; once it has grown, nothing is allocated.
class CellBaker final : public RaySink {
 public:
  CellBaker();
  using Clock = std::chrono::steady_clock;

  // The cell whose top-left pixel is (x0, y0), at that stage, into `transport`. Throws TakesTooLong
  // some time after `give_up`; `transport` is of no use then.
  void bake(const FrameContext& frame,
            int stage,
            int x0,
            int y0,
            CellTransport& transport,
            RenderStatistics& statistics,
            Clock::time_point give_up = Clock::time_point::max());
  void log_rays(RayLog* log) { gather_.log = log; }
  // Of the lists that are as long as cells need: of the longest so far.
  std::size_t scratch_bytes() const;

  void push(const ShadePoint& from, const NewRay& ray) override;

 private:
  static constexpr int ring_size = MetCentres::side;
  static constexpr int around = 4 * (ring_size - 1);  // pixels around a cell
  static constexpr std::uint16_t nowhere = 0xFFFF;    // no receiver
  static constexpr std::uint32_t no_catcher = ~0U, unshaded = ~0U,
                                 first_mirrored = CellTransport::ShadedPlate::first_mirrored;

  struct QueuedRay {
    Vec3f origin, direction, throughput;
    Vec3f sees;            // where it looks for the environment: elsewhere in rough lobes
    Spread spread, steps;  // across the sample's cone: of directions, of where it begins
    float roughness;
    std::uint32_t pixel, slot;
    RayKind kind;
    std::uint8_t depth;
    std::uint16_t behind;  // the picture ray that its path began with last, or none
    bool one_of_many;      // of rays all over a rough lobe: its compact light is found apart
    bool lamps_apart;    // and so are the lamps that it mirrors: it does not see what glows by them
    bool beyond_cut;     // followed by chance: what is straight on is counted, for all that are not
    bool first;          // that a centre sent on, or the brightest of several
    bool asks;           // it is cut, and only asks whether anything is in its way
    bool by_lights;      // in a lobe of whose light `open_lobes_` tells as well
    bool sees_mirrored;  // what is virtual has turned it: stand-ins that are mirrored show
    std::uint32_t path;
    Media media;
  };

  // What a ray that is not followed takes of the environment, once it is known how much of its
  // light its point gets.
  struct CutRay {
    Vec3f throughput;
    Vec3f radiance;                   // there, of the planned light, if anybody asks
    std::uint32_t first_place, last;  // of `cut_places_`
    std::uint16_t point;
    bool rough;  // in a lobe as those that `open_lobes_` tells of
  };

  // A lobe, whose compact light waits until it is known who sees which.
  struct Lobe {
    const ShadePoint* point;
    SeenLobe seen;
    Vec3f throughput;
    float cone_rad;  // of what the point stands for, mirrored
    float roughness, share;
    std::uint32_t number;  // of the lobe on its path, for random numbers
    bool difference;
    bool lamps;  // it mirrors lamps
  };

  // Why a pixel takes further camera rays.
  enum class Edge : std::uint8_t {
    none,
    surface,  // another surface begins: those that meet what a neighbour met share its radiance
    glint,    // mirrored light changes quickly, or a sharp shadow ends: they share only the light
              // that arrives, of sources that all centres about see alike
    shadow,   // the light that arrives does, of other sources: they share nothing
    blend,    // light changes, but too little for rays yet: neighbours are blended
  };

  struct Further {
    std::uint16_t pixel;
    std::uint16_t index;  // in the frame's pattern
  };

  // A source that casts sharp shadows, which centres about a pixel see unlike each other.
  struct Doubt {
    std::uint16_t number;  // among the compact lights, or the cell's lamps
    bool is_lamp;
    friend bool operator==(const Doubt&, const Doubt&) = default;
  };

  // What a point has of such a source by its centre, and what by itself: irradiance per source's if
  // nothing is in the way, and what passes.
  struct AskedAgain {
    std::uint16_t number = 0;  // of the light table's lights, or its lamps
    bool is_lamp = false;
    float per_source = 0, per_source_centre = 0;
    Vec3f passed{}, passed_centre{};
  };

  // What a cone sees of the environment.
  struct LookUp {
    Vec3f direction;  // none is zero
    float roughness;
    Spread spread;
    bool diffused;  // without compact sources
    std::size_t count = 0;
    std::array<MapSample, most_map_samples> places;
    std::optional<Vec3f> radiance;  // if it was asked for
  };

  // A slot of painted light, whose points show one live texture in one slot.
  struct PaintedSlot {
    std::uint16_t number;  // in CellTransport::painted
    std::uint16_t slot, video;
    float weight;  // of its points together
  };
  using PaintedOfPixel = std::array<PaintedSlot, CellTransport::most_painted_of_pixel>;

  // Of points: the irradiance that is planned.
  struct Light {
    Vec3f open, arriving;
    Vec3f lamps;  // of the lamps
    friend bool operator==(const Light&, const Light&) = default;
  };

  // The order of camera rays in a cell's stream: 4x4 blocks one after the other.
  static std::array<int, 2> pixel_of_ray(int i) {
    return {((i >> 4) & 3) * 4 + (i & 3), (i >> 6) * 4 + ((i >> 2) & 3)};
  }
  template <class Sample>  // a point, or a ray
  static std::size_t target_of(const Sample& p) {
    if (p.behind != no_picture_ray) return slots + p.behind;
    return p.slot < cell_pixels ? p.pixel : cell_pixels + p.pixel;
  }
  // Of what a point's matte surface sends back.
  static std::uint16_t matte_target_of(const ShadePoint& p) {
    return static_cast<std::uint16_t>(
        p.painted == not_painted ? target_of(p) : CellPicture::all_slots + p.painted);
  }
  // What it sends back, in planned light, under paint as well.
  static Vec3f planned_diffuse(const ShadePoint& p) {
    return p.painted == not_painted ? p.diffuse : p.diffuse * planned_grey;
  }
  // The same of a centre, times its share.
  Vec3f diffuse_of_centre(std::size_t k) const {
    return transport_->centres.front().diffuse.at(k) + painted_diffuse_[k];
  }
  // Of the points that are at work.
  std::size_t index_of(const ShadePoint& p) const {
    return static_cast<std::size_t>(&p - points_.data());
  }
  bool is_inside(std::size_t k) const { return (inside_[k / 64] >> (k % 64) & 1) != 0; }
  // Of a sample through no pixel's centre.
  bool is_further(std::size_t slot) const { return slot >= cell_pixels && !shades_ring_; }
  // The pixels around a cell.
  static std::array<int, 2> pixel_around(int i) {
    if (i < ring_size) return {i - 1, -1};
    if (i < 2 * ring_size) return {i - ring_size - 1, cell_size};
    if (i < 2 * ring_size + cell_size) return {-1, i - 2 * ring_size};
    return {cell_size, i - 2 * ring_size - cell_size};
  }

  // cell_baker.cpp
  bool find(int stage, bool past_pictures);
  static void clear_answer(ShadePoint& p);
  void intersect(int count, TraceContext& context);
  void trace(int count,
             bool coherent,
             RayKind kind,
             float cone_rad,
             LivePictures pictures = LivePictures::met);
  void set_camera_ray(int i, Vec3f v_cam);
  void turn_camera_rays(int count);
  void set_point(ShadePoint& p, int i, std::uint32_t pixel, std::uint32_t slot);
  void set_camera_cone(ShadePoint& p, int i, float pixels) const;
  void trace_centres();
  void shade_centres();
  template <class F>
  void for_each_shader(int count, F&& call);
  void shade_points(int count, bool grid);
  void run_background(std::span<ShadePoint* const> leaving);
  void receive(int count, bool grid);
  std::uint8_t part_of(const ShadePoint& p, float share) const;
  void clear_receivers();
  void set_receiver(std::size_t k, const ShadePoint& p);
  void add_centre(const ShadePoint& p);
  void collect(const ShadePoint& p);

  // cell_points.cpp
  std::uint16_t tint_of(Vec3f passed);
  void sort_tested(std::span<const std::uint16_t> point_of_receiver);
  void add_tested(std::span<const std::uint16_t> point_of_receiver);
  void add_shared(const ShadePoint& p, std::size_t centre);

  // cell_foreground.cpp
  bool may_see_pictures() const;
  void set_rays_of_all_pixels(const CellTransport::Blocks& in_picture);
  int meet_pictures(std::span<const float, cell_pixels> came_m,
                    std::span<const Vec3f, cell_pixels> left,
                    std::span<int, cell_pixels> ray_of_point);
  void see_foreground();
  bool is_behind_foreground(int x, int y) const;

  // cell_pictures.cpp
  void trace_all_pixels();
  void keep_far();
  void keep_distances();
  bool may_shade(const CellVisibility& visibility, const CellMask& receiving) const;
  void sort_tints(CellVisibility& visibility) const;
  Scene::Bounds box_around(const CellMask& receiving) const;
  void keep_shadowed(const CellMask& receiving,
                     std::vector<CellTransport::Shadowed>& shadowed) const;
  bool may_be_passed(Vec3f from, Vec3f direction, float far_m) const {
    return past_pictures_ && !shades_ring_ && frame_->stalls.are_passed(from, direction, far_m);
  }
  bool may_dim_lamp(Vec3f from, std::size_t lamp) const;
  void add_lamp_past_pictures(const ShadePoint& p,
                              std::size_t target,
                              std::size_t lamp,
                              Vec3f weight);
  void note_picture_shadow(const ShadePoint& p,
                           std::size_t receiver,
                           const PointLight& l,
                           Vec3f open);
  float share_of_sample(std::size_t slot) const;
  std::uint32_t index_of_sample(std::size_t slot) const {
    return is_further(slot) ? index_of_slot_[slot - cell_pixels] : 0;
  }
  float number_in_pixel(std::uint32_t pixel, std::uint32_t sample, std::uint32_t path) const;
  float number_of_light(const ShadePoint& p, std::size_t place) const;
  float chance_of_picture_ray(float share) const;
  std::uint16_t add_picture_ray(const QueuedRay& ray, float far_m);
  float part_of_light(const PointLight& l, Vec3f open) const;
  // How likely pictures are looked for in the way of a light, 0 where they cannot come into it; and
  // whether they are.
  struct MayDim {
    float chance = 0;
    bool looked_for = false;
  };
  // `part`: of the point's light, if there is other light as well.
  MayDim add_light_past_pictures(const ShadePoint& p,
                                 std::size_t target,
                                 Vec3f direction,
                                 std::size_t light,
                                 Vec3f weight,
                                 float part = 1);
  void add_tested_past_pictures(const ShadePoint& p, const PointLight& l, Vec3f weight, Vec3f open);
  void settle_picture_lights(std::size_t first);
  Vec3f direction_through(std::size_t pixel) const;
  bool pictures_may_part(std::size_t k) const;
  float hidden_from(const Met& met) const;
  bool centre_looks_apart(std::size_t pixel);
  std::uint16_t look_apart(
      const Further& f, Vec3f direction, float far_m, float width, std::uint16_t lender);
  void compare_with_centre(int index, const Further& f);
  bool hides_pictures(int index) const;
  float picture_end(int index, Vec3f from, Vec3f direction) const;
  void find_smooth_squares(const CellMask& receiving, CellTransport::Shadowed& centres) const;
  // cell_bounce.cpp
  void mark_passed(std::size_t count);
  void bounce();
  void meet_surroundings(const QueuedRay& ray, std::size_t stream_index);
  void meet_plate(const QueuedRay& ray, std::size_t stream_index);
  bool meets_plate(const QueuedRay& ray, std::size_t stream_index) const;
  unsigned mask_of(const QueuedRay& ray) const;
  static PlateView view_of(const QueuedRay& ray) {
    return {.sees = ray.sees,
            .roughness = ray.roughness,
            .spread = ray.spread,
            .one_of_many = ray.one_of_many,
            .mirrored = true};
  }
  float seen_past_plate(const ShadePoint& p, Vec3f direction, float far_m);

  // cell_cut_rays.cpp
  void note_cut_ray(const ShadePoint& from, Vec3f throughput, LookUp& sees, bool rough);
  void find_open_sky(int count, bool grid);
  void take_from_environment();
  void add_surroundings(std::size_t slot, std::size_t target, std::size_t pixel, Vec3f weight);

  // cell_mirrored.cpp
  void choose_first();
  bool may_be_lit_as_centres(const ShadePoint& p) const;
  CellMask find_mirrored(int count, std::span<const std::uint8_t> glossy);
  bool mirrors_smoothly(std::size_t first) const;
  void find_near_plate(std::size_t first, CellMask& found) const;
  static bool mirror_alike(const ShadePoint& a, const ShadePoint& b);
  void receive_mirrored(int count, std::span<const std::uint8_t> glossy);
  void light_mirrored(const CellMask& mirrored);
  void receive_lamps(std::span<const std::uint16_t> points);
  bool share_mirrored(std::size_t point);
  // Of what gather() asks for, by receiver, if shadow rays are counted.
  template <class PixelOf, class F>
  void count_shadow_rays(std::size_t receivers, PixelOf&& pixel_of, F&& gather) {
    std::array<std::uint32_t, cell_pixels> rays;
    if (counting_) {
      rays.fill(0);
      gather_.counts = rays.data();
    }
    gather();
    gather_.counts = nullptr;
    for (std::size_t k = 0; counting_ && k < receivers; ++k) {
      counting_[pixel_of(k)].shadow_rays += rays[k];
    }
  }

  // cell_lamps.cpp
  void add_centre_lamps(std::span<const std::uint16_t> receiver_of_point);
  void add_point_lamps(std::span<const std::uint16_t> point_of_receiver);
  void catch_lamps(const ShadePoint& p, std::size_t light_point, Vec3f irradiance);

  // cell_doubts.cpp
  Vec3f compact_at(std::size_t c, std::size_t centre) const;
  Vec3f lamp_at(std::size_t place, std::size_t centre) const;
  template <class OfLight, class OfLamp>
  void for_each_doubt(std::size_t a, std::size_t b, OfLight&& light, OfLamp&& lamp) const;
  bool lamp_shows(std::size_t place, std::size_t a, std::size_t b) const;
  std::array<Vec3f, 2> light_in_doubt(std::size_t a, std::size_t b) const;
  void find_doubts(std::size_t pixel, std::size_t centre);
  void settle_doubts(int count);
  void ask_again(const ShadePoint& p, std::size_t receiver, std::size_t centre, const Doubt& doubt);
  void flush_asked();
  void add_asked(const ShadePoint& p, const AskedAgain& asked);

  // cell_video.cpp
  template <class F>
  void for_each_place(const SeenVideo& seen, F&& call) const;
  void add_video(const ShadePoint& p);
  void paint(ShadePoint& p);
  PaintedSlot* painted_slot(const ShadePoint& p);
  void add_painted_centre(const ShadePoint& p);

  // cell_bent.cpp
  void leave_bent(
      std::size_t slot, std::size_t target, Vec3f direction, const Spread& spread, Vec3f weight);
  void find_plate(int count);
  void find_plate(std::optional<calibrate::Vec2> q, PlateView& view) const;
  calibrate::Vec3 from_camera(const ShadePoint& p) const;
  void add_bent(const ShadePoint& p, Vec3f weight, std::uint32_t shadow_point);
  void add_bent(const ShadePoint& p,
                Vec3f weight,
                std::uint32_t shadow_point,
                const PlateView& view);
  void add_plate(std::size_t slot,
                 std::size_t target,
                 const PlateView& view,
                 float width_rad,
                 Vec3f weight,
                 std::uint32_t shadow_point);

  // cell_pack.cpp
  void pack();
  void pack_bases();
  void pack_places();
  void join_shaded_places();
  void pack_live_places();

  // cell_lobes.cpp
  std::uint32_t sample_of(const ShadePoint& p) const;
  SampleSequence numbers_of(const ShadePoint& p, std::uint32_t number, std::uint32_t sample) const;
  bool turn_within_lobe(const ShadePoint& from, std::uint32_t number, NewRay& ray) const;
  std::uint32_t pixel_in_picture(const ShadePoint& p) const;
  bool note_lobe(const ShadePoint& from, const NewRay& asked, const NewRay& sent, bool one_of_many);
  void see_plate(const ShadePoint& from, Vec3f share);
  float chance_of(const ShadePoint& from, std::uint32_t path) const;
  void add_lobes(std::span<const std::uint16_t> receiver_of_point, bool grid);
  void find_compact_tints();
  Vec3f passed_to_lobe(const Lobe& lobe, std::size_t light, Vec3f passed);
  float share_straight_on(const Lobe& lobe, const DirectionalLight& light);
  void add_compact(const Lobe& lobe, std::size_t light, Vec3f passed);
  void mirror_compact(const Lobe& lobe, std::size_t light, Vec3f share);
  bool mirrors_lamps(const ShadePoint& from, const NewRay& ray) const;
  bool glows_by_lamps(const ShadePoint& p) const;
  void add_lamps_of_centre(const Lobe& lobe, std::size_t centre);
  void add_lamp(const Lobe& lobe, std::size_t number, Vec3f passed);
  LookUp& look_up(Vec3f direction, float roughness, const Spread& spread, bool diffused);
  Vec3f planned_radiance(LookUp& looked_up) const;
  bool compact_is_seen_in(const Lobe& lobe) const;
  float compact_density(const Lobe& lobe, std::size_t light) const;
  bool decides(std::size_t slot) const {
    return is_further(slot) ? compares_further_ : compares_centres_;
  }
  void add_places(std::size_t slot,
                  std::size_t target,
                  std::span<const MapSample> places,
                  Vec3f planned_radiance,
                  Vec3f weight);
  void add_environment(std::size_t slot,
                       std::size_t target,
                       Vec3f direction,
                       float roughness,
                       const Spread& spread,
                       bool one_of_many,
                       Vec3f weight);

  // cell_small_lights.cpp
  void mark_small_lights();

  // cell_edges.cpp
  Met met_at(int i) const;
  void keep_centres();
  void trace_ring();
  void shade_ring();
  bool mirrors_across(int i) const;
  void find_edges();
  void find_glints();
  float light_step(std::size_t a, std::size_t b) const;
  bool lit_unlike(std::size_t a, std::size_t b) const;
  void sample_edges();
  void blend_neighbours();
  void take_from_centre(std::size_t k, int dx, int dy, int times);
  void trace_further(int count);
  float share_of_cone() const;
  void finish_further(int count);
  bool bent_mirror(std::size_t k, const Met& here, const Met& there) const;
  int neighbour_of(int i, const Further& f) const;
  CellMask edges() const;
  CellMask uncertain(int n) const;
  void count_errors();
  Vec3f direction_in(int x, int y, const std::array<float, 2>& offset) const;
  bool takes_rays(std::size_t k) const { return edge_[k] != Edge::none && edge_[k] != Edge::blend; }
  void begin_further(std::size_t k);

  RayStream stream_;
  GatherWorkspace gather_;
  Receivers receivers_;
  std::array<ShadePoint, stream_rays> points_;
  std::array<Light, stream_rays> light_of_point_;
  std::array<ShadePoint*, stream_rays> group_;
  std::array<std::uint8_t, stream_rays> done_;
  std::array<std::uint8_t, stream_rays> lamps_apart_;    // of the rays that met the points
  std::array<std::uint8_t, stream_rays> sees_mirrored_;  // the same
  std::array<PlateView, stream_rays> plate_views_;       // of points that see the plate so
  std::array<std::uint8_t, stream_rays> is_first_;       // as QueuedRay::first, of the points
  std::array<std::uint16_t, cell_pixels> mirrored_at_;   // point that a centre mirrors, or nowhere
  // What centres mirror, where the transport has its light.
  struct MirroredHit {
    std::uint32_t instance, material;
    float reach_m;  // about as far apart as neighbours'
    Vec3f normal, position;
    Light light;
  };
  std::array<MirroredHit, cell_pixels> mirrored_hits_;
  std::array<std::uint8_t, stream_rays> shares_mirrored_;  // points that have their light so
  std::array<std::int16_t, stream_rays> lender_;  // pixel whose light a point shares, or -1
  std::vector<PointLight> tested_;
  std::array<std::uint32_t, cell_pixels> end_of_receiver_;  // in what follows
  std::vector<std::uint32_t> tested_by_receiver_;           // of those that catch shadows
  // By pixel, of the points at hand: what lights give that pictures may dim, and what that would be
  // by those that these are looked for in; how many these are likely to be.
  struct LookedFor {
    float gives = 0, would_be = 0, number = 0;
  };
  std::array<LookedFor, cell_pixels> looked_for_;
  std::vector<std::uint8_t> looked_for_by_;  // the pixels of the transport's last picture lights
  std::vector<PointLamp> reached_;
  std::vector<Doubt> doubts_;
  std::array<std::size_t, 2> doubtful_{};  // pixel and centre whose doubts these are
  std::vector<AskedAgain> asked_;
  LightTerms lights_, lamps_;
  EnvironmentPlaces places_;
  PlaceTerms bent_, video_, paint_;  // of slots; the last of painted ones
  std::vector<KeyedPlace> shaded_of_point_;
  std::vector<std::uint16_t> seen_elsewhere_;  // points; and where they are from the camera
  std::vector<calibrate::Vec3> places_elsewhere_;
  std::array<std::uint32_t, stream_rays> catcher_of_receiver_;
  std::array<std::uint32_t, stream_rays> bent_of_receiver_;  // shadow points of bent plate
  std::vector<Lobe> lobes_;
  std::vector<Vec3f> compact_shares_;  // (compact light, centre): what glass lets by; none = all
  std::vector<QueuedRay> queue_;       // capacity reserved
  std::vector<CutRay> cut_rays_;
  std::vector<MapSample> cut_places_;
  OpenLobes open_lobes_;  // of centres
  // The share of its light, but for compact lights, that nothing hides: of points, of centres.
  std::array<float, stream_rays> open_sky_;
  std::array<float, cell_pixels> open_sky_of_centre_;
  std::array<std::uint16_t, stream_rays> receiver_of_point_;  // or nowhere
  // Of centres' answers, what stands for surroundings; and that of a pixel's further samples, in
  // the light of its own centre.
  std::array<Vec3f, cell_pixels> grey_, grey_of_further_;
  std::array<Vec3f, cell_pixels> painted_diffuse_;  // of centres, planned_diffuse() times share
  std::array<PaintedOfPixel, cell_pixels> painted_of_pixel_;
  std::array<std::uint8_t, cell_pixels> painted_count_, painted_turn_;  // of each pixel's
  std::array<float, CellTransport::most_painted> painted_weights_;
  LookUp looked_up_{};                   // last, in this cell
  const ShadePoint* pushing_ = nullptr;  // who pushed last, and how many rays
  std::uint32_t pushed_ = 0;
  std::array<int, cell_pixels> sent_{};  // rays that surfaces have sent on, by pixel

  std::array<CameraSample, slots> samples_;  // centres, then further ones shaded on their own
  // Of all slots, those of picture rays too.
  std::array<CellTransport::Base, CellPicture::all_slots> base_;
  std::array<Light, cell_pixels> light_;  // at what the centres met
  MetCentres met_;
  std::array<Vec3f, slots> first_;          // of `added`, what the first surface gives
  std::array<Vec3f, slots> own_;            // and of that, means that it glows by
  std::array<Vec3f, around> mirrored_;      // of `added` at the pixels around, what it does not
  std::array<std::uint8_t, around> knows_;  // that
  std::array<std::uint8_t, stream_rays>
      answers_light_;    // points around, before they were made not to
  CellTransport aside_;  // of the pixels around: it tells nothing of the cell
  std::array<Edge, cell_pixels> edge_;
  CellMask mirrors_;  // centres whose surfaces sent rays on, or mirror lights
  FurtherSamples further_samples_;
  std::array<int, cell_pixels> least_samples_;            // that small lights ask for
  std::array<std::uint16_t, cell_pixels> index_of_slot_;  // of further samples, in the pattern
  int samples_each_ = 1;  // of the pixels that take further ones now
  std::array<std::array<std::uint16_t, 9>, cell_pixels> borrowed_;  // by neighbour, row by row
  std::array<Further, stream_rays> further_;

  // Of the cell at work.
  const FrameContext* frame_ = nullptr;
  Effort effort_;  // of its stage
  LightContext shadow_rays_;
  const SpaceGrid* grid_ = nullptr;  // if anything moves and cells are kept
  RenderStatistics* statistics_ = nullptr;
  CellTransport* transport_ = nullptr;
  Clock::time_point give_up_;
  RayCount* counting_ = nullptr;  // the transport's, by pixel, if they are asked for
  // Whether anything is decided by what samples see: centres', further ones'.
  bool compares_centres_ = false, compares_further_ = false;
  bool shades_ring_ = false;       // the pixels around, not further samples
  bool smooths_ = false;           // only edges of things take rays
  float blend_contrast_ = 0;       // 0 = neighbours are not blended
  bool cuts_glass_later_ = false;  // rays inside clear bodies are followed further than others
  int x0_ = 0, y0_ = 0;
  int block_ = 1;                // pixels a side that share a camera ray
  CellMask inside_{};            // pixels that have one
  bool sets_centres_ = false;    // receivers are centres', or what these mirror
  bool past_pictures_ = false;   // live pictures are passed; of this frame's, see `transport_`
  bool needs_pictures_ = false;  // ... which will not do: the cell is to be found with them
};

// Calls `call` with each shader and its points, in the order in which shaders first appear.
template <class F>
void CellBaker::for_each_shader(int count, F&& call) {
  const Scene& scene = *frame_->inputs.scene;
  std::fill_n(done_.begin(), count, std::uint8_t{0});
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    if (done_[i]) continue;
    const Shader& shader = scene.shader_of(points_[i].hit.material);
    std::size_t n = 0;
    for (std::size_t j = i; j < static_cast<std::size_t>(count); ++j) {
      if (done_[j] || &scene.shader_of(points_[j].hit.material) != &shader) continue;
      done_[j] = 1;
      group_[n++] = &points_[j];
    }
    call(shader, std::span<ShadePoint* const>(group_.data(), n));
  }
}

}  // namespace render
