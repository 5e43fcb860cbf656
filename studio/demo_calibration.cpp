// The demo's calibration footage: boards held before its cameras, markers around, a lamp.
#include "studio/demo_calibration.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "calibrate/lens.h"
#include "calibrate/made_board.h"
#include "capture/parallel_loop.h"
#include "capture/png.h"
#include "compositing/video_writer.h"
#include "studio/demo_files.h"

namespace studio {
namespace {

namespace fs = std::filesystem;
using calibrate::Pose;
using calibrate::Vec2;
using calibrate::Vec3;
using Json = nlohmann::ordered_json;

// Exposures of calibration: what is as bright as this is white.
constexpr double brightest = 1.25;

double exposure_for_boards(const render::MadeCamera& camera) {
  return camera.sensor.saturation / brightest;
}

double distance(Vec2 a, Vec2 b) { return std::hypot(a.x - b.x, a.y - b.y); }

// Whether all of the board is seen, its squares nowhere smaller than `least_px`.
bool is_seen_whole(const calibrate::Board& board,
                   const Pose& cam_from_board,
                   const calibrate::Lens& lens,
                   double margin_px,
                   double least_px) {
  const auto corners = true_corners(board, cam_from_board, lens);
  const auto columns = static_cast<std::size_t>(board.columns);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const auto& q = corners[i];
    if (!q || q->x < margin_px || q->y < margin_px || q->x > lens.width - 1 - margin_px ||
        q->y > lens.height - 1 - margin_px) {
      return false;
    }
    if (i % columns > 0 && distance(*q, *corners[i - 1]) < least_px) return false;
    if (i >= columns && distance(*q, *corners[i - columns]) < least_px) return false;
  }
  // The rim of a fish-eye hides what is as near to it; a square and the border are around corners.
  const double square_m = board.square_m;
  for (const int row : {-2, board.rows + 1}) {
    for (const int column : {-2, board.columns + 1}) {
      if (!project(lens, cam_from_board * Vec3{column * square_m, row * square_m, 0})) return false;
    }
  }
  return true;
}

// A board that is tilted somehow, its middle near a pixel, squares of about `square_px`.
Pose hold_board(const calibrate::Board& board,
                const calibrate::Lens& lens,
                Vec2 q,
                double square_px,
                double spin_rad,
                std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  constexpr double tilt_rad = 0.7;
  constexpr int tries = 2000;
  std::optional<Pose> held;
  for (int i = 0; i < tries; ++i) {
    // Further towards the middle if nothing fits.
    const double inwards = 0.5 * i / tries;
    const Vec2 middle{
        q.x + inwards * (lens.width / 2.0 - q.x) + 0.5 * square_px * uniform(random),
        q.y + inwards * (lens.height / 2.0 - q.y) + 0.5 * square_px * uniform(random)};
    const auto v = unproject(lens, middle);
    const auto beside = unproject(lens, {middle.x + 1, middle.y});
    if (!v || !beside) continue;
    const double pixel_rad = length(*beside - *v);
    const double distance_m =
        board.square_m / (square_px * (1.2 + 0.2 * uniform(random)) * pixel_rad);
    held = make_board_pose(board, *v, distance_m, tilt_rad, spin_rad, random);
    if (is_seen_whole(board, *held, lens, 0.3 * square_px, 0.72 * square_px)) break;
  }
  return held.value();
}

std::vector<Pose> boards_before_plate(const calibrate::Lens& lens, std::mt19937& random) {
  std::vector<Pose> poses;
  const auto hold = [&](double x, double y) {
    poses.push_back(hold_board(demo_board(), lens, {x * lens.width, y * lens.height},
                               lens.width / 27.0, 0.5, random));
  };
  for (const double y : {0.27, 0.5, 0.73}) {
    for (const double x : {0.24, 0.5, 0.76}) hold(x, y);
  }
  for (const double y : {0.3, 0.7}) {
    for (const double x : {0.22, 0.78}) hold(x, y);
  }
  return poses;
}

std::vector<Pose> boards_before_probe(const calibrate::Lens& lens, std::mt19937& random) {
  std::vector<Pose> poses;
  const auto hold = [&](double radius, double turn) {
    const double angle = 2 * std::numbers::pi * turn;
    poses.push_back(hold_board(demo_board(), lens,
                               {lens.width * (0.5 + radius * std::cos(angle)),
                                lens.height * (0.5 + radius * std::sin(angle))},
                               lens.width / 25.0, std::numbers::pi, random));
  };
  hold(0, 0);
  hold(0.05, 0.3);
  for (int i = 0; i < 5; ++i) hold(0.18, i / 5.0);
  for (int i = 0; i < 9; ++i) hold(0.32, (i + 0.4) / 9);
  return poses;
}

void write_boards(const fs::path& dir,
                  const render::MadeCamera& camera,
                  const capture::Image& room,
                  const std::vector<Pose>& poses) {
  fs::create_directories(dir);
  const calibrate::DirectionTable directions = make_direction_table(camera.lens);
  capture::parallel_for(std::size_t{0}, poses.size(), [&](std::size_t i) {
    const capture::Image radiance =
        photograph_board(demo_board(), poses[i], camera.lens, directions, room);
    constexpr std::uint64_t first_shot = 1'000'000;  // noise of its own
    const capture::MadeShot shot =
        capture::expose(camera.sensor, radiance, exposure_for_boards(camera), first_shot + i);
    const std::vector<std::uint8_t> codes(shot.codes.begin(), shot.codes.end());
    capture::write_png(dir / fmt::format("{:02}.png", i), shot.width, shot.height, 3, codes);
  });
}

struct SurveyedPoint {
  std::string name;
  Vec3 p_set;
};

// Nails in the ground, poles around the car's place and stands near it, where nothing hides them
// from the cameras; the car is not there yet.
std::vector<SurveyedPoint> survey() {
  std::vector<SurveyedPoint> points;
  constexpr std::array<Vec2, 9> nails{{{-1.8, -1.1},
                                       {-0.3, -2.05},
                                       {1.15, -1.6},
                                       {0.1, -0.35},
                                       {1.9, 0.2},
                                       {-1.5, 0.85},
                                       {0.35, 1.2},
                                       {-0.6, 2.6},
                                       {1.7, 2.35}}};
  for (std::size_t i = 0; i < nails.size(); ++i) {
    points.push_back({fmt::format("nail {}", i + 1), {nails[i].x, nails[i].y, 0}});
  }
  const auto stand = [&](const std::string& name, Vec2 foot, std::initializer_list<double> marks) {
    for (const double z : marks) {
      points.push_back({fmt::format("{} at {} m", name, z), {foot.x, foot.y, z}});
    }
  };
  constexpr std::array<Vec2, 7> poles{{{3.1, 0.4},
                                       {1.75, 2.55},
                                       {-0.45, 2.95},
                                       {-2.6, 1.5},
                                       {-2.95, -0.9},
                                       {0.9, -2.9},
                                       {2.5, -1.75}}};
  for (std::size_t i = 0; i < poles.size(); ++i) {
    stand(fmt::format("pole {}", i + 1), poles[i], {0.5, 1, 1.5, 2});
  }
  stand("stand 1", {1.3, 0.55}, {0.9, 1.7, 2.6, 3.4});
  stand("stand 2", {-0.95, 1.1}, {0.9, 1.7, 2.6, 3.4});
  stand("stand 3", {-0.2, -1.45}, {1.7, 2.6, 3.4});
  return points;
}

// Those that the camera sees, as somebody marks them who looks closely.
void write_markers(const fs::path& file, const render::MadeCamera& camera, std::mt19937& random) {
  const calibrate::Lens& lens = camera.lens;
  const double margin_px = lens.width / 100.0;
  // Further out, a fish-eye is not calibrated well: boards do not reach the rim.
  const double least_cosine = std::cos(80 * std::numbers::pi / 180);
  std::normal_distribution<double> noise(0, demo_marker_noise_px);
  std::string text = "# Surveyed points, and where they were marked in a picture.\n";
  for (const SurveyedPoint& point : survey()) {
    const Vec3 p_cam = camera.cam_from_set * point.p_set;
    const auto q = project(lens, p_cam);
    if (!q || p_cam.z < least_cosine * length(p_cam) || q->x < margin_px || q->y < margin_px ||
        q->x > lens.width - 1 - margin_px || q->y > lens.height - 1 - margin_px) {
      continue;
    }
    const double x = q->x + noise(random);
    const double y = q->y + noise(random);
    text += fmt::format(
        "\n[[marker]]\nname = \"{}\"\nposition = [{}, {}, {}]\npixel = [{:.2f}, {:.2f}]\n",
        point.name, point.p_set.x, point.p_set.y, point.p_set.z, x, y);
  }
  write_text(file, text);
}

void write_patches(const fs::path& file, const render::MadeStudio& studio) {
  const auto card = render::picture_of_card(studio);
  write_text(file, fmt::format("# The grey card on the ground.\n[[patch]]\n"
                               "pixels = [{}, {}, {}, {}]\nalbedo = {}\n",
                               card[0], card[1], card[2], card[3], render::court_card.albedo));
}

constexpr double lamp_length_s = 10;

// When the lamp is switched, on first.
std::vector<double> switch_lamp(std::mt19937& random) {
  std::uniform_real_distribution<double> pause_s(0.12, 0.55);
  std::vector<double> switched_s{0.3};
  while (switched_s.back() < lamp_length_s + 1) {
    switched_s.push_back(switched_s.back() + pause_s(random));
  }
  return switched_s;
}

// For which share of an exposure it is on.
double lamp_in(const std::vector<double>& switched_s, double middle_s, double exposure_s) {
  double on_s = 0;
  for (std::size_t i = 0; i + 1 < switched_s.size(); i += 2) {
    on_s += std::max(0.0, std::min(switched_s[i + 1], middle_s + exposure_s / 2) -
                              std::max(switched_s[i], middle_s - exposure_s / 2));
  }
  return on_s / exposure_s;
}

// A small part of the picture, lit by the lamp as well. Frame n is exposed about start_s + n /
// rate.
void write_lamp(const fs::path& file,
                const render::MadeCamera& camera,
                const capture::Image& room,
                double start_s,
                const std::vector<double>& switched_s) {
  const capture::Rational rate{25, 1};
  const double exposure_s = 0.5 / rate.value();  // a shutter of 180 degrees
  const int width = std::min(64, room.width / 2 * 2);
  const int height = std::min(48, room.height / 2 * 2);
  capture::Image dark = capture::make_image(height, width);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < 3; ++c) {
        dark.at(y, x, c) = room.at(y + (room.height - height) / 2, x + (room.width - width) / 2, c);
      }
    }
  }
  compositing::VideoSettings settings;
  settings.file = file.string();
  settings.rate = rate;
  settings.width = width;
  settings.height = height;
  settings.transfer = camera.sensor.transfer;
  settings.codec = "lossless";  // others take from one frame into the next
  settings.repeatable = true;
  compositing::VideoWriter video(settings);
  // The aperture is closed until nothing clips: clipped light does not tell its share of a frame.
  capture::MadeSensor sensor = camera.sensor;
  sensor.saturation = exposure_s * 4;
  const int frames = static_cast<int>(lamp_length_s * rate.value());
  std::vector<std::vector<std::uint8_t>> pictures(static_cast<std::size_t>(frames));
  capture::parallel_for(0, frames, [&](int n) {
    const double on = lamp_in(switched_s, start_s + n / rate.value(), exposure_s);
    capture::Image lit = dark;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const double away = std::hypot(x - width / 2.0, y - height / 2.0) / height;
        for (int c = 0; c < 3; ++c) {
          float& value = lit.at(y, x, c);
          value = static_cast<float>(value + on * (away < 0.08 ? 1.5 : 0.05 + 0.3 * value));
        }
      }
    }
    constexpr std::uint64_t first_shot = 2'000'000;
    const capture::MadeShot shot =
        capture::expose(sensor, lit, exposure_s, first_shot + static_cast<std::uint64_t>(n));
    pictures[static_cast<std::size_t>(n)].assign(shot.codes.begin(), shot.codes.end());
  });
  for (int n = 0; n < frames; ++n) video.write_picture(n, pictures[static_cast<std::size_t>(n)]);
  video.close();
}

