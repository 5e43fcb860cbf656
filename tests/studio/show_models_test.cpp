// Models that are changed on air: whatever they do to their reader, the show goes on.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "capture/sandbox.h"
#include "studio/show.h"
#include "tests/made_files.h"
#include "tests/studio/made_show.h"

namespace studio::show_models_test {
namespace {

using testing::AllOf, testing::Contains, testing::HasSubstr;

using ShowModels = MadeShowTest;

TEST_F(ShowModels, GoesOnWhenAModelCrashesItsReader) {
  // A group that holds itself, and a picture that is not there.
  const auto model = [&](const char* name, const std::string& scene) {
    const std::string path = (dir_ / name).string();
    std::ofstream(path) << "<?xml version=\"1.0\"?><X3D version=\"3.0\"><Scene>" << scene
                        << "</Scene></X3D>";
    return path;
  };
  const std::string crashing = model("crashing.x3d", "<Group DEF='a'><Group USE='a'/></Group>");
  const std::string bare = model(
      "bare.x3d",
      "<Shape><Appearance><ImageTexture url='lost.png'/></Appearance><IndexedFaceSet "
      "coordIndex='0 1 2 -1'><Coordinate point='0 0 0 1 0 0 0 1 0'/></IndexedFaceSet></Shape>");
  ShowOptions options;
  options.frames = 8;
  const Set set = made_set("grey:1,25,0");
  Show show(set, options);
  std::int64_t frames = 0;
  show.run([&](const ShownFrame&) {
    Set changed = set;
    changed.objects.resize(1);
    changed.objects[0].made.clear();
    changed.objects[0].mesh = frames == 0 ? crashing : bare;
    if (frames++ < 2) show.post(ChangeSet{changed});
  });
  EXPECT_EQ(show.status()->frames, 8);
  EXPECT_THAT(show.status()->notes,
              Contains(AllOf(HasSubstr("crashing.x3d"), HasSubstr(made::crashed_helper))));
  EXPECT_THAT(show.status()->notes, Contains(AllOf(HasSubstr("lost.png"), HasSubstr("magenta"))));
}

// A folder of helper programs in which the models' reader is a shell script.
void make_helpers(const std::filesystem::path& helpers, const std::string& script) {
  std::filesystem::create_directory(helpers);
  std::filesystem::create_symlink(capture::helper_path("platelight-decode"),
                                  helpers / "platelight-decode");
  std::ofstream(helpers / "platelight-model") << "#!/bin/sh\n" << script << "\n";
  std::filesystem::permissions(helpers / "platelight-model", std::filesystem::perms::owner_all);
}

TEST_F(ShowModels, GoesOnLiveWhileAModelIsRead) {
  if (std::getenv("PLATELIGHT_HELPERS") != nullptr) GTEST_SKIP() << "the helpers are elsewhere";
  // In the place of the models' reader, one that waits for the show's fifth frame, and fails.
  const std::filesystem::path helpers = dir_ / "helpers", fifth = dir_ / "fifth";
  make_helpers(helpers, "while [ ! -e " + fifth.string() + " ]; do sleep 0.01; done");
  Set changed = made_set("grey:100000,25,0");
  ShowOptions options;
  options.live = true;
  options.frames = 400;
  Show show(changed, options);
  changed.objects.resize(1);
  changed.objects[0].made.clear();
  changed.objects[0].mesh = (dir_ / "waiting.obj").string();
  std::ofstream(changed.objects[0].mesh) << "v 0 0 0\n";
  setenv("PLATELIGHT_HELPERS", helpers.c_str(), 1);
  show.post(ChangeSet{changed});
  int frames = 0;
  show.run([&](const ShownFrame&) {
    if (++frames == 5) std::ofstream(fifth) << "now";
    if (!show.status()->notes.empty()) show.post(Quit{});
  });
  unsetenv("PLATELIGHT_HELPERS");
  EXPECT_GT(frames, 5);
  EXPECT_THAT(show.status()->notes,
              Contains(AllOf(HasSubstr("waiting.obj"), HasSubstr("went wrong"))));
}

TEST_F(ShowModels, GivesUpAModelThatIsBeingReadWhenItEnds) {
  if (std::getenv("PLATELIGHT_HELPERS") != nullptr) GTEST_SKIP() << "the helpers are elsewhere";
  // In the place of the models' reader, one that takes its time, and says that it was let.
  const std::filesystem::path helpers = dir_ / "helpers", begun = dir_ / "begun",
                              done = dir_ / "done";
  make_helpers(helpers, ": > " + begun.string() + "\nsleep 5\n: > " + done.string());
  Set changed = made_set("grey:100000,25,0");
  ShowOptions options;
  options.live = true;
  options.frames = 400;
  {
    Show show(changed, options);
    changed.objects.resize(1);
    changed.objects[0].made.clear();
    changed.objects[0].mesh = (dir_ / "waiting.obj").string();
    std::ofstream(changed.objects[0].mesh) << "v 0 0 0\n";
    setenv("PLATELIGHT_HELPERS", helpers.c_str(), 1);
    show.post(ChangeSet{changed});
    show.run([&](const ShownFrame&) {
      if (std::filesystem::exists(begun)) show.post(Quit{});
    });
  }
  unsetenv("PLATELIGHT_HELPERS");
  EXPECT_TRUE(std::filesystem::exists(begun));
  EXPECT_FALSE(std::filesystem::exists(done));
}

}  // namespace
}  // namespace studio::show_models_test
