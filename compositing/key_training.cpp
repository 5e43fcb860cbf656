// Learning from made clips.
#include "compositing/key_training.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>
#include <vector>

#include "capture/parallel_loop.h"
#include "compositing/clean_plate.h"
#include "compositing/made_clip.h"

namespace compositing {
namespace {

constexpr std::array<int, 2> frames_of_a_clip{8, 25};
constexpr float prior_pixels = 4;  // how many pixels the plain ratio counts for
// ... and what was learned of all pixels, for those near the screen or far from it.
constexpr double prior_of_all = 8;
constexpr double share_of_any = 0.3;  // of a pixel whose person wears any colours
// For how many a pixel counts in which there is both person and screen: few are, and all that is
// seen of edges. Composite and alpha over all scenes are best at 2, edges and fur at more (1 to 8
// were tried).
constexpr double mixed_pixels = 2;
// Furs differ more from each other than anything else: persons in fur for each seed, and for how
// many pixels each of theirs counts.
constexpr std::uint32_t persons_in_fur = 6;
constexpr double share_of_fur = 1.5;
// Persons in clothes with some of the screen's colour teach what lies deep within persons: near the
// screen the edges of others, brighter against it, look the same. Each before the screen in another
// light, so that clothes are brighter and darker against it.
constexpr double share_of_cloth = 0.1;
constexpr std::array<float, 3> lights_for_cloth{0.6F, 1, 1.5F};
constexpr std::array<std::string_view, 8> scenes_for_cloth{"plain", "uneven", "shadow", "spill",
                                                           "blond", "4:2:0",  "noise",  "studio"};

// What would have to be brighter than white before a screen of common light, or than colourful
// cloth, if so much of the screen shone through, is more of the person than that, and all of it
// from some brightness on: what pulls where hardly any pixel has been seen. nullopt: the plain
// ratio.
std::optional<double> alpha_of_bright(int k, int l, int h) {
  constexpr double white = 5.7, less_of_hue = 0.5, least = 0.2, whole = 1.3;
  const double share = least_table_share + double{table_share_range} * k / (table_shares - 1);
  const double part = l / static_cast<double>(table_light_scale);
  const double light = table_half_light * part / (1 - part) - 0.05;
  const double hue = std::abs(2 * h / (table_hues - 1.0) - 1);
  if (share <= 0.05 || light <= least) return std::nullopt;
  if (light <= white * (1 - less_of_hue * hue) * std::max(1 - share, 0.02)) return std::nullopt;
  return std::min(std::max(1 - share, light / whole), 1.0);
}

class Learner {
 public:
  Learner() : sums_(places * 4) {}

  void add(const TablePlace<float>& place, float share, float alpha, float plate, double pixels) {
    const int k = std::min(static_cast<int>(place.share), table_shares - 2);
    const int l = std::min(static_cast<int>(place.light), table_lights - 2);
    const int h = std::min(static_cast<int>(place.hue), table_hues - 2);
    const float u = place.share - static_cast<float>(k), v = place.light - static_cast<float>(l);
    const float w = place.hue - static_cast<float>(h);
    for (int corner = 0; corner < 8; ++corner) {
      const bool a = corner & 1, b = corner & 2, c = corner & 4;
      const double weight = pixels * (a ? u : 1 - u) * (b ? v : 1 - v) * (c ? w : 1 - w);
      double* to = &sums_[4 * index(k + a, l + b, h + c)];
      to[0] += weight;
      to[1] += weight * alpha;
      to[2] += weight * plate;
      to[3] += weight * share;
    }
  }

  void add(const Learner& other) {
    for (std::size_t i = 0; i < sums_.size(); ++i) sums_[i] += other.sums_[i];
  }

