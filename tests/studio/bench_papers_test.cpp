// What the papers' benchmark tells of its scenes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include <nlohmann/json.hpp>

#include "studio/commands/benches.h"
#include "studio/console.h"
#include "tests/made_files.h"

namespace studio::bench_papers_test {
namespace {

TEST(BenchPapers, TellsThePapersVideosAndWhatOursHasInTheirPlace) {
  const std::filesystem::path dir = made::make_temporary_directory();
  const auto row_of = [&](const std::string& scene) {
    const std::string json = (dir / "papers.json").string();
    PapersBench bench;
    bench.width = 32;
    bench.height = 24;
    bench.runs = 1;
    bench.check = 0;
    bench.scene = scene;
    Console console(true, json);
    bench_papers(bench, console);
    std::ifstream file(json);
    return nlohmann::json::parse(file)["rows"].at(0);
  };
  const auto lit = row_of("tv_room_lit"), room = row_of("tv_room");
  EXPECT_EQ(lit["texture"], "256x256");
  EXPECT_EQ(lit["paper"]["texture"], "130x100 at 25 fps");
  EXPECT_EQ(room["texture"], "still picture") << "that nothing streams";
  EXPECT_EQ(room["paper"]["texture"], "130x100 at 25 fps");
  std::filesystem::remove_all(dir);
}

}  // namespace
}  // namespace studio::bench_papers_test
