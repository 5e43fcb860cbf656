// Materials and textures of an imported model.
#include "render/model_material.h"

#include <assimp/GltfMaterial.h>
#include <assimp/ObjMaterial.h>
#include <assimp/material.h>
#include <assimp/scene.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace render {
namespace {

float number(
    const aiMaterial& material, const char* key, unsigned type, unsigned slot, float otherwise) {
  ai_real value = otherwise;
  if (material.Get(key, type, slot, value) != aiReturn_SUCCESS || !std::isfinite(value))
    return otherwise;
  return value;
}

bool colour(const aiMaterial& material, const char* key, unsigned type, unsigned slot, float* rgb) {
  aiColor3D value;
  if (material.Get(key, type, slot, value) != aiReturn_SUCCESS) return false;
  if (!std::isfinite(value.r) || !std::isfinite(value.g) || !std::isfinite(value.b)) return false;
  rgb[0] = std::max(0.0F, value.r);
  rgb[1] = std::max(0.0F, value.g);
  rgb[2] = std::max(0.0F, value.b);
  return true;
}

std::string name_of(const aiMaterial& material) {
  aiString name;
  return material.Get(AI_MATKEY_NAME, name) == aiReturn_SUCCESS ? name.C_Str() : "";
}

// What people call a map, by assimp's types.
std::string map_name(unsigned type, unsigned slot) {
  switch (type) {
    case aiTextureType_DIFFUSE:
    case aiTextureType_BASE_COLOR:
      return slot > 0 ? "second base colour map" : "base colour map";
    case aiTextureType_SPECULAR:
      return "specular map";
    case aiTextureType_AMBIENT:
      return "ambient map";
    case aiTextureType_EMISSIVE:
    case aiTextureType_EMISSION_COLOR:
      return slot > 0 ? "second emission map" : "emission map";
    case aiTextureType_HEIGHT:
      return "height map";
    case aiTextureType_NORMALS:
    case aiTextureType_NORMAL_CAMERA:
      return slot > 0 ? "second normal map" : "normal map";
    case aiTextureType_SHININESS:
      return "shininess map";
    case aiTextureType_OPACITY:
      return "opacity map";
    case aiTextureType_DISPLACEMENT:
      return "displacement map";
    case aiTextureType_LIGHTMAP:
    case aiTextureType_AMBIENT_OCCLUSION:
      return "occlusion map";
    case aiTextureType_REFLECTION:
      return "reflection map";
    case aiTextureType_METALNESS:
      return "metallic map";
    case aiTextureType_DIFFUSE_ROUGHNESS:
      return "roughness map";
    case aiTextureType_SHEEN:
      return slot > 0 ? "sheen's roughness map" : "sheen's map";
    case aiTextureType_CLEARCOAT:
      return slot == 2 ? "coat's normal map" : "coat's map";
    default:
      return "map of a kind that is not known";
  }
}

// Above this, glass scatters light so much that it is taken for a thin, clear sheet.
constexpr float rough_glass = 0.3F;

float dispersion_of(const aiMaterial& material) {
  return number(material, dispersion_key, 0, 0, 0);
}

// glTF's volume, of KHR_materials_volume, _ior and _dispersion: the attenuation colour is what is
// left of white light after the attenuation distance; base colour tints what passes a surface.
GlassParameters glass_of(const aiMaterial& material, const StandardParameters& p) {
  GlassParameters glass;
  glass.index = std::clamp(number(material, AI_MATKEY_REFRACTI, 1.5F), 1.0F, 4.0F);
  const float dispersion = dispersion_of(material);
  if (dispersion > 0) glass.abbe = std::clamp(20 / dispersion, least_abbe, most_abbe);
  float left[3] = {1, 1, 1};
  colour(material, AI_MATKEY_VOLUME_ATTENUATION_COLOR, left);
  const float distance_m = number(material, AI_MATKEY_VOLUME_ATTENUATION_DISTANCE, 0);
  for (int c = 0; c < 3; ++c) {
    const float share = std::clamp(left[c], 1e-4F, 1.0F);
    glass.tint[c] = p.base_color[c];
    if (!(distance_m > 1e-4F)) continue;  // endless where it is not stated
    glass.absorption[c] = -std::log(share) / distance_m;
    glass.shadow[c] *= std::sqrt(share);
  }
  return glass;
}

}  // namespace

