// Material libraries of OBJ (.mtl): what assimp misreads in them is mended, what it drops is kept.
#pragma once

#include <array>
#include <cstddef>
#include <set>
#include <span>
#include <string>
#include <vector>

namespace render {

// The options of one map, v up: u' = scale u + offset.
struct MtlMap {
  std::string material;
  std::string keyword;  // "map_kd", in small letters
  std::array<float, 2> scale{1, 1}, offset{0, 0};
  bool clamps = false;
};

struct MtlFacts {
  std::set<std::string> materials;  // that the libraries describe
  std::vector<MtlMap> maps;         // those with options
  std::vector<std::string> notes;   // of options that nobody takes
};

// A library's bytes, colours of one number written out as three. Adds to `facts`.
std::vector<std::byte> mend_mtl(std::span<const std::byte> library, MtlFacts& facts);

}  // namespace render