  // Up to so small a share of the screen, what is brighter than this is one place: cloth and fur of
  // all lights, for finer ones would tell made persons apart.
  void pool_bright() {
    constexpr int shares = 9, first = 16;  // a share of .125, a brightness of 1.2
    for (int h = 0; h < table_hues; ++h) {
      for (int k = 0; k < shares; ++k) {
        for (std::size_t of = 0; of < 4; ++of) {
          double sum = 0;
          for (int l = first; l < table_lights; ++l) sum += sums_[4 * index(k, l, h) + of];
          for (int l = first; l < table_lights; ++l) sums_[4 * index(k, l, h) + of] = sum;
        }
      }
    }
  }

  using Values = std::vector<std::array<double, 2>>;  // alpha and plate

  // What no pixel has shown is as its neighbours are.
  Values values() const {
    Values values(places);
    std::vector<char> known(places);
    for (int i = 0; i < static_cast<int>(places); ++i) {
      const double* sum = &sums_[4 * static_cast<std::size_t>(i)];
      const int l = i % table_lights, k = i / table_lights % table_shares;
      const auto bright = alpha_of_bright(k, l, i / (table_lights * table_shares));
      if (sum[0] <= 0 && !bright) continue;
      const double plain = bright ? 1 - *bright : std::clamp(sum[3] / sum[0], 0.0, 1.0);
      values[static_cast<std::size_t>(i)] = {
          (sum[1] + prior_pixels * (1 - plain)) / (sum[0] + prior_pixels),
          (sum[2] + prior_pixels * plain) / (sum[0] + prior_pixels)};
      known[static_cast<std::size_t>(i)] = 1;
    }
    while (std::count(known.begin(), known.end(), 0) > 0) spread(values, known);
    return values;
  }

  // What few pixels have shown is as all of them have it.
  PlaceCodes codes(const Values& of_all) const {
    PlaceCodes codes{};
    for (int h = 0; h < table_hues; ++h) {
      for (int k = 0; k < table_shares; ++k) {
        for (int l = 0; l < table_lights; ++l) {
          for (std::size_t of = 0; of < 2; ++of) {
            const double* sum = &sums_[4 * index(k, l, h)];
            const double value =
                (sum[1 + of] + prior_of_all * of_all[index(k, l, h)][of]) / (sum[0] + prior_of_all);
            codes[code_at(k, l, h) + of] =
                static_cast<std::uint8_t>(std::lround(255 * std::clamp(value, 0.0, 1.0)));
          }
        }
      }
    }
    return codes;
  }

 private:
  static constexpr std::size_t places =
      static_cast<std::size_t>(table_shares) * table_lights * table_hues;
  static std::size_t index(int k, int l, int h) { return code_at(k, l, h) / 2; }

  static void spread(Values& values, std::vector<char>& known) {
    const auto before = values;
    const auto knew = known;
    for (int h = 0; h < table_hues; ++h) {
      for (int k = 0; k < table_shares; ++k) {
        for (int l = 0; l < table_lights; ++l) {
          if (knew[index(k, l, h)]) continue;
          double count = 0;
          std::array<double, 2> sum{};
          const auto take = [&](int kk, int ll, int hh) {
            if (kk < 0 || ll < 0 || hh < 0 || kk >= table_shares || ll >= table_lights ||
                hh >= table_hues || !knew[index(kk, ll, hh)]) {
              return;
            }
            count += 1;
            for (std::size_t of = 0; of < 2; ++of) sum[of] += before[index(kk, ll, hh)][of];
          };
          // Along light and hue first: the share says most.
          take(k, l - 1, h), take(k, l + 1, h), take(k, l, h - 1), take(k, l, h + 1);
          if (count <= 0) take(k - 1, l, h), take(k + 1, l, h);
          if (count <= 0) continue;
          for (std::size_t of = 0; of < 2; ++of) values[index(k, l, h)][of] = sum[of] / count;
          known[index(k, l, h)] = 1;
        }
      }
    }
  }