void MaterialImport::note(const std::string& text) {
  if (std::find(notes_.begin(), notes_.end(), text) == notes_.end()) notes_.push_back(text);
}

Wrap MaterialImport::wrap_of(const aiMaterial& material,
                             const char* key,
                             unsigned type,
                             unsigned slot) const {
  int mode = 0;
  if (material.Get(key, type, slot, mode) != aiReturn_SUCCESS) return Wrap::repeat;
  // Of X3D, assimp keeps whether it repeats.
  if (format_.x3d) return mode != 0 ? Wrap::repeat : Wrap::clamp;
  switch (mode) {
    case aiTextureMapMode_Clamp:
    case aiTextureMapMode_Decal:
      return Wrap::clamp;
    case aiTextureMapMode_Mirror:
      return Wrap::mirror;
    default:
      return Wrap::repeat;
  }
}

// Of the scene's textures, -1 if it is a file of its own. Those that are meant are named by their
// number; other formats than glTF also know the name of the file that they once were, often under
// another folder.
int MaterialImport::embedded_index(const std::string& path) const {
  const auto count = static_cast<int>(scene_.mNumTextures);
  if (path.starts_with('*')) {
    int index = -1;
    std::from_chars(path.data() + 1, path.data() + path.size(), index);
    return index < count ? index : -1;
  }
  if (format_.gltf) return -1;
  const auto name_at = [this](int i) -> std::string {
    return scene_.mTextures[i]->mFilename.C_Str();
  };
  const auto without_folder = [](const std::string& name) {
    return name.substr(name.find_last_of("/\\") + 1);  // all of it if there is none
  };
  int found = -1, alike = 0;
  for (int i = 0; i < count; ++i) {
    if (name_at(i) == path) return i;
    if (without_folder(name_at(i)) != without_folder(path)) continue;
    found = i;
    ++alike;
  }
  return alike == 1 ? found : -1;
}

// assimp counts v upwards and turns about a picture's middle. glTF turns about its upper left
// corner, after scaling; assimp's translation makes up for that.
UvTransform MaterialImport::transform_of(const aiMaterial& material, unsigned type, unsigned slot) {
  aiUVTransform t;
  if (material.Get(AI_MATKEY_UVTRANSFORM(static_cast<aiTextureType>(type), slot), t) !=
      aiReturn_SUCCESS)
    return {};
  const auto say = [&](const std::string& text) {
    note("material '" + name_of(material) + "': " + text);
  };
  if (t.mRotation != 0 && !format_.gltf) {
    say("the rotation of a texture is left out");
    t.mRotation = 0;
  }
  const double angle = -t.mRotation, c = std::cos(angle), s = std::sin(angle);
  const double width = t.mScaling.x, height = t.mScaling.y;
  const double right = t.mTranslation.x - 0.5 * width * (1 - c + s);
  const double down = 1 - height - t.mTranslation.y - 0.5 * height * (1 - c - s);
  UvTransform uv;
  uv.u = {static_cast<float>(c * width), static_cast<float>(s * height), static_cast<float>(right)};
  uv.v = {static_cast<float>(-s * width), static_cast<float>(c * height), static_cast<float>(down)};
  constexpr float most = 1e6F;
  const auto sound = [](float x) { return std::abs(x) <= most; };
  if (std::ranges::all_of(uv.u, sound) && std::ranges::all_of(uv.v, sound)) return uv;
  say("the transform of a texture, which goes beyond a million, is left out");
  return {};
}

