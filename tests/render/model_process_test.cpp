// The reader of models may be taken over: whatever it sends, we refuse or get a sound model.
#include "render/model_process.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>

#include "render/model_wire.h"
#include "tests/made_files.h"
#include "tests/made_model_bytes.h"

namespace render::model_process_test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

RawModel made_model() {
  RawModel model;
  Mesh& mesh = model.meshes.emplace_back();
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}};
  mesh.materials = {0};
  model.materials.push_back({"paint", {}, std::nullopt});
  model.textures.push_back({"paint.png", true, false, {Wrap::clamp, Wrap::mirror}, {}, 0, 0});
  Instance& instance = model.instances.emplace_back();
  instance.name = "part";
  model.report.nodes = {"part"};
  model.report.triangles = 1;
  return model;
}

TEST(ParseHead, GivesBackWhatWasWritten) {
  RawModel back;
  const RawSizes sizes = parse_head(write_head(made_model()), back);
  EXPECT_EQ(sizes.meshes.at(0).of_vertices[0], 3U);
  EXPECT_EQ(sizes.meshes.at(0).triangles, 1U);
  EXPECT_EQ(back.materials.at(0).name, "paint");
  EXPECT_EQ(back.textures.at(0).name, "paint.png");
  EXPECT_EQ(back.textures.at(0).wrap, made_model().textures.at(0).wrap);
  EXPECT_EQ(back.instances, made_model().instances);
  EXPECT_EQ(back.report.nodes, made_model().report.nodes);
}

TEST(ParseHead, RefusesWhatIsCutShortOrRefersToNothing) {
  const std::vector<std::byte> head = write_head(made_model());
  for (std::size_t size = 0; size < head.size(); ++size) {
    RawModel model;
    EXPECT_THROW(parse_head(std::span(head).first(size), model), std::runtime_error);
  }
  const auto expect_refused = [](const auto& spoil) {
    RawModel spoilt = made_model();
    spoil(spoilt);
    RawModel model;
    EXPECT_THROW(parse_head(write_head(spoilt), model), std::runtime_error);
  };
  expect_refused([](RawModel& m) { m.meshes[0].materials = {1}; });
  expect_refused([](RawModel& m) { m.instances[0].mesh = 1; });
  expect_refused([](RawModel& m) { m.instances[0].set_from_object[3] = std::nanf(""); });
  expect_refused([](RawModel& m) { m.meshes[0].normals.resize(2); });
  expect_refused([](RawModel& m) { m.meshes[0].colours.resize(2); });
}

TEST(ParseHead, SurvivesDamageAnywhere) {
  const std::vector<std::byte> head = write_head(made_model());
  std::uint32_t state = 7;
  const auto random = [&state] { return (state = state * 1664525U + 1013904223U) >> 8U; };
  int refused = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    std::vector<std::byte> damaged = head;
    for (int k = 0; k < 3; ++k)
      damaged[random() % damaged.size()] = static_cast<std::byte>(random());
    RawModel model;
    try {
      const RawSizes sizes = parse_head(damaged, model);
      for (const auto& mesh : sizes.meshes) EXPECT_LE(mesh.triangles, max_model_triangles);
    } catch (const std::runtime_error&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 100);
}

TEST(CheckArrays, RefusesWhatIsNotFiniteOrNamesNoVertex) {
  Mesh mesh = made_model().meshes[0];
  EXPECT_NO_THROW(check_arrays(mesh));
  mesh.triangles[0][2] = 3;
  EXPECT_THROW(check_arrays(mesh), std::runtime_error);
  mesh = made_model().meshes[0];
  mesh.positions[1].y = std::numeric_limits<float>::infinity();
  EXPECT_THROW(check_arrays(mesh), std::runtime_error);
}

// Has shell scripts read models in the place of the helper program.
class OtherReader {
 public:
  explicit OtherReader(const fs::path& folder) : folder_(folder) {
    setenv("PLATELIGHT_HELPERS", folder.c_str(), 1);
  }
  ~OtherReader() { unsetenv("PLATELIGHT_HELPERS"); }
  void become(const std::string& lines) const {
    const fs::path program = folder_ / "platelight-model";
    std::ofstream(program) << "#!/bin/sh\n" << lines << "\n";
    fs::permissions(program, fs::perms::owner_all);
  }

