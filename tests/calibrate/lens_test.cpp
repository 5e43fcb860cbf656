// Laws of lenses, and what they refuse.
#include "calibrate/lens.h"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>

#include "calibrate/angles.h"

namespace calibrate::lens_test {
namespace {

using std::numbers::pi;

// Lenses with the angle up to which each is defined.
struct Sample {
  Lens lens;
  double good_to_rad;
};

std::vector<Sample> samples() {
  const Lens pinhole{"pinhole", 1280, 720, {1100, 1105, 641.7, 357.2}};
  const Lens narrow{"pinhole", 1280, 720, {1100, 1105, 641.7, 357.2}, 30 * degree};
  const Lens fisheye{"equisolid", 2808, 1872, {622.4, 1412.5, 932.0}, 93 * degree};
  const Lens whole_sphere{"equisolid", 1024, 1024, {250, 511.5, 511.5}};
  const Lens kb2{"kannala_brandt", 1024, 1024, {331, 331, 513.3, 509.1, -.02, .003}, pi / 2};
  const Lens kb4{
      "kannala_brandt", 1024, 1024, {331, 330, 513.3, 509.1, -.0417, 5.2e-4, 1e-5, -1e-6}, 1.7};
  const Lens decentred{"decentred_kannala_brandt",
                       1024,
                       1024,
                       {331.3, 331, 513.3, 509.1, 2e-4, -3e-3, -.02, .003},
                       pi / 2};
  const Lens equidistant{"kannala_brandt", 640, 640, {200, 200, 319.5, 319.5}, pi};
  const Lens street{
      "LENSMODEL_OPENCV4", 768, 576, {1184.97, 1194.57, 324.222, 282.566, -.15662, .06178, 0, 0}};
  const Lens stereographic{"LENSMODEL_STEREOGRAPHIC", 1024, 1024, {300, 300, 511, 511}, 2.5};
  const Lens lonlat{"LENSMODEL_LONLAT", 1024, 512, {163, 163, 511.5, 255.5}};
  return {{pinhole, 80 * degree},       {narrow, 30 * degree}, {fisheye, 93 * degree},
          {whole_sphere, 179 * degree}, {kb2, pi / 2},         {kb4, 1.7},
          {equidistant, 3.1},           {street, 40 * degree}, {stereographic, 2.5},
          {lonlat, 85 * degree},        {decentred, pi / 2}};
}

Vec3 at_angle(double off_axis_rad, double around_rad) {
  return {std::sin(off_axis_rad) * std::cos(around_rad),
          std::sin(off_axis_rad) * std::sin(around_rad), std::cos(off_axis_rad)};
}

TEST(Project, IsUndoneByUnprojectAtEveryAngleThatTheLensSees) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform;
  for (const auto& [lens, good_to_rad] : samples()) {
    SCOPED_TRACE(lens.model);
    for (int i = 0; i < 300; ++i) {
      const Vec3 v_cam = at_angle(uniform(random) * good_to_rad, uniform(random) * 2 * pi);
      const auto q = project(lens, v_cam * (0.1 + uniform(random)));
      ASSERT_TRUE(q) << v_cam.x << " " << v_cam.y << " " << v_cam.z;
      const auto back = unproject(lens, *q);
      ASSERT_TRUE(back) << q->x << " " << q->y;
      EXPECT_LE(length(*back - v_cam), 1e-9);
      EXPECT_NEAR(length(*back), 1, 1e-12);
    }
  }
}

TEST(Unproject, IsUndoneByProjectAtEveryPixelOfThePictureThatTheLensSees) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform;
  for (const auto& [lens, good_to_rad] : samples()) {
    SCOPED_TRACE(lens.model);
    for (int i = 0; i < 300; ++i) {
      const Vec2 q{uniform(random) * lens.width - 0.5, uniform(random) * lens.height - 0.5};
      const auto v_cam = unproject(lens, q);
      if (!v_cam) continue;
      const auto back = project(lens, *v_cam);
      ASSERT_TRUE(back) << q.x << " " << q.y;
      EXPECT_LE(std::hypot(back->x - q.x, back->y - q.y), 1e-7);
    }
  }
}