std::int32_t MaterialImport::texture(
    const aiMaterial& material, unsigned type, unsigned slot, bool srgb, UvTransform& uv) {
  const auto ai_type = static_cast<aiTextureType>(type);
  const auto say = [&](const std::string& text) {
    note("material '" + name_of(material) + "': " + text);
  };
  taken_.emplace_back(type, slot);
  aiString path;
  unsigned channel = 0;
  if (material.GetTexture(ai_type, slot, &path, nullptr, &channel) != aiReturn_SUCCESS) return -1;
  if (path.length == 0) {
    say("a texture whose picture is neither a file nor base64 is left out");
    return -1;
  }
  uv = transform_of(material, type, slot);
  if (!uv_set_) uv_set_ = channel;
  if (uv_set_ != channel) {
    if (!second_uv_set_) second_uv_set_ = channel;
    uv.second = second_uv_set_ == channel ? 1 : 0;
    if (uv.second == 0)
      say("its textures name more than two sets of coordinates; the others take the first");
  }
  int filter = 0;
  constexpr int nearest = 9728;  // glTF's
  if (material.Get(AI_MATKEY_GLTF_MAPPINGFILTER_MAG(ai_type, slot), filter) == aiReturn_SUCCESS &&
      filter == nearest)
    say("a texture that asks for its nearest texel is smoothed");
  RawTexture source;
  source.name = path.C_Str();
  source.srgb = srgb;
  source.wrap = {wrap_of(material, _AI_MATKEY_MAPPINGMODE_U_BASE, type, slot),
                 wrap_of(material, _AI_MATKEY_MAPPINGMODE_V_BASE, type, slot)};
  const int index = embedded_index(source.name);
  if (index >= 0) {
    source.name = "its embedded texture " + std::to_string(index);
    source.embedded = true;
  }
  const auto [found, added] = indices_.emplace(TextureKey{source.name, srgb, source.wrap},
                                               static_cast<std::int32_t>(textures_.size()));
  if (added) {
    textures_.push_back(std::move(source));
    embedded_.push_back(index >= 0 ? scene_.mTextures[index] : nullptr);
  }
  return found->second;
}

void MaterialImport::note_unhandled(const aiMaterial& material, const std::string& name) {
  const auto leave_out = [&](const std::string& what) {
    note("material '" + name + "': " + what + " left out");
  };
  float sheen[3];
  if (colour(material, AI_MATKEY_SHEEN_COLOR_FACTOR, sheen) && sheen[0] + sheen[1] + sheen[2] > 0)
    leave_out("sheen is");
  for (unsigned type = 1; type <= AI_TEXTURE_TYPE_MAX; ++type) {
    const unsigned count = material.GetTextureCount(static_cast<aiTextureType>(type));
    for (unsigned slot = 0; slot < count; ++slot) {
      if (std::ranges::find(taken_, std::pair(type, slot)) == taken_.end())
        leave_out("the " + map_name(type, slot) + " is");
    }
  }
}

void MaterialImport::take_base(const aiMaterial& material, StandardParameters& p) {
  aiColor4D base;
  if (material.Get(AI_MATKEY_BASE_COLOR, base) != aiReturn_SUCCESS &&
      material.Get(AI_MATKEY_COLOR_DIFFUSE, base) != aiReturn_SUCCESS)
    return;
  const float rgba[4] = {base.r, base.g, base.b, base.a};
  for (int c = 0; c < 3; ++c)
    p.base_color[c] = std::isfinite(rgba[c]) ? std::clamp(rgba[c], 0.0F, 1.0F) : 1;
  p.base_color_alpha = std::isfinite(rgba[3]) ? std::clamp(rgba[3], 0.0F, 1.0F) : 1;
}