 private:
  fs::path folder_;
};

// What a script prints to send a prefix and a payload.
std::string sending(wire::Kind kind, std::uint32_t bytes, const std::string& payload) {
  std::string text;
  made::put(text, wire::Prefix{kind, bytes});
  text += payload;
  std::string script = "printf '";
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    script += std::string("\\") + static_cast<char>('0' + code / 64) +
              static_cast<char>('0' + code / 8 % 8) + static_cast<char>('0' + code % 8);
  }
  return script + "'; exec sleep 1";
}

TEST(ReadModelConfined, BelievesNothingThatItsReaderSends) {
  if (std::getenv("PLATELIGHT_HELPERS") != nullptr) GTEST_SKIP() << "the helpers are elsewhere";
  const fs::path folder = made::make_temporary_directory();
  const fs::path file = folder / "a.obj";
  std::ofstream(file) << made::obj({0, 1, 0});
  const OtherReader reader(folder);
  const auto refusal = [&](const std::string& script) -> std::string {
    reader.become(script);
    try {
      load_model(file);
    } catch (const std::runtime_error& error) {
      EXPECT_TRUE(std::string(error.what()).starts_with(file.string())) << error.what();
      return error.what();
    }
    return "";
  };
  using wire::Kind;
  EXPECT_THAT(refusal("exit 0"), HasSubstr("went wrong"));
  EXPECT_THAT(refusal("kill -SEGV $$"), HasSubstr("damaged"));
  EXPECT_THAT(refusal("head -c 100 /dev/urandom; exec sleep 1"), HasSubstr("went wrong"));
  EXPECT_THAT(refusal(sending(Kind::head, ~0U, "")), HasSubstr("went wrong"));
  EXPECT_THAT(refusal(sending(Kind::open, ~0U, "")), HasSubstr("went wrong"));
  EXPECT_THAT(refusal(sending(Kind::head, 8, "12345678")), HasSubstr("its reader"));
  EXPECT_THAT(refusal(sending(Kind::failure, 3, "a\033b")), HasSubstr("a?b"));
  EXPECT_THAT(refusal(sending(Kind::open, 11, "/etc/passwd")), HasSubstr("outside"));
  EXPECT_THAT(refusal(sending(Kind::open, 16, "../../etc/passwd")), HasSubstr("outside"));
  RawModel spoilt = made_model();
  spoilt.meshes[0].triangles[0] = {0, 1, 3};
  const std::vector<std::byte> head = write_head(spoilt);
  std::string bytes(reinterpret_cast<const char*>(head.data()), head.size());
  const auto size = static_cast<std::uint32_t>(bytes.size());
  bytes += made::bytes_of(spoilt.meshes[0].positions) + made::bytes_of(spoilt.meshes[0].triangles);
  EXPECT_THAT(refusal(sending(Kind::head, size, bytes)), HasSubstr("no mesh"));
}

// What its reader may take grows with the buffers, wherever below the model they lie.
TEST(ReadModelConfined, CountsBuffersBelowTheModel) {
  if (std::getenv("PLATELIGHT_HELPERS") != nullptr) GTEST_SKIP() << "the helpers are elsewhere";
  const fs::path folder = made::make_temporary_directory();
  const OtherReader reader(folder);
  const fs::path told = folder / "told";
  reader.become("head -c 8 | od -An -tu8 > " + told.string());
  const auto memory_of = [&](const std::string& name) {
    std::ofstream(folder / name) << "{}";
    EXPECT_THROW(load_model(folder / name), std::runtime_error);
    std::uint64_t bytes = 0;
    std::ifstream(told) >> bytes;
    return bytes;
  };
  const std::uint64_t alone = memory_of("a.gltf");
  EXPECT_EQ(alone, (512U << 20) + 2U * 24);
  fs::create_directories(folder / "parts" / "more");
  std::ofstream(folder / "parts" / "more" / "a.BIN") << std::string(1000, ' ');
  EXPECT_EQ(memory_of("a.gltf"), alone + 24000);
  EXPECT_EQ(memory_of("B.GLTF"), alone + 24000);
}

}  // namespace
}  // namespace render::model_process_test