  std::vector<double> sums_;  // weight, and weighted alpha, plate, share
};

struct Learners {
  Learner all, near, deep;
};

// What the pixels of a clip teach, and for how many each counts.
struct Lesson {
  double pixels;
  bool deep_only = false;
};

void learn_frame(const MadeFrame& made,
                 const Lesson& lesson,
                 PlateLight& light,
                 Learners& learners) {
  const capture::Image seen = light_of(made.seen);
  light.update(seen, true);
  const LitPlate& lit = light.lit();
  const auto order = channels_of(lit.colour);
  for (int y = 0; y < seen.height; ++y) {
    for (int x = 0; x < seen.width; ++x) {
      const std::array<float, 4> p = plate_at(lit, y, x);
      if (p[3] <= 0) continue;
      const auto c = [&](std::size_t i) { return seen.at(y, x, order[i]); };
      double dot = 0, square = 0;
      for (std::size_t i = 0; i < 3; ++i) {
        dot += (c(i) - made.truth.at(y, x, order[i])) * p[i];
        square += p[i] * p[i];
      }
      const float share = screen_excess<false>(c(0), c(1), c(2)) * p[3];
      const auto rest = [&](std::size_t i) { return (c(i) - share * p[i]) * p[3]; };
      const float alpha = made.truth.at(y, x, 3);
      const bool mixed = alpha > 0.02F && alpha < 0.98F;
      const double weight = mixed ? mixed_pixels * lesson.pixels : lesson.pixels;
      const float near = lit.near.at(y, x);
      const auto learn = [&](Learner& learner, double part) {
        if (part <= 0) return;
        learner.add(place_in_table(share, rest(1), rest(2)), share, alpha,
                    static_cast<float>(dot / square), part * weight);
      };
      if (!lesson.deep_only) learn(learners.all, 1), learn(learners.near, near);
      learn(learners.deep, 1 - near);
    }
  }
}

void learn_clip(const MadeClip& clip, const Lesson& lesson, Learners& learners) {
  std::vector<capture::Image> shots;
  for (int i = 0; i < 8; ++i) shots.push_back(light_of(clip.plate_shot(i)));
  PlateLight light(average_plate(shots));
  for (const int frame : frames_of_a_clip) learn_frame(clip.frame(frame), lesson, light, learners);
}

void learn_seed(std::uint32_t seed, bool any_colours, Learners& learners) {
  for (MadeScene scene : made_scenes()) {
    if (has_two_primaries(screen_colour_of(scene.screen))) continue;  // uses what others teach
    const bool in_fur = scene.actor.fur > 0;
    scene.actor.any_colours = any_colours && !in_fur;
    const double pixels = in_fur ? share_of_fur : scene.actor.any_colours ? share_of_any : 1;
    std::uint32_t person = 0;
    for (; person < (in_fur ? persons_in_fur : 1); ++person) {
      learn_clip(MadeClip(scene, seed + 1000 * person), {pixels}, learners);
    }
    if (std::ranges::find(scenes_for_cloth, scene.name) == scenes_for_cloth.end()) continue;
    scene.actor.green_clothes = true;
    const float lamps = scene.light;
    for (const float light : lights_for_cloth) {
      scene.light = light * lamps;
      learn_clip(MadeClip(scene, seed + 1000 * (9 + person++)), {share_of_cloth, true}, learners);
    }
  }
}

}  // namespace

TableCodes train_key_table(std::span<const std::uint32_t> seeds) {
  std::vector<Learners> of_seeds(seeds.size());
  capture::parallel_for(std::size_t{0}, seeds.size(),
                        [&](std::size_t i) { learn_seed(seeds[i], i % 2 == 1, of_seeds[i]); });
  Learners learners;
  for (const Learners& of_seed : of_seeds) {
    learners.all.add(of_seed.all);
    learners.near.add(of_seed.near);
    learners.deep.add(of_seed.deep);
  }
  for (Learner* learner : {&learners.all, &learners.near, &learners.deep}) learner->pool_bright();
  const Learner::Values of_all = learners.all.values();
  return {learners.near.codes(of_all), learners.deep.codes(of_all)};
}

}  // namespace compositing
