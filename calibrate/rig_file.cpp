// A rig of cameras in a file.
#include "calibrate/rig_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <initializer_list>
#include <sstream>
#include <stdexcept>

#include <toml++/toml.h>

#include "calibrate/text_file.h"
#include "capture/toml_reader.h"

namespace calibrate {
namespace {

using capture::in_quotes, capture::TomlReader;

class RigReader : public TomlReader {
 public:
  explicit RigReader(const std::string& path)
      : TomlReader(path, "camera"), folder_(std::filesystem::path(path).parent_path()) {}

  RigMember camera(const toml::table& table) const {
    refuse_unknown(table, {"name", "lens", "position", "rotation", "time_offset", "response"});
    RigMember member;
    member.name = text(required(table, "name"), "name");
    member.lens = file(required(table, "lens"), "lens");
    const auto p = numbers<3>(required(table, "position"), "position");
    const toml::node& rotation = required(table, "rotation");
    Mat3 R;
    R.m = numbers<9>(rotation, "rotation");
    try {
      member.cam_from_rig = pose_from_rotation(R, {p[0], p[1], p[2]});
    } catch (const std::invalid_argument& error) {
      fail(rotation.source(), "\"rotation\": " + std::string(error.what()));
    }
    if (const toml::node* offset = table.get("time_offset")) {
      member.time_offset_s = number(*offset, "time_offset");
      constexpr double most_s = 60;
      if (std::abs(member.time_offset_s) > most_s) {
        fail(offset->source(), "\"time_offset\" must be within 60 seconds");
      }
    }
    if (const toml::node* response = table.get("response")) {
      member.response = file(*response, "response");
    }
    return member;
  }

 private:
  std::string file(const toml::node& node, std::string_view key) const {
    return (folder_ / text(node, key)).lexically_normal().string();
  }

  std::filesystem::path folder_;
};

std::string array_of(std::span<const double> numbers) {
  std::string text;
  for (const double number : numbers) text += (text.empty() ? "" : ", ") + to_text(number);
  return "[" + text + "]";
}

// As TOML writes it, whatever is in it.
std::string literal(const std::string& text) {
  std::ostringstream out;
  out << toml::value<std::string>(text);
  return out.str();
}

// Relative to the folder if it is within.
std::string within(const std::filesystem::path& folder, const std::string& file) {
  const auto relative = std::filesystem::absolute(file).lexically_normal().lexically_relative(
      std::filesystem::absolute(folder).lexically_normal());
  return relative.empty() || *relative.begin() == ".."
             ? std::filesystem::absolute(file).lexically_normal().string()
             : relative.string();
}

}  // namespace

std::vector<RigMember> read_rig(const std::string& path) {
  const RigReader reader(path);
  const toml::table root = reader.parse();
  reader.refuse_unknown(root, {"camera"});
  const toml::node* node = root.get("camera");
  const toml::array* tables = node == nullptr ? nullptr : node->as_array();
  if (tables == nullptr || tables->empty()) {
    throw std::runtime_error(path + ": has no [[camera]] with name, lens, position and rotation");
  }
  std::vector<RigMember> cameras;
  for (const toml::node& entry : *tables) {
    const toml::table* table = entry.as_table();
    if (table == nullptr) reader.fail(entry.source(), "a camera must be a table: [[camera]]");
    cameras.push_back(reader.camera(*table));
    if (std::ranges::count(cameras, cameras.back().name, &RigMember::name) > 1) {
      reader.fail(table->source(),
                  "camera " + in_quotes(cameras.back().name) + " is here for the second time");
    }
  }
  return cameras;
}

void write_rig(const std::string& path,
               std::span<const RigMember> cameras,
               const std::string& comment) {
  if (!path.ends_with(".toml")) throw std::invalid_argument(path + ": a rig's file ends in .toml");
  const std::filesystem::path folder =
      std::filesystem::absolute(std::filesystem::path(path)).parent_path();
  std::string text = "# " + comment + "\n";
  for (const RigMember& camera : cameras) {
    if (camera.name.empty() || camera.lens.empty() ||
        std::ranges::count(cameras, camera.name, &RigMember::name) > 1) {
      throw std::invalid_argument("each camera of a rig has a lens and a name of its own, not " +
                                  in_quotes(camera.name));
    }
    const Vec3 p = position_of(camera.cam_from_rig);
    text += "\n[[camera]]\nname = " + literal(camera.name) +
            "\nlens = " + literal(within(folder, camera.lens)) +
            "\nposition = " + array_of(std::array{p.x, p.y, p.z}) +
            "\nrotation = " + array_of(camera.cam_from_rig.R.m) + "\n";
    if (camera.time_offset_s != 0) text += "time_offset = " + to_text(camera.time_offset_s) + "\n";
    if (!camera.response.empty()) {
      text += "response = " + literal(within(folder, camera.response)) + "\n";
    }
  }
  write_text_file(path, text);
}

}  // namespace calibrate