TEST(Project, PutsTheAxisOnTheCentreForEveryModel) {
  for (const auto& [lens, good_to_rad] : samples()) {
    const std::size_t centre = lens.model == "equisolid" ? 1 : 2;
    const auto q = project(lens, {0, 0, 5});
    ASSERT_TRUE(q) << lens.model;
    EXPECT_NEAR(q->x, lens.parameters[centre], 1e-9) << lens.model;
    EXPECT_NEAR(q->y, lens.parameters[centre + 1], 1e-9) << lens.model;
  }
}

TEST(Project, FollowsTheFormulaOfEachOfOurModels) {
  const double t = 1.1;
  const Vec3 v_cam = at_angle(t, 0);
  const Lens equisolid{"equisolid", 640, 480, {200, 320, 240}};
  EXPECT_NEAR(project(equisolid, v_cam)->x, 320 + 2 * 200 * std::sin(t / 2), 1e-10);
  const Lens pinhole{"pinhole", 640, 480, {200, 210, 320, 240}};
  EXPECT_NEAR(project(pinhole, v_cam)->x, 320 + 200 * std::tan(t), 1e-10);
  const Lens kb{"kannala_brandt", 640, 480, {200, 200, 320, 240, -.03, .002}};
  EXPECT_NEAR(project(kb, v_cam)->x, 320 + 200 * t * (1 - .03 * t * t + .002 * t * t * t * t),
              1e-10);
}

TEST(Project, SeesNothingBehindAPinholeNorBeyondTheLargestAngle) {
  const Lens pinhole{"pinhole", 640, 480, {500, 500, 319.5, 239.5}};
  EXPECT_FALSE(project(pinhole, {0, 0, -1}));
  EXPECT_FALSE(project(pinhole, {1, 0, 0}));
  EXPECT_FALSE(project(pinhole, {}));
  EXPECT_FALSE(project(pinhole, {0, 0, std::numeric_limits<double>::infinity()}));
  const Lens fisheye{"equisolid", 2808, 1872, {622.4, 1412.5, 932.0}, 93 * degree};
  EXPECT_TRUE(project(fisheye, at_angle(92.9 * degree, 1)));
  EXPECT_FALSE(project(fisheye, at_angle(93.1 * degree, 1)));
  EXPECT_FALSE(unproject(fisheye, {1412.5 + 904, 932}));
  EXPECT_TRUE(unproject(fisheye, {1412.5 + 902, 932}));
}

TEST(ProjectAll, AnswersAsOneByOne) {
  for (const Lens& lens :
       {Lens{"equisolid", 640, 480, {200, 320, 240}, 100 * degree},
        Lens{"kannala_brandt", 640, 480, {200, 200, 320, 240, -.03}},
        Lens{"LENSMODEL_OPENCV4", 640, 480, {500, 500, 320, 240, -.1, .02, 0, 0}}}) {
    std::vector<Vec3> directions;
    std::vector<Vec2> pixels;
    for (const double angle_deg : {0.0, 0.001, 20.0, 60.0, 89.0, 91.0, 99.0, 170.0, 180.0}) {
      directions.push_back(at_angle(angle_deg * degree, angle_deg));
      pixels.push_back({320 + 2 * angle_deg, 240 - angle_deg});
    }
    const auto projected = project_all(lens, directions);
    const auto unprojected = unproject_all(lens, pixels);
    for (std::size_t i = 0; i < directions.size(); ++i) {
      const auto q = project(lens, directions[i]);
      ASSERT_EQ(projected[i].has_value(), q.has_value()) << lens.model << i;
      if (q) {
        EXPECT_EQ(*projected[i], *q);
      }
      const auto v = unproject(lens, pixels[i]);
      ASSERT_EQ(unprojected[i].has_value(), v.has_value()) << lens.model << i;
      if (v) {
        EXPECT_LT(length(*unprojected[i] - *v), 1e-9) << lens.model << i;
      }
    }
  }
}

