// A display's view as OpenColorIO computes it: the config in code, config and look files.
#include "compositing/view_transform.h"

#include <OpenColorIO/OpenColorIO.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "compositing/display.h"

namespace compositing {
namespace {

namespace ocio = OCIO_NAMESPACE;

constexpr const char* working_space_in_code = "linear Rec.709";

// Linear Rec.709 to CIE XYZ, white D65; ITU-R BT.709-6 primaries, in the precision of OpenColorIO's
// own display transforms, so that the un-tone-mapped views cancel to the identity.
constexpr std::array<double, 16> xyz_from_rec709{0.4123907992659593,
                                                 0.3575843393838779,
                                                 0.1804807884018343,
                                                 0.0,  //
                                                 0.2126390058715102,
                                                 0.7151686787677558,
                                                 0.0721923153607337,
                                                 0.0,  //
                                                 0.0193308187155918,
                                                 0.1191947797946259,
                                                 0.9505321522496605,
                                                 0.0,  //
                                                 0.0,
                                                 0.0,
                                                 0.0,
                                                 1.0};

ocio::ConstTransformRcPtr built_in(
    const char* style, ocio::TransformDirection direction = ocio::TRANSFORM_DIR_FORWARD) {
  const auto transform = ocio::BuiltinTransform::Create();
  transform->setStyle(style);
  transform->setDirection(direction);
  return transform;
}

ocio::ConstTransformRcPtr aces_from_rec709() {
  const auto matrix = ocio::MatrixTransform::Create();
  matrix->setMatrix(xyz_from_rec709.data());
  const auto group = ocio::GroupTransform::Create();
  group->appendTransform(matrix);
  group->appendTransform(
      built_in("UTILITY - ACES-AP0_to_CIE-XYZ-D65_BFD", ocio::TRANSFORM_DIR_INVERSE)
          ->createEditableCopy());
  return group;
}

// A curve ((v + offset) / (1 + offset))^gamma with a straight piece near black, to linear Rec.709.
ocio::ConstTransformRcPtr aces_from_curve(double gamma, double offset) {
  const auto curve = ocio::ExponentWithLinearTransform::Create();
  const double gammas[4] = {gamma, gamma, gamma, 1};
  const double offsets[4] = {offset, offset, offset, 0};
  curve->setGamma(gammas);
  curve->setOffset(offsets);
  const auto group = ocio::GroupTransform::Create();
  group->appendTransform(curve);
  group->appendTransform(aces_from_rec709()->createEditableCopy());
  return group;
}

void add_scene_space(const ocio::ConfigRcPtr& config,
                     const char* name,
                     const ocio::ConstTransformRcPtr& to_reference) {
  const auto space = ocio::ColorSpace::Create(ocio::REFERENCE_SPACE_SCENE);
  space->setName(name);
  space->setBitDepth(ocio::BIT_DEPTH_F32);
  if (to_reference) space->setTransform(to_reference, ocio::COLORSPACE_DIR_TO_REFERENCE);
  config->addColorSpace(space);
}

void add_display_space(const ocio::ConfigRcPtr& config,
                       const char* name,
                       const ocio::ConstTransformRcPtr& from_reference) {
  const auto space = ocio::ColorSpace::Create(ocio::REFERENCE_SPACE_DISPLAY);
  space->setName(name);
  space->setBitDepth(ocio::BIT_DEPTH_F32);
  if (from_reference) space->setTransform(from_reference, ocio::COLORSPACE_DIR_FROM_REFERENCE);
  config->addColorSpace(space);
}

void add_view(const ocio::ConfigRcPtr& config, const char* name, const char* style) {
  const auto view = ocio::ViewTransform::Create(ocio::REFERENCE_SPACE_SCENE);
  view->setName(name);
  view->setTransform(built_in(style), ocio::VIEWTRANSFORM_DIR_FROM_REFERENCE);
  config->addViewTransform(view);
}

ocio::ConstConfigRcPtr config_in_code() {
  const auto config = ocio::Config::Create();
  config->setVersion(2, 1);
  add_scene_space(config, "ACES2065-1", nullptr);
  add_scene_space(config, "ACEScg", built_in("ACEScg_to_ACES2065-1"));
  add_scene_space(config, working_space_in_code, aces_from_rec709());
  add_scene_space(config, "sRGB", aces_from_curve(2.4, 0.055));
  add_scene_space(config, "Rec.709 camera", aces_from_curve(1 / 0.45, 0.099));
  add_display_space(config, "CIE XYZ D65", nullptr);
  add_display_space(config, "Rec.1886 display",
                    built_in("DISPLAY - CIE-XYZ-D65_to_REC.1886-REC.709"));
  add_display_space(config, "sRGB display", built_in("DISPLAY - CIE-XYZ-D65_to_sRGB"));
  add_view(config, "Un-tone-mapped", "UTILITY - ACES-AP0_to_CIE-XYZ-D65_BFD");
  add_view(config, "ACES SDR", "ACES-OUTPUT - ACES2065-1_to_CIE-XYZ-D65 - SDR-VIDEO_1.0");
  for (const char* display : {"Rec.1886", "sRGB"}) {
    const std::string space = std::string(display) + " display";
    for (const char* view : {"Un-tone-mapped", "ACES SDR"}) {
      config->addDisplayView(display, view, view, space.c_str(), "", "", "");
    }
  }
  config->setRole("scene_linear", working_space_in_code);
  config->setRole("default", working_space_in_code);
  config->validate();
  return config;
}

// What OpenColorIO reads is small text: a huge file is a mistake, and would be parsed for minutes.
void require_readable_text(const std::string& file, const char* what) {
  constexpr std::uintmax_t largest_file = 64U << 20U;
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) {
    throw std::runtime_error(file + ": no such " + what + " file" +
                             (error ? ": " + error.message() : std::string()));
  }
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (error || size > largest_file) {
    throw std::runtime_error(file + ": not a " + what +
                             " file: " + (error ? error.message() : "it is larger than 64 MiB"));
  }
}

ocio::ConstConfigRcPtr open_config(const std::string& file) {
  // It would write warnings about spaces that nobody asked for to stderr.
  ocio::SetLoggingLevel(ocio::LOGGING_LEVEL_NONE);
  if (file.empty()) return config_in_code();
  require_readable_text(file, "OpenColorIO config");
  try {
    auto config = ocio::Config::CreateFromFile(file.c_str());
    config->validate();
    return config;
  } catch (const ocio::Exception& error) {
    throw std::runtime_error(file + ": not a usable OpenColorIO config: " + error.what());
  }
}

std::string quoted_list(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "\"" : ", \"") + name + "\"";
  return text;
}

