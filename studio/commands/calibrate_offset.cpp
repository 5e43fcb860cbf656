// platelight calibrate offset: by how much one camera's clock is ahead of another's, from a board
// that is moved or a lamp that is switched before both.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <future>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "calibrate/time_offset.h"
#include "capture/camera.h"
#include "studio/commands/board_options.h"
#include "studio/commands/board_places.h"
#include "studio/commands/commands.h"
#include "studio/commands/watched_camera.h"
#include "studio/json_text.h"

namespace studio {
namespace {

using Json = nlohmann::ordered_json;

constexpr double default_length_s = 20;
constexpr double aimed_at_s = 1e-3;
constexpr std::size_t fewest_places = 40;

struct OffsetOptions {
  std::string camera_a;
  std::string camera_b;
  std::optional<double> length_s;
  std::optional<double> largest_s;
  std::optional<double> exposure_a_s;
  std::optional<double> exposure_b_s;
  BoardOptions board;
};

std::array<Watched, 2> watch_both(const OffsetOptions& options, bool for_board, Console& console) {
  const double length_s = options.length_s.value_or(default_length_s);
  const auto camera_a = capture::open_camera(options.camera_a);
  const auto camera_b = capture::open_camera(options.camera_b);
  if (camera_a->info().live != camera_b->info().live) {
    throw std::runtime_error(
        "one camera is live and the other recorded: their times are on clocks that have nothing in "
        "common");
  }
  if (camera_a->info().live) {
    const std::string asked = for_board
                                  ? "move the board about before both cameras, at no fixed beat"
                                  : "switch a lamp that both cameras see on and off, at random";
    console.say(fmt::format("for {:.0f} s, {}", length_s, asked));
  }
  // Both at a time: live cameras would wait for each other.
  auto watching = std::async(std::launch::async, [&] {
    return watch(*camera_b, options.camera_b, length_s, options.exposure_b_s.value_or(0),
                 for_board);
  });
  Watched a =
      watch(*camera_a, options.camera_a, length_s, options.exposure_a_s.value_or(0), for_board);
  return {std::move(a), watching.get()};
}

calibrate::TimeOffsetOptions search_of(const OffsetOptions& options) {
  calibrate::TimeOffsetOptions search;
  search.largest_s = options.largest_s.value_or(search.largest_s);
  return search;
}

Json figures_of(const calibrate::TimeOffset& found) {
  return {{"offset_ms", 1000 * found.offset_s},
          {"sigma_ms", 1000 * found.sigma_s},
          {"correlation", found.correlation},
          {"next_best", found.next_best},
          {"edges", found.edges},
          {"in_step", found.in_step},
          {"overlap_s", found.overlap_s}};
}

// What to do so that a lamp tells the offset to a millisecond.
std::string advice(const OffsetOptions& options,
                   const std::array<Watched, 2>& watched,
                   const calibrate::TimeOffset& found) {
  for (std::size_t i = 0; i < watched.size(); ++i) {
    if (std::ranges::any_of(watched[i].brightness, [](const auto& s) { return s.exposure_s > 0; }))
      continue;
    return fmt::format("{} does not tell its exposures: say them by --exposure-{}",
                       i == 0 ? options.camera_a : options.camera_b, i == 0 ? "a" : "b");
  }
  if (found.edges == 0) return "switch the lamp 30 times or more, for three frames or longer each";
  // Errors fall at least with the root of their number.
  const double worse = found.sigma_s / aimed_at_s;
  const double more = std::ceil(static_cast<double>(found.edges) * worse * worse / 10) * 10;
  return fmt::format(
      "both saw the lamp switched {} times: switch it {:.0f} times, or expose for longer",
      found.edges, more);
}

calibrate::TimeOffset offset_by_lamp(const OffsetOptions& options, Console& console) {
  const std::array<Watched, 2> watched = watch_both(options, false, console);
  const auto& [a, b] = watched;
  calibrate::TimeOffset found;
  try {
    found = calibrate::find_time_offset(a.brightness, b.brightness, search_of(options));
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(
        std::string(error.what()) +
        " (what was looked at is the brightness of whole pictures; a board that is moved before "
        "both cameras is looked for with --board COLSxROWS)");
  }
  Json figures = figures_of(found);
  figures["frames"] = {a.brightness.size(), b.brightness.size()};
  console.figures(json_text(figures));
  if (found.sigma_s > aimed_at_s) {
    console.warn("the offset is uncertain by more than a millisecond: " +
                 advice(options, watched, found) + "; or move a board (--board)");
  }
  if (found.in_step) {
    console.warn(
        "the lamp is switched in step with a camera's frames: an exposure that is told wrong does "
        "not show, and moves the offset by up to half of its error; switch it by hand, or at "
        "random");
  }
  return found;
}

calibrate::TimeOffset offset_by_board(const OffsetOptions& options,
                                      const calibrate::Board& board,
                                      Console& console) {
  const std::array<Watched, 2> watched = watch_both(options, true, console);
  const BoardPlaces a = find_board_places(watched[0].pictures, board, options.camera_a, console);
  const BoardPlaces b = find_board_places(watched[1].pictures, board, options.camera_b, console);
  const std::string counts = fmt::format(
      "the board was found in {} of {} frames of {} and in {} of {} of {}", a.points.size(),
      a.frames, options.camera_a, b.points.size(), b.frames, options.camera_b);
  if (std::min(a.points.size(), b.points.size()) < fewest_places) {
    const BoardPlaces& fewer = a.points.size() < b.points.size() ? a : b;
    throw std::runtime_error(
        fmt::format("{}, but {} are needed in either ({}): hold it nearer, in good light, move it "
                    "more slowly, expose for less, and check --board",
                    counts, fewest_places, fewer.reason));
  }
  calibrate::TimeOffset found;
  try {
    found = calibrate::find_time_offset(a.points, b.points, search_of(options));
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(fmt::format("{} ({})", error.what(), counts));
  }
  Json figures = figures_of(found);
  figures["frames"] = {a.frames, b.frames};
  figures["boards"] = {a.points.size(), b.points.size()};
  console.figures(json_text(figures));
  console.say(counts);
  if (found.sigma_s > aimed_at_s) {
    console.warn(
        "the offset is uncertain by more than a millisecond: move the board for longer, further "
        "and in all directions, so that both cameras see it all the time");
  }
  return found;
}

void calibrate_offset(const OffsetOptions& options, Console& console) {
  const bool by_board = !options.board.corners.empty();
  if (!by_board && (options.board.square_m || options.board.charuco || options.board.marker_m ||
                    !options.board.dictionary.empty())) {
    throw UsageError("say how many corners the board has: --board 10x7");
  }
  const calibrate::TimeOffset found =
      by_board ? offset_by_board(options, board_of(options.board), console)
               : offset_by_lamp(options, console);
  console.say(fmt::format("{} stamps its frames {:.2f} +- {:.2f} ms {} than {}", options.camera_b,
                          1000 * std::abs(found.offset_s), 1000 * found.sigma_s,
                          found.offset_s < 0 ? "earlier" : "later", options.camera_a));
  console.say(fmt::format("offset_s = {:.5f}", found.offset_s));
}

}  // namespace

Command calibrate_offset_command() {
  return {"calibrate offset", "Measure the time between two cameras from a board or a lamp",
          "platelight calibrate offset v4l2:/dev/video0 aravis:probe --board 10x7",
          [](Arguments& arguments) -> std::function<void(Console&)> {
            auto o = std::make_shared<OffsetOptions>();
            arguments.positional("CAMERA_A", o->camera_a, "a camera or clip: the scene camera");
            arguments.positional("CAMERA_B", o->camera_b,
                                 "another: a set's offset_s is what it is later by");
            arguments.option("--seconds", o->length_s, 1, 600, "how long to watch; 20 if not said");
            arguments.option("--largest", o->largest_s, 0.01, 60,
                             "seconds that the offset may be at most; 5 if not said");
            o->board.corners.clear();  // without a board, a lamp
            declare(arguments, o->board);
            arguments.option(
                "--exposure-a", o->exposure_a_s, 1e-6, 10,
                "seconds, of a lamp where the first camera does not tell them, as in videos");
            arguments.option("--exposure-b", o->exposure_b_s, 1e-6, 10, "and of the second");
            return [o](Console& console) { calibrate_offset(*o, console); };
          }};
}

}  // namespace studio