TEST(Project, SeesNothingWhereTheDistortionTurnsBack) {
  // r = t (1 - .2 t^2) turns back at t = 1.291, at r = .8607.
  const Lens kb{"kannala_brandt", 640, 640, {300, 300, 319.5, 319.5, -.2}};
  EXPECT_TRUE(project(kb, at_angle(1.29, 0)));
  EXPECT_FALSE(project(kb, at_angle(1.30, 0)));
  EXPECT_FALSE(unproject(kb, {319.5 + 300 * .87, 319.5}));
  // r = x (1 - .3 x^2) turns back at x = 1.054, 46.5 degrees.
  const Lens opencv{"LENSMODEL_OPENCV4", 640, 640, {300, 300, 319.5, 319.5, -.3, 0, 0, 0}};
  EXPECT_TRUE(project(opencv, at_angle(46 * degree, 0)));
  EXPECT_FALSE(project(opencv, at_angle(48 * degree, 0)));
  EXPECT_FALSE(unproject(opencv, {319.5 + 300 * .8, 319.5}));
}

// The radius x (1 - .5 x^2) turns back at .816, 39 degrees off an axis of its own, and passes zero
// at 1.414, from where on the picture is turned by half.
TEST(Project, SeesNothingBeyondTheFoldOfCahvor) {
  const double alpha = 0.1;
  const Lens lens{"LENSMODEL_CAHVOR", 640, 640, {300, 300, 319.5, 319.5, alpha, 0, 0, -.5, 0}};
  const auto off_axis = [&](double angle) {
    return Vec3{std::sin(angle + alpha), 0, std::cos(angle + alpha)};
  };
  for (const double angle_deg : {0.0, 20.0, 38.0, -38.0}) {
    const auto q = project(lens, off_axis(angle_deg * degree));
    ASSERT_TRUE(q) << angle_deg;
    EXPECT_LT(length(unproject(lens, *q).value() - off_axis(angle_deg * degree)), 1e-6);
  }
  for (double angle_deg = 41; angle_deg < 83; ++angle_deg) {
    EXPECT_FALSE(project(lens, off_axis(angle_deg * degree))) << angle_deg;
    EXPECT_FALSE(project(lens, off_axis(-angle_deg * degree))) << angle_deg;
  }
}

// Fields of 120 degrees; rows reach as far as columns of the same size would.
TEST(Project, SeesNothingBeyondTheKnotsOfASpline) {
  for (const auto& [order, rows_reach] : {std::pair{2, 0.5}, std::pair{3, 0.4}}) {
    Lens lens{"LENSMODEL_SPLINED_STEREOGRAPHIC_order=" + std::to_string(order) +
                  "_Nx=8_Ny=5_fov_x_deg=120",
              1000,
              800,
              {300, 300, 499.5, 399.5}};
    lens.parameters.resize(4 + 2 * 8 * 5);
    // Beyond the last knots a bend of the edge grows without bounds, and folds the picture.
    std::mt19937 random(4);
    std::uniform_real_distribution<double> bend(-0.05, 0.05);
    for (std::size_t i = 4; i < lens.parameters.size(); ++i) lens.parameters[i] = bend(random);
    const double across = 60 * degree;
    const double down = 2 * std::atan(rows_reach * std::tan(across / 2));
    EXPECT_TRUE(project(lens, {std::sin(across - 0.01), 0, std::cos(across - 0.01)})) << order;
    EXPECT_FALSE(project(lens, {std::sin(across + 0.01), 0, std::cos(across + 0.01)})) << order;
    EXPECT_TRUE(project(lens, {0, std::sin(down - 0.01), std::cos(down - 0.01)})) << order;
    EXPECT_FALSE(project(lens, {0, std::sin(down + 0.01), std::cos(down + 0.01)})) << order;
    EXPECT_FALSE(project(lens, {0, 0, -1})) << order;
    for (int i = 0; i < 3000; ++i) {
      const Vec3 v = at_angle(i * 0.001, i);
      const auto q = project(lens, v);
      if (!q || q->x < -0.5 || q->y < -0.5 || q->x > 999.5 || q->y > 799.5) continue;
      const auto back = unproject(lens, *q);
      ASSERT_TRUE(back);
      EXPECT_LT(length(*back - v), 1e-5) << "seen twice";
    }
  }
}