// Of KHR_materials_pbrSpecularGlossiness: matte below, mirrored above, both with colours of their
// own; what is no metal of ours mirrors at most 4 %, without colour. Without a matte part it is a
// metal.
void MaterialImport::take_specular_glossiness(const aiMaterial& material,
                                              const std::string& name,
                                              StandardParameters& p) {
  float diffuse[3] = {1, 1, 1}, specular[3] = {1, 1, 1};
  colour(material, AI_MATKEY_COLOR_DIFFUSE, diffuse);
  colour(material, AI_MATKEY_COLOR_SPECULAR, specular);
  aiColor4D with_alpha;
  if (material.Get(AI_MATKEY_COLOR_DIFFUSE, with_alpha) == aiReturn_SUCCESS &&
      std::isfinite(with_alpha.a))
    p.base_color_alpha = std::clamp(with_alpha.a, 0.0F, 1.0F);
  const float gloss = std::clamp(number(material, AI_MATKEY_GLOSSINESS_FACTOR, 1), 0.0F, 1.0F);
  p.roughness = 1 - gloss;
  const bool mapped = material.GetTextureCount(aiTextureType_SPECULAR) > 0;  // noted elsewhere
  const float most = std::min(1.0F, *std::max_element(specular, specular + 3));
  const float matte = *std::max_element(diffuse, diffuse + 3);
  constexpr float of_dielectric = 0.04F;
  p.metallic = !mapped && matte == 0 && most > of_dielectric ? 1.0F : 0.0F;
  for (int c = 0; c < 3; ++c) {
    const float shown = p.metallic > 0 ? specular[c] : diffuse[c] * (mapped ? 1 : 1 - most);
    p.base_color[c] = std::clamp(shown, 0.0F, 1.0F);
  }
  if (p.metallic > 0) return;
  if (!mapped) p.specular = std::min(1.0F, most / of_dielectric);
  const bool grey = specular[0] == specular[1] && specular[1] == specular[2];
  if (mapped || most > of_dielectric * 1.01F || !grey)
    note("material '" + name +
         "': its mirror colour (specular-glossiness) is left out: it mirrors as paint does");
}

// Of OBJ, whose libraries say what shows reflections (illum 3 and above). What is not matte at all
// is a metal; else it mirrors as paint does.
void MaterialImport::take_mirror(const aiMaterial& material,
                                 const std::string& name,
                                 StandardParameters& p) {
  constexpr int with_reflections = 3;
  constexpr float of_dielectric = 0.04F;
  int illum = 0;
  float specular[3] = {};
  if (material.Get(AI_MATKEY_OBJ_ILLUM, illum) != aiReturn_SUCCESS || illum < with_reflections ||
      !colour(material, AI_MATKEY_COLOR_SPECULAR, specular) ||
      *std::max_element(specular, specular + 3) <= of_dielectric)
    return;
  const bool black = std::all_of(p.base_color, p.base_color + 3, [](float x) { return x == 0; });
  if (black && p.opacity == 1) {
    p.metallic = 1;
    for (int c = 0; c < 3; ++c) p.base_color[c] = std::min(specular[c], 1.0F);
    p.base_color_texture = -1;
  } else {
    note("material '" + name + "': its mirror colour (Ks) is left out: it mirrors as paint does");
  }
}

void MaterialImport::take_volume(const aiMaterial& material,
                                 const std::string& name,
                                 ImportedMaterial& result) {
  const StandardParameters& p = result.parameters;
  if (!(number(material, AI_MATKEY_VOLUME_THICKNESS_FACTOR, 0) > 0)) return;
  if (p.transmission < 0.5F || p.roughness >= rough_glass || p.transmission_texture >= 0) {
    note("material '" + name + "': the volume (thickness, attenuation) is left out");
    return;
  }
  result.glass = glass_of(material, p);
  if (20 / least_abbe < dispersion_of(material))
    note("material '" + name + "': it disperses by Abbe's number 5, the strongest that is shown");
  std::string lost;
  const auto lose = [&lost](bool has, const char* what) {
    if (has) lost += (lost.empty() ? "" : ", ") + std::string(what);
  };
  lose(p.base_color_texture >= 0, "base colour map");
  lose(p.alpha_cutoff > 0 || p.alpha_blend != 0, "alpha");
  lose(p.metallic_roughness_texture >= 0, "roughness map");
  lose(p.normal_texture >= 0, "normal map");
  lose(p.clearcoat > 0, "clear coat");
  lose(std::max({p.emission[0], p.emission[1], p.emission[2]}) > 0, "emission");
  lose(p.transmission < 1, "matte share");
  if (!lost.empty())
    note("material '" + name + "': it is solid glass, which goes without its " + lost);
}