void require_view(const ocio::ConstConfigRcPtr& config,
                  const std::string& display,
                  const std::string& view) {
  std::vector<std::string> displays;
  for (int d = 0; d < config->getNumDisplays(); ++d) displays.emplace_back(config->getDisplay(d));
  if (std::ranges::find(displays, display) == displays.end()) {
    throw std::invalid_argument("no display \"" + display + "\"; there are " +
                                quoted_list(displays));
  }
  std::vector<std::string> views;
  for (int v = 0; v < config->getNumViews(display.c_str()); ++v) {
    views.emplace_back(config->getView(display.c_str(), v));
  }
  if (std::ranges::find(views, view) == views.end()) {
    throw std::invalid_argument("display \"" + display + "\" has no view \"" + view +
                                "\"; it has " + quoted_list(views));
  }
}

// The config's own name for scene-linear Rec.709.
std::string find_working_space(const ocio::ConstConfigRcPtr& config, const std::string& asked) {
  if (!asked.empty()) {
    if (config->getColorSpace(asked.c_str())) return asked;
    std::vector<std::string> names;
    for (int i = 0; i < config->getNumColorSpaces(); ++i) {
      names.emplace_back(config->getColorSpaceNameByIndex(i));
    }
    throw std::invalid_argument("no colour space \"" + asked + "\"; there are " +
                                quoted_list(names));
  }
  // Our own name, then those of the published ACES and Blender configs.
  for (const char* name :
       {working_space_in_code, "lin_rec709_srgb", "lin_rec709", "lin_srgb",
        "Utility - Linear - Rec.709", "Utility - Linear - sRGB", "Linear Rec.709", "Linear"}) {
    if (config->getColorSpace(name)) return name;
  }
  throw std::invalid_argument(
      "the config has no colour space known as linear Rec.709: name the one that is");
}

}  // namespace

struct ViewTransform::Processor {
  ocio::ConstCPUProcessorRcPtr cpu;
};

ViewTransform::ViewTransform(const DisplaySettings& settings) {
  const ocio::ConstConfigRcPtr config = open_config(settings.config_file);
  const std::string display =
      settings.display.empty() ? config->getDefaultDisplay() : settings.display;
  const std::string view_name =
      settings.view.empty() ? config->getDefaultView(display.c_str()) : settings.view;
  require_view(config, display, view_name);
  const std::string working_space = find_working_space(config, settings.working_space);
  const auto group = ocio::GroupTransform::Create();
  if (!settings.look_file.empty()) {
    require_readable_text(settings.look_file, "look");
    const auto look = ocio::FileTransform::Create();
    look->setSrc(std::filesystem::absolute(settings.look_file).c_str());
    look->setInterpolation(ocio::INTERP_TETRAHEDRAL);
    group->appendTransform(look);
  }
  const auto view = ocio::DisplayViewTransform::Create();
  view->setSrc(working_space.c_str());
  view->setDisplay(display.c_str());
  view->setView(view_name.c_str());
  group->appendTransform(view);
  try {
    auto processor = std::make_unique<Processor>();
    // Lossless leaves out the approximate logarithms and powers, which are off by up to 1e-4.
    processor->cpu = config->getProcessor(group)->getOptimizedCPUProcessor(
        ocio::BIT_DEPTH_F32, ocio::BIT_DEPTH_F32, ocio::OPTIMIZATION_LOSSLESS);
    processor_ = std::move(processor);
  } catch (const ocio::Exception& error) {
    std::string files = settings.config_file;
    if (!settings.look_file.empty()) files += (files.empty() ? "" : ", ") + settings.look_file;
    throw std::runtime_error((files.empty() ? std::string("OpenColorIO") : files) + ": view \"" +
                             view_name + "\" of display \"" + display +
                             "\" cannot be made: " + error.what());
  }
}

ViewTransform::ViewTransform(ViewTransform&&) noexcept = default;
ViewTransform& ViewTransform::operator=(ViewTransform&&) noexcept = default;
ViewTransform::~ViewTransform() = default;

void ViewTransform::apply(std::span<float> rgb) const {
  if (rgb.empty()) return;
  ocio::PackedImageDesc image(rgb.data(), static_cast<long>(rgb.size() / 3), 1, 3);
  processor_->cpu->apply(image);
}

bool ViewTransform::mixes_channels() const { return processor_->cpu->hasChannelCrosstalk(); }

}  // namespace compositing