TEST(Project, SeesNothingBeyondTheFirstFoldOfASpline) {
  constexpr std::size_t knots = 8;
  Lens lens{"LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=8_Ny=8_fov_x_deg=120",
            1000,
            800,
            {300, 300, 499.5, 399.5}};
  lens.parameters.resize(4 + 2 * knots * knots);
  // Bends one column of knots outward, so that the picture turns back behind it and then forth.
  for (std::size_t y = 0; y < knots; ++y) lens.parameters[4 + 2 * (y * knots + 4)] = 1;
  for (const bool many : {false, true}) {
    std::vector<Vec3> out;
    for (int i = 0; i < 200; ++i) {
      const double angle = 60 * degree * i / 200;
      out.push_back({std::sin(angle), 0.01 * std::sin(angle), std::cos(angle)});
    }
    std::vector<std::optional<Vec2>> seen = many ? project_all(lens, out) : decltype(seen)();
    for (std::size_t i = 0; !many && i < out.size(); ++i) seen.push_back(project(lens, out[i]));
    EXPECT_TRUE(seen[10]);
    const auto lost = std::find(seen.begin(), seen.end(), std::nullopt);
    EXPECT_LT(lost - seen.begin(), 150);
    EXPECT_EQ(std::count(lost, seen.end(), std::nullopt), seen.end() - lost) << many;
  }
}

TEST(Unproject, GivesNothingWhereMrcalGivesNotANumber) {
  const Lens lens{"LENSMODEL_OPENCV8",
                  4000,
                  2200,
                  {1761.181055, 1761.250444, 1965.706996, 1087.518797, -0.01266096516,
                   0.03590794372, -0.0002547045941, 0.0005275929652, 0.01968883397, 0.01482863541,
                   -0.0562239888, 0.0500223357}};
  for (const double far_px : {1e5, 1e7, 1e12}) {
    const auto v = unproject(lens, {far_px, -far_px});
    if (v) {
      EXPECT_NEAR(length(*v), 1, 1e-9);
      EXPECT_GT(v->z, 0);
    }
  }
  EXPECT_FALSE(unproject(lens, {std::numeric_limits<double>::quiet_NaN(), 0}));
}

TEST(Cropped, SeesTheSameDirectionsAtShiftedPixels) {
  for (const auto& [lens, good_to_rad] : samples()) {
    const Lens part = cropped(lens, 100, 50, 200, 100);
    const Vec3 v_cam = at_angle(0.2, 0.7);
    const auto q = project(lens, v_cam);
    const auto q_part = project(part, v_cam);
    ASSERT_TRUE(q && q_part) << lens.model;
    EXPECT_NEAR(q_part->x, q->x - 100, 1e-9) << lens.model;
    EXPECT_NEAR(q_part->y, q->y - 50, 1e-9) << lens.model;
    EXPECT_EQ(part.width, 200);
  }
}

TEST(Cropped, IsOffByNoMoreThanItsPicture) {
  Lens lens{"pinhole", 640, 480, {500, 500, 319.5, 239.5}};
  lens.error_px = 90;
  EXPECT_EQ(cropped(lens, 300, 200, 200, 100).error_px, 90);
  EXPECT_EQ(cropped(lens, 300, 200, 4, 3).error_px, 5);
}

TEST(Resized, KeepsPixelEdgesOnPixelEdges) {
  for (const auto& [lens, good_to_rad] : samples()) {
    const Lens half = resized(lens, lens.width / 2, lens.height / 2);
    const Vec3 v_cam = at_angle(0.2, 0.7);
    const auto q = project(lens, v_cam);
    const auto q_half = project(half, v_cam);
    ASSERT_TRUE(q && q_half) << lens.model;
    EXPECT_NEAR(q_half->x + 0.5, (q->x + 0.5) / 2, 1e-9) << lens.model;
    EXPECT_NEAR(q_half->y + 0.5, (q->y + 0.5) / 2, 1e-9) << lens.model;
  }
}

