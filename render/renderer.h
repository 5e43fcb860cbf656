// One frame, tile by tile, on this machine's threads.
#pragma once

#include <chrono>
#include <memory>
#include <span>

#include "calibrate/lens.h"
#include "capture/image.h"
#include "render/environment.h"
#include "render/frame_job.h"
#include "render/scene.h"
#include "render/video_texture.h"

namespace render {

class KeptTransport;
class PictureStalls;

// What a FrameJob's numbers stand for on this machine. All of it must outlive the call.
struct FrameInputs {
  const Scene* scene = nullptr;
  const calibrate::DirectionTable* directions =
      nullptr;  // of the job's lens, by which virtual light is dimmed; its size is the picture's
  const Environment* environment = nullptr;  // of the job's time, match applied, smoothed
  // An earlier one, of the same sizes, by whose light sampling is decided, so that the decisions
  // stay while the light changes a little; null: `environment`.
  const Environment* planned = nullptr;
  // The frames of the scene's live textures, one for each of SceneDescription::videos.
  std::span<const VideoTexture* const> videos = {};
  KeptTransport* kept = nullptr;  // a cache, or null: the same bits, slower
  // For what clear bodies and mirrors show of the plate: all of it, and the job's lens. Null: they
  // show the environment in its place.
  const capture::HalfImage* plate = nullptr;
  const calibrate::Lens* lens = nullptr;
  // What keeps cells that show live pictures from being found anew while these stay within them;
  // null, or where any picture is outside: boxes close about them.
  const PictureStalls* stalls = nullptr;
  bool count_rays = false;  // fill FrameResult::rays; the picture's bits are the same
};

struct FrameResult {
  capture::HalfImage rgba;   // (height, width, 4)
  capture::HalfImage matte;  // (height, width, 1)
  RayCounts rays;            // if asked for, else empty
  RenderStatistics statistics;
};

// What all tiles of a frame share (kernel.h).
struct FrameContext;

// The two halves of render_frame, for who decides on the stages of cells by what is still kept:
// job.stages may change in between. Inputs, job and plate must outlive the context. Both throw
// std::invalid_argument if sizes disagree.
std::shared_ptr<FrameContext> prepare_frame(const FrameInputs& inputs,
                                            const FrameJob& job,
                                            const capture::HalfImage& plate);
void render_frame(const FrameContext& context,
                  const capture::HalfImage& plate,
                  FrameResult& result);

// A cell of a frame, by rows, and the stage that it goes on to.
struct Refinement {
  std::size_t cell = 0;
  std::uint8_t stage = 0;
  // Out: what finding it took on its thread, 0 if nobody came to it; and whether it was given up.
  float took_ms = 0;
  bool given_up = false;
};

// Between the two: finds cells' transport ahead of the frame, in their order, until the deadline,
// and changes the stages of those that are done in `job`, which is the frame's own. Each cell
// occurs once; one that takes more than `most` is given up, and stays as it is. The rays that it
// took are added to `statistics`. Only for inputs with `kept`; where its memory is used up, it
// ends, and cells that found no room are found again as they were, in the frame.
void refine_cells(const FrameContext& context,
                  std::span<Refinement> cells,
                  std::chrono::steady_clock::time_point deadline,
                  std::chrono::steady_clock::duration most,
                  FrameJob& job,
                  RenderStatistics& statistics);

// Renders a frame with oneTBB over tiles. `plate` is (height, width, 3) of the picture's size,
// linear. `result` keeps its buffers from frame to frame. Throws std::invalid_argument if sizes
// disagree.
void render_frame(const FrameInputs& inputs,
                  const FrameJob& job,
                  const capture::HalfImage& plate,
                  FrameResult& result);

}  // namespace render