Json pose_json(const Pose& b_from_a) {
  const Vec3 p = calibrate::position_of(b_from_a);
  return {{"position", {p.x, p.y, p.z}}, {"rotation", b_from_a.R.m}};
}

Json boards_json(const std::vector<Pose>& poses) {
  Json boards = Json::array();
  for (const Pose& pose : poses) boards.push_back(pose_json(pose));
  return boards;
}

}  // namespace

calibrate::Board demo_board() {
  calibrate::Board board;
  board.columns = 9;
  board.rows = 6;
  board.square_m = 0.05;
  return board;
}

double demo_offset_s(const render::MadeStudio& studio) {
  return std::chrono::duration<double>(studio.plate.start - studio.probe.start).count();
}

void write_demo_calibration(const fs::path& dir,
                            const render::MadeStudio& studio,
                            const DemoRooms& rooms) {
  fs::create_directories(dir);
  std::mt19937 random(studio.settings.seed);
  const std::vector<Pose> plate = boards_before_plate(studio.plate.lens, random);
  const std::vector<Pose> probe = boards_before_probe(studio.probe.lens, random);
  write_boards(dir / "plate", studio.plate, rooms.plate, plate);
  write_boards(dir / "probe", studio.probe, rooms.probe, probe);
  write_markers(dir / "plate_markers.toml", studio.plate, random);
  write_markers(dir / "probe_markers.toml", studio.probe, random);
  write_patches(dir / "patches.toml", studio);
  const std::vector<double> switched_s = switch_lamp(random);
  write_lamp(dir / "plate_lamp.mkv", studio.plate, rooms.plate, 0, switched_s);
  write_lamp(dir / "probe_lamp.mkv", studio.probe, rooms.probe, -demo_offset_s(studio), switched_s);
  const calibrate::Board board = demo_board();
  const Json truth{
      {"board", {{"columns", board.columns}, {"rows", board.rows}, {"square_m", board.square_m}}},
      {"plate",
       {{"cam_from_set", pose_json(studio.plate.cam_from_set)},
        {"cam_from_board", boards_json(plate)}}},
      {"probe",
       {{"cam_from_set", pose_json(studio.probe.cam_from_set)},
        {"cam_from_board", boards_json(probe)}}},
      {"marker_noise_px", demo_marker_noise_px},
      {"offset_s", demo_offset_s(studio)}};
  write_text(dir / "truth.json", truth.dump(2) + "\n");
}

}  // namespace studio
