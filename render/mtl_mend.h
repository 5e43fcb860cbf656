// Material libraries of OBJ (.mtl): what assimp misreads in them is mended, what it drops is kept.
#pragma once

#include <array>
#include <cstddef>
#include <map>
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
  // Of each material that the libraries describe: what they state of it, in small letters.
  std::map<std::string, std::set<std::string>> stated;
  std::vector<MtlMap> maps;        // those with options
  std::vector<std::string> notes;  // of what nobody takes

  bool states(const std::string& material, const std::string& keyword) const {
    const auto found = stated.find(material);
    return found != stated.end() && found->second.contains(keyword);
  }
};

// A library's bytes: colours of one number written out as three; maps without their options, which
// `facts` get; without lines that would make assimp give up the whole model. Adds to `facts`.
std::vector<std::byte> mend_mtl(std::span<const std::byte> library, MtlFacts& facts);

}  // namespace render
