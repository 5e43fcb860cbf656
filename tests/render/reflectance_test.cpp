// Reflectance of the standard surface, integrated: no more light leaves than arrives, sampling
// follows evaluation, and how far the model is from reciprocal.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "render/standard.h"

namespace render::reflectance_test {
namespace {

using std::numbers::pi;
constexpr Vec3f up{0, 0, 1};
constexpr std::array cosines{1.0F, 0.9F, 0.7F, 0.5F, 0.3F, 0.1F, 0.02F};
constexpr std::array roughnesses{mirror_roughness, 0.05F, 0.1F, 0.2F, 0.4F, 0.7F, 1.0F};

Vec3f view_at(float cosine) { return {std::sqrt(1 - cosine * cosine), 0, cosine}; }

// Rings about a direction, geometric up to a twentieth of a radian, so that the narrowest lobe
// there has many, then even. Each spoke takes its own place in the ring's width, so that what cuts
// rings apart, as the horizon does, is met in proportion. Calls add(direction, solid angle) for
// what is above the surface.
constexpr int narrow_rings = 200, rings = 500, spokes = 389;
double ring_radius(int ring) {
  constexpr double least = 1e-5, middle = 0.05;
  if (ring == 0) return 0;
  if (ring < narrow_rings)
    return least * std::pow(middle / least, static_cast<double>(ring) / narrow_rings);
  return middle + (pi - middle) * (ring - narrow_rings) / (rings - narrow_rings);
}
template <class F>
void over_hemisphere(Vec3f middle, F&& add) {
  const Vec3f side = std::abs(middle.z) < 0.9F ? up : Vec3f{1, 0, 0};
  const Vec3f x = normalize(cross(side, middle)), y = cross(middle, x);
  for (int j = 0; j < rings; ++j) {
    const double inner = std::cos(ring_radius(j)), outer = std::cos(ring_radius(j + 1));
    const double solid_angle = (inner - outer) * 2 * pi / spokes;
    for (int i = 0; i < spokes; ++i) {
      const double turn = 2 * pi * (i + std::fmod(0.618034 * j, 1.0)) / spokes;
      const double place = std::fmod(0.569840 * i + 0.754878 * j, 1.0);
      const double along = inner + (outer - inner) * place;
      const double across = std::sqrt((1 - along) * (1 + along));
      const Vec3f l = middle * static_cast<float>(along) +
                      x * static_cast<float>(across * std::cos(turn)) +
                      y * static_cast<float>(across * std::sin(turn));
      if (l.z > 0) add(l, solid_angle);
    }
  }
}

double whole_of_lobe(float roughness, Vec3f view) {
  const SeenLobe lobe(up, up, view);
  double sum = 0;
  over_hemisphere(mirrored(view, up), [&](Vec3f l, double solid_angle) {
    sum += lobe.density(roughness * roughness, l) * solid_angle;
  });
  return sum;
}

TEST(LobeDensity, IntegratesToOneAtEveryRoughnessAndAngle) {
  for (const float roughness : roughnesses) {
    for (const float cosine : cosines) {
      EXPECT_NEAR(whole_of_lobe(roughness, view_at(cosine)), 1, 2e-3)
          << "roughness " << roughness << ", cosine " << cosine;
    }
  }
}

// Pearson's test over 8 rings and 4 quarters about the mirrored direction.
TEST(SampleLobe, ChoosesDirectionsAsOftenAsTheirDensitySays) {
  constexpr int bins = 32, count = 20000;
  std::mt19937 engine(4);
  std::uniform_real_distribution<float> random(0, 1);
  for (const float roughness : roughnesses) {
    for (const float cosine : {1.0F, 0.7F, 0.3F, 0.1F}) {
      const Vec3f view = view_at(cosine), middle = mirrored(view, up);
      const auto bin_of = [&](Vec3f l) {
        const Vec3f off = l - middle;  // |off| is the chord: its bins grow with the lobe
        const double width = length(off) / (roughness * roughness);
        const int ring = std::clamp(static_cast<int>(std::lround(2 * std::log2(width)) + 2), 0, 7);
        return ring * 4 + (off.y > 0 ? 2 : 0) + (off.x * cosine - off.z * view.x > 0 ? 1 : 0);
      };
      std::array<double, bins> expected{}, seen{};
      const SeenLobe lobe(up, up, view);
      over_hemisphere(middle, [&](Vec3f l, double solid_angle) {
        expected[static_cast<std::size_t>(bin_of(l))] +=
            count * lobe.density(roughness * roughness, l) * solid_angle;
      });
      for (int i = 0; i < count; ++i) {
        const Vec3f l = sample_lobe(up, view, roughness, {random(engine), random(engine)});
        ++seen[static_cast<std::size_t>(bin_of(l))];
      }
      double squares = 0;
      int judged = 0;
      for (std::size_t i = 0; i < bins; ++i) {
        if (expected[i] < 25) continue;
        ++judged;
        // Bins cut the quadrature's cells: a hundredth of what they hold is not known.
        const double known = expected[i] + std::pow(0.01 * expected[i], 2);
        squares += std::pow(seen[i] - expected[i], 2) / known;
      }
      EXPECT_GT(judged, 7);
      EXPECT_LT(squares, judged + 5 * std::sqrt(2.0 * judged))
          << "roughness " << roughness << ", cosine " << cosine;
    }
  }
}

// Light that leaves towards the view under an even sky of 1, and with it, by turning the light
// around, the share of a beam from there that leaves to anywhere.
Vec3f albedo(const StandardSurface& surface, Vec3f view, double coat_lobe, double specular_lobe) {
  const StandardWeights w = standard_weights(surface, view);
  const auto coat = static_cast<float>(w.coat * coat_lobe);
  return Vec3f{coat, coat, coat} + w.specular * static_cast<float>(specular_lobe) + w.diffuse +
         w.transmission;
}

TEST(StandardSurface, SendsOnAllLightWhereItIsWhiteAndNeverMore) {
  for (const float roughness : roughnesses) {
    for (const float cosine : cosines) {
      const Vec3f view = view_at(cosine);
      const double lobe = whole_of_lobe(roughness, view);
      for (const float metallic : {0.0F, 0.5F, 1.0F}) {
        for (const float coat : {0.0F, 0.5F, 1.0F}) {
          for (const float specular : {0.0F, 1.0F}) {
            for (const auto& [transmission, opacity] :
                 {std::pair(0.0F, 1.0F), {0.5F, 1.0F}, {1.0F, 1.0F}, {0.0F, 0.25F}, {0.5F, 0.5F}}) {
              StandardSurface surface{};
              surface.normal = surface.coat_normal = up;
              surface.metallic = metallic;
              surface.clearcoat = coat;
              surface.specular = specular;
              surface.transmission = transmission;
              surface.opacity = opacity;
              surface.base = {1, 0.5F, 0};
              // The coat's own lobe: a mirror, or as rough as the ground.
              for (const double coat_lobe : {1.0, lobe}) {
                const Vec3f a = albedo(surface, view, coat_lobe, lobe);
                EXPECT_NEAR(a.x, 1, 2e-3) << roughness << " " << cosine;
                EXPECT_LE(a.y, 1 + 2e-3);
                EXPECT_LE(a.y, a.x);
                EXPECT_LE(a.z, a.y);
                EXPECT_GE(a.z, 0);
              }
            }
          }
        }
      }
    }
  }
}

// The BRDF between two directions above the surface; mirrors and what goes straight through apart.
double brdf(const StandardSurface& surface, Vec3f view, Vec3f light) {
  const StandardWeights w = standard_weights(surface, view);
  double value = w.diffuse.x / pi;
  if (w.specular.x > 0 && surface.roughness >= mirror_roughness)
    value += w.specular.x * lobe_density(up, view, surface.roughness, light) / light.z;
  if (w.coat > 0 && surface.clearcoat_roughness >= mirror_roughness)
    value += w.coat * lobe_density(up, view, surface.clearcoat_roughness, light) / light.z;
  return value;
}

// How much of the light between all pairs of directions goes one way only: the integral of |f(a, b)
// - f(b, a)| over that of f(a, b) + f(b, a), both by projected solid angle. 0 = reciprocal.
double one_way_share(const StandardSurface& surface) {
  std::mt19937 engine(8);
  std::uniform_real_distribution<double> random(0, 1);
  const auto direction = [&] {
    const double square = random(engine), turn = 2 * pi * random(engine), r = std::sqrt(square);
    return Vec3f{static_cast<float>(r * std::cos(turn)), static_cast<float>(r * std::sin(turn)),
                 static_cast<float>(std::sqrt(1 - square))};
  };
  double differences = 0, sums = 0;
  for (int i = 0; i < 200000; ++i) {
    const Vec3f a = direction(), b = direction();
    if (a.z < 0.01F || b.z < 0.01F) continue;
    const double there = brdf(surface, a, b), back = brdf(surface, b, a);
    differences += std::abs(there - back);
    sums += there + back;
  }
  return differences / sums;
}

StandardSurface made_surface(float base, float metallic, float specular, float roughness) {
  StandardSurface surface{};
  surface.normal = surface.coat_normal = up;
  surface.base = {base, base, base};
  surface.metallic = metallic;
  surface.specular = specular;
  surface.roughness = roughness;
  return surface;
}

TEST(StandardSurface, IsReciprocalWhereMatteOrAMirrorOrAThinWall) {
  std::mt19937 engine(6);
  std::uniform_real_distribution<float> random(0.02F, 1);
  EXPECT_EQ(one_way_share(made_surface(0.7F, 0, 0, 1)), 0);
  for (int trial = 0; trial < 200; ++trial) {
    // A mirror's and a thin wall's two directions make one angle with the normal.
    StandardSurface surface = made_surface(random(engine), random(engine), random(engine), 0);
    surface.clearcoat = random(engine);
    surface.transmission = random(engine);
    surface.opacity = random(engine);
    const Vec3f view = view_at(random(engine));
    const StandardWeights there = standard_weights(surface, view);
    for (const Vec3f other : {mirrored(view, up), -view}) {
      const StandardWeights back = standard_weights(surface, other);
      EXPECT_EQ(there.coat, back.coat);
      EXPECT_EQ(there.specular, back.specular);
      EXPECT_EQ(there.transmission, back.transmission);
    }
  }
}

// Elsewhere it is not: Fresnel's shares are the view's alone, and lobes are not masked towards the
// light, so that a white furnace stays white. The bounds are those of verification.md.
TEST(StandardSurface, IsNotReciprocalElsewhereByNoMoreThanStated) {
  struct Case {
    std::string name;
    StandardSurface surface;
    double most;
  };
  StandardSurface paint = made_surface(0.5F, 0, 1, 0.45F);
  paint.clearcoat = 1;
  StandardSurface satin = paint;
  satin.clearcoat_roughness = 0.3F;
  const std::vector<Case> cases{{"dull dielectric", made_surface(0.5F, 0, 1, 1), 0.055},
                                {"plastic", made_surface(0.5F, 0, 1, 0.4F), 0.055},
                                {"coated paint", paint, 0.07},
                                {"satin coat", satin, 0.08},
                                {"smooth metal", made_surface(0.9F, 1, 1, 0.2F), 0.005},
                                {"satin metal", made_surface(0.9F, 1, 1, 0.4F), 0.05},
                                {"rough metal", made_surface(0.9F, 1, 1, 0.7F), 0.26},
                                {"dull metal", made_surface(0.9F, 1, 1, 1), 0.54}};
  for (const auto& [name, surface, most] : cases) {
    const double share = one_way_share(surface);
    EXPECT_LE(share, most) << name;
    EXPECT_GE(share, 0.5 * most) << name << ": state the smaller bound";
  }
}

}  // namespace
}  // namespace render::reflectance_test