TEST(Resized, RefusesToSqueezeALensOfOneFocalLength) {
  const Lens lens{"equisolid", 2808, 1872, {622.4, 1412.5, 932.0}};
  EXPECT_THROW(resized(lens, 1404, 1872), std::invalid_argument);
}

TEST(Check, RefusesWhatIsNoLens) {
  const Lens good{"pinhole", 640, 480, {500, 500, 319.5, 239.5}};
  EXPECT_NO_THROW(check(good));
  const auto refuses = [&](auto change) {
    Lens bad = good;
    change(bad);
    EXPECT_THROW(check(bad), std::invalid_argument);
    EXPECT_THROW(project(bad, {0, 0, 1}), std::invalid_argument);
    EXPECT_THROW(make_direction_table(bad), std::invalid_argument);
  };
  refuses([](Lens& lens) { lens.model = "wide"; });
  refuses([](Lens& lens) { lens.parameters.pop_back(); });
  refuses([](Lens& lens) { lens.parameters[2] = std::numeric_limits<double>::quiet_NaN(); });
  refuses([](Lens& lens) { lens.parameters[0] = 0; });
  refuses([](Lens& lens) { lens.width = 0; });
  refuses([](Lens& lens) { lens.height = 100000; });
  refuses([](Lens& lens) { lens.max_angle_rad = 0; });
  refuses([](Lens& lens) { lens.max_angle_rad = 4; });
  // What would abort the program inside libmrcal, or make it read beyond the parameters.
  for (const char* model :
       {"LENSMODEL_CAHVORE_linearity=0.37", "LENSMODEL_CAHVORE", "LENSMODEL_OPENCV7",
        "LENSMODEL_SPLINED_STEREOGRAPHIC", "LENSMODEL_OPENCV8",
        "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=3_Ny=3_fov_x_deg=120",
        "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=4_Ny=4_fov_x_deg=120",
        "LENSMODEL_SPLINED_STEREOGRAPHIC_order=1_Nx=8_Ny=8_fov_x_deg=120",
        "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=65535_Ny=65535_fov_x_deg=120",
        "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=8_Ny=8_fov_x_deg=120_more"}) {
    refuses([model](Lens& lens) { lens.model = model; });
  }
}

TEST(Project, ShowsNothingBeyondTheFirstFold) {
  // Their polynomials turn back, and turn again farther out: ghosts, some inside the picture.
  const std::vector<Lens> lenses{
      {"LENSMODEL_OPENCV4", 640, 480, {530, 530, 319.5, 239.5, -.3, 0, 0, 0}},
      {"LENSMODEL_OPENCV4", 640, 480, {530, 530, 319.5, 239.5, -.28, .03, .002, -.001}},
      {"LENSMODEL_OPENCV5", 640, 480, {536, 536, 342, 235, -.265, -.0467, .0018, -.0003, .2522}},
      {"LENSMODEL_OPENCV8", 640, 480, {530, 530, 319.5, 239.5, -.3, .1, 0, 0, .01, .05, -.06, 0}},
  };
  for (const Lens& lens : lenses) {
    for (double azimuth = 0; azimuth < 6.28; azimuth += 0.0871) {
      bool ended = false;
      for (double angle = 0; angle < 1.56; angle += 0.004) {
        const Vec3 v{std::sin(angle) * std::cos(azimuth), std::sin(angle) * std::sin(azimuth),
                     std::cos(angle)};
        const auto q = project(lens, v);
        EXPECT_FALSE(q && ended) << lens.model << " at " << angle;
        ended = ended || !q;
        if (!q || q->x < 0 || q->y < 0 || q->x > 639 || q->y > 479) continue;
        const auto back = unproject(lens, *q);
        if (!back) continue;
        EXPECT_LT(length(*back - v), 1e-4) << lens.model << " at " << angle;
      }
    }
  }
}

}  // namespace
}  // namespace calibrate::lens_test
