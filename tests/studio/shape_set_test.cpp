// Sets whose objects deform, with a file for each shape.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <future>
#include <optional>
#include <string>
#include <vector>

#include "capture/sandbox.h"
#include "studio/shape_feed.h"
#include "studio/show.h"
#include "tests/studio/made_show.h"

namespace studio::shape_set_test {
namespace {

using namespace std::chrono_literals;
using testing::AllOf, testing::Contains, testing::ElementsAre, testing::HasSubstr, testing::IsEmpty,
    testing::Not, testing::SizeIs;

constexpr capture::Rational pal{25, 1};

// The number of the shape that a scene's flag has: see ShapeSetTest::write_shape.
int number_in(const render::SceneDescription& scene) {
  int number = -1;
  for (const auto& mesh : scene.meshes) {
    if (mesh->rest == nullptr) continue;
    const int found = static_cast<int>(std::lround(10 * mesh->positions[0].z));
    EXPECT_TRUE(number == -1 || number == found) << "two shapes in one frame";
    number = found;
  }
  return number;
}

std::vector<int> numbers_of(Show& show) {
  std::vector<int> numbers;
  show.run([&](const ShownFrame& shown) {
    numbers.push_back(number_in(shown.prepared.scene->description()));
  });
  return numbers;
}

class ShapeSetTest : public MadeShowTest {
 protected:
  void SetUp() override {
    MadeShowTest::SetUp();
    for (int number = 0; number < 6; ++number) write_shape(number);
  }

  std::filesystem::path file_of(int number) const {
    return dir_ / ("flag_" + std::to_string(number) + ".obj");
  }

  // Shape n is a flag bent at its middle, n x 10 cm above the ground.
  void write_shape(int number) const {
    const double z = number / 10.0, bent = 0.3 * std::sin(number + 1.0);
    std::ofstream file(file_of(number));
    for (const double x : {0.0, 0.7, 1.4}) {
      for (const double up : {0.0, 1.0}) {
        file << "v " << x + 1 << " " << z + up << " " << (x == 0.7 ? bent : 0) + 1.5 << "\n";
      }
    }
    file << "f 1 3 4 2\nf 3 5 6 4\n";
  }

  Set flag_set(const std::string& keys, const std::string& plate = "grey:1,25,0") const {
    return made_set(plate, "[[object]]\nname = \"flag\"\nmesh = \"flag_%d.obj\"\n" + keys);
  }

  static ShowOptions frames(std::int64_t count) {
    ShowOptions options;
    options.frames = count;
    return options;
  }
};

// In the place of the models' reader, one that waits until it may go on: each time, or after so
// many once.
class Gate {
 public:
  explicit Gate(const std::filesystem::path& dir, std::optional<int> once_after = std::nullopt)
      : open_(dir / "open") {
    const std::filesystem::path helpers = dir / "helpers";
    std::filesystem::create_directory(helpers);
    std::filesystem::create_symlink(capture::helper_path("platelight-decode"),
                                    helpers / "platelight-decode");
    const std::string reader = "exec " + capture::helper_path("platelight-model") + " \"$@\"\n";
    std::ofstream script(helpers / "platelight-model");
    script << "#!/bin/sh\n";
    const auto first_to_make = [&](int n) {
      return "mkdir " + (dir / ("call_" + std::to_string(n))).string() + " 2>&-";
    };
    for (int n = 0; n < once_after.value_or(0); ++n) {
      script << first_to_make(n) << " && " << reader;
    }
    if (once_after) script << first_to_make(*once_after) << " || " << reader;
    script << "while [ ! -e " << open_.string() << " ]; do sleep 0.01; done\n" << reader;
    script.close();
    std::filesystem::permissions(helpers / "platelight-model", std::filesystem::perms::owner_all);
    setenv("PLATELIGHT_HELPERS", helpers.c_str(), 1);
  }
  ~Gate() {
    open();
    unsetenv("PLATELIGHT_HELPERS");
  }
  Gate(const Gate&) = delete;
  Gate& operator=(const Gate&) = delete;
  void open() const { std::ofstream(open_) << "now"; }

