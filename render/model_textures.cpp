// Textures of a model.
#include "render/model_textures.h"

#include <algorithm>
#include <span>
#include <stdexcept>
#include <string>

#include "capture/parallel_loop.h"
#include "capture/still.h"
#include "capture/still_size.h"
#include "render/texture.h"

namespace render {
namespace {

constexpr std::size_t max_texel_bytes = std::size_t{4} << 30;  // of files, too

// A texture on its way from the file.
struct Source {
  std::vector<std::byte> file;
  std::shared_ptr<const Texture> texture;  // null if there is none
  std::string why;                         // then
};

void read(RawTexture& raw, const ModelFolder& folder, Source& source) {
  if (raw.embedded) {
    source.file = std::move(raw.bytes);
    return;
  }
  const auto path = folder.find(raw.name);
  if (!path) {
    source.why = "is not there";
    return;
  }
  try {
    source.file = folder.read(*path);
  } catch (const std::runtime_error& error) {
    source.why = error.what();
  }
}

// With mip levels, as the header claims it; 0 for what the decoder will refuse.
std::size_t claimed_bytes(const RawTexture& raw, const Source& source) {
  std::array<std::size_t, 2> size{static_cast<std::size_t>(std::max(raw.width, 0)),
                                  static_cast<std::size_t>(std::max(raw.height, 0))};
  if (raw.width <= 0) size = capture::claimed_size(source.file).value_or(std::array{0UL, 0UL});
  const auto [width, height] = size;
  constexpr std::size_t side = max_texture_size;
  if (width < 1 || height < 1 || width > side || height > side) return 0;
  return texture_bytes(static_cast<int>(width), static_cast<int>(height), 4);
}

// Without an alpha that is opaque everywhere: colours then, or a grey, of which masks are read.
void drop_opaque_alpha(capture::Still8& still) {
  if (still.channels % 2 != 0) return;
  const auto channels = static_cast<std::size_t>(still.channels);
  for (std::size_t i = channels - 1; i < still.texels.size(); i += channels) {
    if (still.texels[i] != 255) return;
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < still.texels.size(); ++i) {
    if (i % channels != channels - 1) still.texels[kept++] = still.texels[i];
  }
  still.texels.resize(kept);
  --still.channels;
}

void decode(const RawTexture& raw, Source& source) {
  try {
    if (raw.width > 0) {
      const auto* texels = reinterpret_cast<const std::uint8_t*>(source.file.data());
      source.texture = std::make_shared<const Texture>(
          make_texture(raw.width, raw.height, 4, raw.srgb, {texels, source.file.size()}, raw.wrap));
    } else {
      capture::Still8 still = capture::decode_still8(source.file, "it");
      drop_opaque_alpha(still);
      source.texture = std::make_shared<const Texture>(make_texture(
          still.width, still.height, still.channels, raw.srgb, still.texels, raw.wrap));
    }
  } catch (const std::runtime_error& error) {
    source.why = error.what();
  } catch (const std::invalid_argument& error) {
    source.why = error.what();
  }
  source.file = {};
}

// Names the textures that there are by their new indices, and does without the others. Tells what
// stands in the place of those.
class Substitution {
 public:
  explicit Substitution(const std::vector<Source>& sources) {
    std::int32_t next = 0;
    for (const Source& source : sources) {
      indices_.push_back(source.texture ? next++ : -1);
      opaque_.push_back(source.texture && source.texture->channels % 2 == 1);
    }
    used_.resize(sources.size());
  }

  void apply(RawMaterial& material) {
    StandardParameters& p = material.parameters;
    // Blended alpha of a picture that has none is as without a picture.
    if (p.alpha_blend != 0 && p.alpha_texture < 0 && is_opaque(p.base_color_texture)) {
      p.alpha_blend = 0;
      p.opacity *= std::exchange(p.base_color_alpha, 1.0F);
    }
    if (lost(p.base_color_texture, "magenta stands in its place")) {
      constexpr float magenta[3] = {1, 0, 1};
      std::copy_n(magenta, 3, p.base_color);
      p.base_color_alpha = 1;
      if (p.alpha_texture < 0) p.alpha_blend = 0;
    }
    if (lost(p.emission_texture, "nothing glows in its place")) {
      std::fill_n(p.emission, 3, 0.0F);
    }
    if (lost(p.transmission_texture, "no light goes through in its place")) p.transmission = 0;
    lost(p.metallic_roughness_texture, left_out);
    lost(p.normal_texture, left_out);
    lost(p.clearcoat_texture, left_out);
    lost(p.clearcoat_roughness_texture, left_out);
    if (lost(p.alpha_texture, left_out)) p.alpha_blend = 0;
  }

  // What became of a lost texture, in words.
  std::string used(std::size_t texture) const {
    std::string text;
    for (const std::string_view use : used_[texture]) {
      text.append(text.empty() ? "" : ", ").append(use);
    }
    return text;
  }

 private:
  static constexpr const char* left_out = "the map is left out";

  bool is_opaque(std::int32_t texture) const {
    return texture >= 0 && opaque_.at(static_cast<std::size_t>(texture));
  }

  bool lost(std::int32_t& texture, std::string_view instead) {
    if (texture < 0) return false;
    const auto index = static_cast<std::size_t>(texture);
    texture = indices_.at(index);
    if (texture >= 0) return false;
    auto& used = used_[index];
    if (std::ranges::find(used, instead) == used.end()) used.push_back(instead);
    return true;
  }

  std::vector<std::int32_t> indices_;
  std::vector<bool> opaque_;
  std::vector<std::vector<std::string_view>> used_;
};

}  // namespace

std::vector<std::shared_ptr<const Texture>> decode_textures(RawModel& model,
                                                            const ModelFolder& folder,
                                                            const std::stop_token& stop) {
  std::vector<Source> sources(model.textures.size());
  const auto stop_if_given_up = [&] {
    if (stop.stop_requested()) throw std::runtime_error("it is given up");
  };
  std::size_t bytes = 0, file_bytes = 0;
  for (std::size_t i = 0; i < sources.size(); ++i) {
    stop_if_given_up();
    Source& source = sources[i];
    read(model.textures[i], folder, source);
    const std::size_t claimed = claimed_bytes(model.textures[i], source);
    bytes += claimed;
    // What is no picture is told from one at once, and not kept until all are read.
    if (claimed == 0 && source.why.empty()) decode(model.textures[i], source);
    file_bytes += source.file.size();
    if (bytes > max_texel_bytes || file_bytes > max_texel_bytes)
      throw std::runtime_error("its textures take more than 4 GB");
  }
  capture::parallel_for(std::size_t{0}, sources.size(), [&](std::size_t i) {
    if (stop.stop_requested()) return;
    if (sources[i].why.empty() && !sources[i].texture) decode(model.textures[i], sources[i]);
  });
  stop_if_given_up();
  Substitution substitution(sources);
  for (RawMaterial& material : model.materials) substitution.apply(material);
  std::vector<std::shared_ptr<const Texture>> textures;
  for (std::size_t i = 0; i < sources.size(); ++i) {
    if (sources[i].texture) {
      textures.push_back(std::move(sources[i].texture));
    } else {
      model.report.notes.push_back("texture '" + model.textures[i].name + "': " + sources[i].why +
                                   "; " + substitution.used(i));
    }
  }
  return textures;
}

}  // namespace render
