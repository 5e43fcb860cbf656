// The tile kernel: rays in wavefronts over 16x16 cells.
#pragma once

#include <memory>
#include <optional>

#include "render/bordered_levels.h"
#include "render/camera_turn.h"
#include "render/cell_reach.h"
#include "render/glowing_parts.h"
#include "render/light_gather.h"
#include "render/picture_stalls.h"
#include "render/plate_levels.h"
#include "render/ray_log.h"
#include "render/refinement.h"
#include "render/renderer.h"
#include "render/sample_pattern.h"
#include "render/shader.h"
#include "render/soft_lights.h"

namespace render {

// What all tiles of one frame share, made once per frame.
struct FrameContext {
  FrameInputs inputs;
  const FrameJob* job = nullptr;
  const Environment* planned = nullptr;  // its light decides
  std::vector<const capture::Image*> levels, planned_levels;
  std::shared_ptr<const BorderedLevels> bordered;   // those of the environment in `levels`
  std::shared_ptr<const LightTable> planned_table;  // the job's, with its planned irradiances
  std::vector<Four> irradiances;                    // of the job's lights
  // The job's lamps, and one for each light of the caustics: its intensity is the irradiance of
  // that light, planned or as it is.
  std::shared_ptr<const Caustics> caustics;  // or null
  std::vector<LocalLight> lamps;
  SoftLights soft_lights;
  LightRows light_rows;                           // of the planned table
  std::vector<std::uint32_t> compact;             // lights of the table that are compact and apart
  std::array<Effort, refinement_stages> efforts;  // of each stage
  int columns = 0, rows = 0;                      // of cells
  std::size_t cell_at(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
           static_cast<std::size_t>(column);
  }
  int stage_of(int column, int row) const {
    return job->stages.empty() ? finished_stage : job->stages[cell_at(column, row)];
  }
  // For rays that clear bodies bend, or mirrors send on: the plate, and the way to its pixels.
  // Null where the scene has none, or no plate is given.
  std::shared_ptr<const PlateLevels> plate_levels;
  std::size_t first_plate_level = 0;  // in `levels`
  std::optional<calibrate::Lens> lens;
  std::vector<std::size_t> first_video_levels;  // of each live texture, in `levels`
  float brightest_video = 0;  // radiance of a live texture's white, where it is brightest
  const SamplePattern* pattern = nullptr;
  CameraTurn turn;
  Vec3f camera;           // its position in the set
  float pixel_angle = 0;  // radians across a pixel at the picture's centre
  std::vector<SmallLight> small_lights;
  // Of live pictures that cells are found without, and that are looked at anew in every frame;
  // none where pictures belong to what cells are found with.
  PictureStalls stalls;
  // These pictures, each where it stands in this frame.
  struct Picture {
    Scene::Bounds bounds;
    const StandingPicture* standing = nullptr;
  };
  std::vector<Picture> pictures;
};
// What is seen in the cell whose top-left pixel is (x0, y0).
CellCone cone_of_cell(const FrameContext& context, int x0, int y0);
// Throws std::invalid_argument where the job's numbers make no sense (sizes, effort, lights not
// finite).
FrameContext make_frame_context(const FrameInputs& inputs, const FrameJob& job);
// Throws std::invalid_argument where the job's stages are not those of the frame's cells.
void check_stages(const FrameContext& context);

// All memory that rendering tiles takes on one thread. Nothing else is allocated in the tile loop.
class TileWorkspace {
 public:
  TileWorkspace();
  ~TileWorkspace();
  TileWorkspace(TileWorkspace&&) noexcept;
  TileWorkspace& operator=(TileWorkspace&&) noexcept;
  // Keeps every ray from now on in `log`; null stops that.
  void log_rays(RayLog* log);
  struct Impl;
  Impl& impl() { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

// A part of the frame, a union of its cells, where it lies in memory: what belongs to its top left
// pixel, and pixels from row to row.
struct TileView {
  Rect rect;                             // in the picture
  const capture::Half* plate = nullptr;  // 3 values a pixel
  std::ptrdiff_t plate_stride = 0;
  capture::Half* rgba = nullptr;   // out
  capture::Half* matte = nullptr;  // out
  RayCount* rays = nullptr;        // out, where the frame's inputs ask
  std::ptrdiff_t stride = 0;       // of what comes out
  RenderStatistics* statistics = nullptr;
};

// Renders one tile. Its bits depend on the frame and the pixels only, not on how they are cut into
// tiles.
void render_tile(const FrameContext& context, const TileView& tile, TileWorkspace& workspace);

// The same where tiles travel. Makes a tile's job: its slice of the plate with a margin. `job`'s
// buffer is used again.
void cut_tile(const capture::HalfImage& plate, Rect rect, int margin, TileJob& job);

// `result` must have been sized by size_result, as the frame's inputs ask.
void render_tile(const FrameContext& context,
                 const TileJob& tile,
                 TileWorkspace& workspace,
                 TileResult& result);

// Finds the transport of a cell and keeps it in the frame's inputs.kept, or gives up soon after a
// time. Unless it is kept, what was there of the cell stays.
enum class FoundCell : std::uint8_t { kept, has_no_room, takes_too_long };
FoundCell find_cell(const FrameContext& context,
                    int column,
                    int row,
                    int stage,
                    std::chrono::steady_clock::time_point give_up,
                    TileWorkspace& workspace,
                    RenderStatistics& statistics);

void size_result(const Rect& rect, TileResult& result, bool count_rays = false);

}  // namespace render