 private:
  std::filesystem::path open_;
};

TEST_F(ShapeSetTest, NamesItsFilesFromTheFirstToTheLastNumberAlsoThoseThatAreNotThere) {
  std::filesystem::remove(file_of(3));
  const Set set = flag_set("fps = \"25/2\"\nloop = true\nfirst = 2\n");
  const ObjectSettings& flag = set.objects.back();
  ASSERT_TRUE(flag.shapes);
  EXPECT_THAT(flag.shapes->files, ElementsAre(file_of(2).string(), file_of(3).string(),
                                              file_of(4).string(), file_of(5).string()));
  EXPECT_EQ(flag.mesh, file_of(2).string());
  EXPECT_EQ(flag.shapes->fps, (capture::Rational{25, 2}));
  EXPECT_TRUE(flag.shapes->loop);
  EXPECT_FALSE(set.objects.front().shapes);
}

TEST_F(ShapeSetTest, ShowsTheShapeOfEachFramesTimeAndThenItsLast) {
  Show own(flag_set(""), frames(8));
  EXPECT_THAT(numbers_of(own), ElementsAre(0, 1, 2, 3, 4, 5, 5, 5));
  EXPECT_EQ(own.status()->held_shapes, 0);
  EXPECT_THAT(own.status()->notes, IsEmpty());
  Show slow(flag_set("fps = \"25/2\"\n"), frames(5));
  EXPECT_THAT(numbers_of(slow), ElementsAre(0, 0, 1, 1, 2));
  Show fast(flag_set("fps = 50\nfirst = 1\n"), frames(4));
  EXPECT_THAT(numbers_of(fast), ElementsAre(1, 3, 5, 5));
}

TEST_F(ShapeSetTest, BeginsAgainWhereItLoops) {
  Show show(flag_set("loop = true\nfirst = 3\n"), frames(8));
  EXPECT_THAT(numbers_of(show), ElementsAre(3, 4, 5, 3, 4, 5, 3, 4));
}

TEST_F(ShapeSetTest, KeepsTheLastGoodShapeOverBadFilesAndSaysSoOnce) {
  std::ofstream(file_of(2)) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  std::filesystem::remove(file_of(3));
  Show show(flag_set("loop = true\n"), frames(12));
  EXPECT_THAT(numbers_of(show), ElementsAre(0, 1, 1, 1, 4, 5, 0, 1, 1, 1, 4, 5));
  EXPECT_EQ(show.status()->held_shapes, 4);
  const std::vector<std::string> notes = show.status()->notes;
  EXPECT_THAT(notes, SizeIs(3)) << "the file that is missing at the start, and each when it is due";
  EXPECT_THAT(notes, Contains(AllOf(HasSubstr("object flag"), HasSubstr("1 of its 6 shapes"),
                                    HasSubstr(file_of(3).string()))));
  EXPECT_THAT(notes, Contains(AllOf(HasSubstr("object flag"), HasSubstr(file_of(2).string()),
                                    HasSubstr("has 1 triangles, but in the first file 4"),
                                    HasSubstr("the shape that it has stays"))));
}

TEST_F(ShapeSetTest, RefusesAFirstShapeThatIsBadAtItsPlaceAndChecksTheOthers) {
  std::ofstream(file_of(2)) << "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  const std::vector<ModelReport> reports = check_models(flag_set(""));
  ASSERT_EQ(reports.size(), 2U);
  EXPECT_EQ(reports[1].report.triangles, 4U);
  EXPECT_THAT(reports[1].report.notes, Contains(HasSubstr(file_of(2).string())));
  EXPECT_THAT(reports[1].report.notes, Not(Contains(HasSubstr(file_of(3).string()))));
  try {
    describe_scene(flag_set("first = 2\n"));
    FAIL() << "was accepted";
  } catch (const SetError& error) {
    ASSERT_EQ(error.diagnostics().size(), 1U);
    EXPECT_GT(error.diagnostics()[0].line, 0);
    EXPECT_THAT(error.what(), AllOf(HasSubstr(file_of(2).string()), HasSubstr("not finite")));
  }
}

TEST_F(ShapeSetTest, RefusesAFirstNumberThatNoFileHas) {
  EXPECT_THROW(flag_set("first = 6\n"), SetError);
  EXPECT_THROW(flag_set("first = -1\n"), SetError);
  EXPECT_THROW(flag_set("fps = 0\n"), SetError);
}

// Warm: frame n of a show that has gone on; cold: the first of one that begins with its shape.
TEST_F(ShapeSetTest, HasTheBitsOfAShowThatBeginsWithTheShape) {
  std::vector<std::vector<capture::Half>> warm;
  Show show(flag_set(""), frames(4));
  show.run([&](const ShownFrame& shown) { warm.push_back(shown.result->rgba.pixels); });
  ASSERT_EQ(warm.size(), 4U);
  for (int n = 1; n < 4; ++n) {
    EXPECT_NE(warm[static_cast<std::size_t>(n)], warm[static_cast<std::size_t>(n - 1)]);
    Show cold(flag_set("first = " + std::to_string(n) + "\n"), frames(1));
    cold.run([&](const ShownFrame& shown) {
      EXPECT_EQ(shown.result->rgba.pixels, warm[static_cast<std::size_t>(n)]) << n;
    });
  }
}

TEST_F(ShapeSetTest, GivesCopiesAndOtherObjectsOfTheFilesTheSameShape) {
  const Set set = flag_set(
      "copies = [2, 1]\nspacing = [1, 0]\n[[object]]\nmesh = \"flag_%d.obj\"\nemission_gain = 2\n");
  Show show(set, frames(3));
  EXPECT_THAT(numbers_of(show), ElementsAre(0, 1, 2));
}

TEST_F(ShapeSetTest, GoesOnWhereItWasWhenTheSetIsLoadedAnew) {
  const Set set = flag_set("loop = true\n");
  Show show(set, frames(12));
  std::vector<int> numbers;
  show.run([&](const ShownFrame& shown) {
    numbers.push_back(number_in(shown.prepared.scene->description()));
    if (numbers.size() != 3) return;
    Set changed = set;
    changed.objects.erase(changed.objects.begin());
    changed.objects.back().pose.position.x = 1;
    show.post(ChangeSet{changed});
  });
  for (int i = 0; i < 12; ++i) EXPECT_EQ(numbers[static_cast<std::size_t>(i)], i % 6) << i;
  EXPECT_EQ(show.status()->held_shapes, 0);
}

TEST_F(ShapeSetTest, WaitsForNoShapeLiveAndTellsOnceThatTheyAreLate) {
  if (std::getenv("PLATELIGHT_HELPERS") != nullptr) GTEST_SKIP() << "the helpers are elsewhere";
  const Set set = flag_set("");
  SetScene scene = describe_scene(set);
  const Gate gate(dir_);
  ShapeFeed feed(set, scene, pal, capture::Time{0}, true);
  for (int n = 0; n < 4; ++n) {
    EXPECT_FALSE(feed.at(capture::time_of_frame(n, pal), scene)) << n;
    EXPECT_EQ(number_in(scene.description), 0);
    EXPECT_EQ(feed.held(), n == 0 ? 0 : 1);
    EXPECT_THAT(feed.take_notes(), SizeIs(n == 1 ? 1 : 0)) << n;
  }
  gate.open();
  for (int i = 0; i < 1000 && (i == 0 || feed.held() > 0); ++i) {
    feed.at(capture::time_of_frame(3, pal), scene);
    std::this_thread::sleep_for(10ms);
  }
  EXPECT_EQ(feed.held(), 0);
  EXPECT_EQ(number_in(scene.description), 3);

  // Loaded anew: the shape is there at once, though no file has been read.
  SetScene anew = describe_scene(set);
  ShapeFeed after(set, anew, pal, std::nullopt, true, &feed);
  EXPECT_TRUE(after.at(capture::time_of_frame(4, pal), anew));
  EXPECT_GE(number_in(anew.description), 3);
}

TEST_F(ShapeSetTest, GivesUpTheFileThatIsBeingReadWhenItEnds) {
  if (std::getenv("PLATELIGHT_HELPERS") != nullptr) GTEST_SKIP() << "the helpers are elsewhere";
  const Set set = flag_set("");
  SetScene scene = describe_scene(set);
  const Gate gate(dir_);
  auto feed = std::make_unique<ShapeFeed>(set, scene, pal, capture::Time{0}, true);
  feed->at(capture::time_of_frame(1, pal), scene);
  std::future<void> end = std::async(std::launch::async, [&] { feed.reset(); });
  EXPECT_EQ(end.wait_for(10s), std::future_status::ready);
  gate.open();
}

// However often it changes.
TEST_F(ShapeSetTest, WaitsForNoFileOfTheSetsBefore) {
  if (std::getenv("PLATELIGHT_HELPERS") != nullptr) GTEST_SKIP() << "the helpers are elsewhere";
  const Gate gate(dir_, 2);  // the cube, the first shape; then the second is read ahead
  FrameMaker maker(flag_set(""), std::nullopt, true);
  ASSERT_TRUE(maker.make(0));
  std::future<void> changes = std::async(std::launch::async, [&] {
    for (std::int64_t n = 1; n < 4; ++n) {
      maker.change_set(made_set("grey:1,25,0", ""));
      EXPECT_TRUE(maker.make(n));
    }
  });
  EXPECT_EQ(changes.wait_for(10s), std::future_status::ready);
  gate.open();
  changes.get();
}

TEST_F(ShapeSetTest, TellsOfABadFileOnceAlsoWhenTheSetIsLoadedAnew) {
  std::ofstream(file_of(1)) << "none";
  const Set set = flag_set("loop = true\n");
  SetScene scene = describe_scene(set), anew = describe_scene(set);
  ShapeFeed feed(set, scene, pal, capture::Time{0}, false);
  for (int n = 0; n < 3; ++n) feed.at(capture::time_of_frame(n, pal), scene);
  EXPECT_THAT(feed.take_notes(), ElementsAre(HasSubstr(file_of(1).string())));
  ShapeFeed after(set, anew, pal, std::nullopt, false, &feed);
  for (int n = 3; n < 9; ++n) after.at(capture::time_of_frame(n, pal), anew);
  EXPECT_THAT(after.take_notes(), IsEmpty());
}

// Of a live show that has long been past a last file that is bad.
TEST_F(ShapeSetTest, StaysAtItsLastShapeForEver) {
  std::ofstream(file_of(5)) << "none";
  const Set set = flag_set("");
  SetScene scene = describe_scene(set);
  ShapeFeed feed(set, scene, pal, capture::Time{0}, true);
  for (int i = 0; i < 1000 && number_in(scene.description) != 4; ++i) {
    feed.at(capture::time_of_frame(4, pal), scene);
    std::this_thread::sleep_for(10ms);
  }
  ASSERT_EQ(number_in(scene.description), 4);
  for (const std::int64_t n : {5LL, 6LL, 100LL, 1'000'000'000LL}) {
    feed.at(capture::time_of_frame(n, pal), scene);
    EXPECT_EQ(number_in(scene.description), 4) << n;
    EXPECT_EQ(feed.held(), 1) << n;
  }
}

TEST_F(ShapeSetTest, WaitsForTheShapeThatIsDueInAShowThatIsNotLive) {
  if (std::getenv("PLATELIGHT_HELPERS") != nullptr) GTEST_SKIP() << "the helpers are elsewhere";
  const Set set = flag_set("");
  SetScene scene = describe_scene(set);
  const Gate gate(dir_);
  ShapeFeed feed(set, scene, pal, capture::Time{0}, false);
  const std::jthread later([&] {
    std::this_thread::sleep_for(100ms);
    gate.open();
  });
  EXPECT_TRUE(feed.at(capture::time_of_frame(5, pal), scene));
  EXPECT_EQ(number_in(scene.description), 5);
  EXPECT_EQ(feed.held(), 0);
  EXPECT_THAT(feed.take_notes(), IsEmpty());
}

}  // namespace
}  // namespace studio::shape_set_test
