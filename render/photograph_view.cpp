// Paths of a photograph in a view of its own.
#include "render/photograph_view.h"

#include <array>
#include <cstdint>
#include <stdexcept>

#include "capture/parallel_loop.h"
#include "render/environment_sampler.h"
#include "render/path_tracer.h"
#include "render/pixel_rays.h"
#include "render/sample_sequence.h"
#include "render/trace.h"

namespace render {

capture::Image photograph(const FrameInputs& inputs,
                          const calibrate::Pose& cam_from_set,
                          const ReferenceSettings& settings,
                          const PhotographView& view) {
  if (inputs.scene == nullptr || inputs.directions == nullptr || inputs.environment == nullptr) {
    throw std::invalid_argument("a photograph needs a scene, directions and an environment");
  }
  if (settings.samples < 1 || settings.max_depth < 1) {
    throw std::invalid_argument("a photograph needs at least one sample, and a depth of one");
  }
  PathRules rules;
  rules.max_depth = settings.max_depth;
  rules.diffuse_bounces = rules.sees_background = true;
  if (view.behind_virtual) rules.camera_mask = mask_stand_in;
  rules.scattered_mask = rules.lobe_blockers = rules.diffuse_blockers =
      mask_virtual | mask_stand_in;
  const EnvironmentSampler environment(*inputs.environment);
  const PathTracer tracer(*inputs.scene, environment, view.lamps, rules, inputs.videos);
  const PixelRays rays(*inputs.directions, cam_from_set);
  const int width = inputs.directions->width;
  capture::Image picture = capture::make_image(inputs.directions->height, width, 3);
  capture::parallel_for(0, picture.height, [&](int y) {
    prepare_thread();
    for (int x = 0; x < width; ++x) {
      std::array<double, 3> sum{};
      const auto index = static_cast<std::uint32_t>(y * width + x);
      for (int i = 0; i < settings.samples; ++i) {
        SampleSequence numbers(settings.seed, index, static_cast<std::uint32_t>(i));
        const auto [dx, dy] = numbers.next_pair();
        const auto direction = rays.direction(x, y, dx - 0.5F, dy - 0.5F);
        if (!direction) continue;
        const Vec3f seen = tracer.camera_path(rays.origin(), *direction, numbers).radiance;
        sum[0] += seen.x;
        sum[1] += seen.y;
        sum[2] += seen.z;
      }
      for (std::size_t c = 0; c < 3; ++c) {
        picture.at(y, x, static_cast<int>(c)) = static_cast<float>(sum[c] / settings.samples);
      }
    }
  });
  return picture;
}

}  // namespace render