ImportedMaterial MaterialImport::import(const aiMaterial& material) {
  ImportedMaterial result;
  StandardParameters& p = result.parameters;
  const std::string name = name_of(material);
  taken_.clear();
  uv_set_.reset(), second_uv_set_.reset();
  const auto textured = [&](unsigned type, unsigned slot, bool srgb, UvTransform& uv) {
    return texture(material, type, slot, srgb, uv);
  };
  const auto either = [&](unsigned type, unsigned other, bool srgb, UvTransform& uv) {
    const std::int32_t index = textured(type, 0, srgb, uv);
    return index >= 0 ? index : textured(other, 0, srgb, uv);
  };
  aiColor4D base;
  const bool metallic_roughness = material.Get(AI_MATKEY_BASE_COLOR, base) == aiReturn_SUCCESS;
  ai_real gloss = 0;
  const bool specular_glossiness =
      format_.gltf && material.Get(AI_MATKEY_GLOSSINESS_FACTOR, gloss) == aiReturn_SUCCESS;
  take_base(material, p);
  if (specular_glossiness) {
    p.base_color_texture = textured(aiTextureType_DIFFUSE, 0, true, p.base_color_uv);
    taken_.emplace_back(aiTextureType_BASE_COLOR, 0);  // this and the next are for other readers
    taken_.emplace_back(AI_MATKEY_GLTF_PBRMETALLICROUGHNESS_METALLICROUGHNESS_TEXTURE);
  } else {
    p.base_color_texture =
        either(aiTextureType_BASE_COLOR, aiTextureType_DIFFUSE, true, p.base_color_uv);
    p.metallic_roughness_texture =
        textured(AI_MATKEY_GLTF_PBRMETALLICROUGHNESS_METALLICROUGHNESS_TEXTURE, false,
                 p.metallic_roughness_uv);
  }
  if (format_.gltf) {
    // assimp has maps of glTF under other names too.
    for (const aiTextureType twin :
         {aiTextureType_DIFFUSE, aiTextureType_METALNESS, aiTextureType_DIFFUSE_ROUGHNESS}) {
      taken_.emplace_back(twin, 0);
    }
  }
  p.normal_texture = either(aiTextureType_NORMALS, aiTextureType_NORMAL_CAMERA, false, p.normal_uv);
  p.emission_texture =
      either(aiTextureType_EMISSIVE, aiTextureType_EMISSION_COLOR, true, p.emission_uv);
  p.clearcoat_texture = textured(AI_MATKEY_CLEARCOAT_TEXTURE, false, p.clearcoat_uv);
  p.clearcoat_roughness_texture =
      textured(AI_MATKEY_CLEARCOAT_ROUGHNESS_TEXTURE, false, p.clearcoat_roughness_uv);
  p.transmission_texture = textured(AI_MATKEY_TRANSMISSION_TEXTURE, false, p.transmission_uv);
  taken_.emplace_back(AI_MATKEY_VOLUME_THICKNESS_TEXTURE);  // the shape tells it
  if (format_.obj) {
    p.alpha_texture = textured(aiTextureType_OPACITY, 0, false, p.alpha_uv);
    p.alpha_blend = p.alpha_texture >= 0 ? 1 : 0;
  }

  const float unit_roughness = metallic_roughness ? 1.0F : 0.5F;
  // Of X3D it is a share of the most.
  const float shininess = number(material, AI_MATKEY_SHININESS, 0) * (format_.x3d ? 128 : 1);
  // Blinn-Phong exponent to GGX: alpha^2 = 2 / (n + 2), roughness = sqrt(alpha).
  const float shiny_roughness = std::pow(2 / (std::max(0.0F, shininess) + 2), 0.25F);
  const float plain_roughness =
      !metallic_roughness && shininess > 0 ? shiny_roughness : unit_roughness;
  p.roughness =
      std::clamp(number(material, AI_MATKEY_ROUGHNESS_FACTOR, plain_roughness), 0.0F, 1.0F);
  p.metallic = std::clamp(
      number(material, AI_MATKEY_METALLIC_FACTOR, metallic_roughness ? 1.0F : 0.0F), 0.0F, 1.0F);
  if (specular_glossiness) take_specular_glossiness(material, name, p);
  p.clearcoat = std::clamp(number(material, AI_MATKEY_CLEARCOAT_FACTOR, 0), 0.0F, 1.0F);
  p.clearcoat_roughness =
      std::clamp(number(material, AI_MATKEY_CLEARCOAT_ROUGHNESS_FACTOR, 0), 0.0F, 1.0F);
  p.transmission = std::clamp(number(material, AI_MATKEY_TRANSMISSION_FACTOR, 0), 0.0F, 1.0F);
  if (!metallic_roughness)
    p.opacity = std::clamp(number(material, AI_MATKEY_OPACITY, 1), 0.0F, 1.0F);
  if (format_.obj) take_mirror(material, name, p);
  colour(material, AI_MATKEY_COLOR_EMISSIVE, p.emission);
  p.emission_gain = std::max(0.0F, number(material, AI_MATKEY_EMISSIVE_INTENSITY, 1));
  p.normal_scale = number(material, AI_MATKEY_GLTF_TEXTURE_SCALE(aiTextureType_NORMALS, 0), 1);
  // FBX puts a texture in the place of a colour, which is whatever it was before.
  if (format_.fbx && p.base_color_texture >= 0) std::fill_n(p.base_color, 3, 1.0F);
  if (format_.fbx && p.emission_texture >= 0) std::fill_n(p.emission, 3, 1.0F);

  aiString alpha_mode;
  if (material.Get(AI_MATKEY_GLTF_ALPHAMODE, alpha_mode) == aiReturn_SUCCESS) {
    const std::string mode = alpha_mode.C_Str();
    if (mode == "MASK")
      p.alpha_cutoff = std::clamp(number(material, AI_MATKEY_GLTF_ALPHACUTOFF, 0.5F), 0.0F, 1.0F);
    if (mode == "BLEND" && p.base_color_texture < 0) {
      p.opacity = std::exchange(p.base_color_alpha, 1.0F);
    } else if (mode == "BLEND") {
      p.alpha_blend = 1;
    }
  }
  result.uv_set = uv_set_.value_or(0);
  result.second_uv_set = second_uv_set_;
  take_volume(material, name, result);
  constexpr float frosted = 0.1F;
  if (p.transmission > 0 && p.metallic < 1 && p.roughness > frosted)
    note("material '" + name + "': what goes through it is clear, not as rough as its surface");
  note_unhandled(material, name);
  return result;
}

std::vector<RawTexture> MaterialImport::take_textures() {
  for (std::size_t k = 0; k < textures_.size(); ++k) {
    if (embedded_[k] == nullptr) continue;
    RawTexture& texture = textures_[k];
    const aiTexture& source = *embedded_[k];
    const auto* bytes = reinterpret_cast<const std::byte*>(source.pcData);
    if (source.mHeight == 0) {  // a file
      texture.bytes.assign(bytes, bytes + source.mWidth);
      continue;
    }
    texture.width = static_cast<std::int32_t>(source.mWidth);
    texture.height = static_cast<std::int32_t>(source.mHeight);
    const std::size_t count = std::size_t{source.mWidth} * source.mHeight;
    texture.bytes.reserve(4 * count);
    for (std::size_t i = 0; i < count; ++i) {
      const aiTexel& t = source.pcData[i];
      for (const unsigned char value : {t.r, t.g, t.b, t.a}) {
        texture.bytes.push_back(static_cast<std::byte>(value));
      }
    }
  }
  return std::move(textures_);
}

}  // namespace render
