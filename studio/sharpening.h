// How fine the cells of the next picture are, while it sharpens.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "capture/frame.h"
#include "render/kept_transport.h"
#include "render/refinement.h"
#include "render/renderer.h"

namespace studio {

// What is done for one frame: first `ahead` is found, in its order, as far as the time goes
// (render::refine_cells); then the frame is rendered.
struct SharpeningPlan {
  std::vector<std::uint8_t> stages;  // of all cells, row by row: render::FrameJob::stages
  std::vector<render::Refinement> ahead;
  double ahead_ms = 0;
};

// Memory across frames, of a show: chooses the stages of each frame's cells. Cells that something
// moved before, and all of them where the camera or the light's plan changed, are found anew; those
// that are kept go on to their next stage, whatever plate, videos and light energies do.
//
// In a live show as far as a share of each frame's time goes; otherwise evenly, within a second of
// frames, so that pictures do not depend on timing. Where the memory for kept cells is used up, the
// picture stays as sharp as it is.
class Sharpening {
 public:
  Sharpening(capture::Rational rate, bool live);

  // Of the next frame, from what is still kept of the frames before
  // (render::KeptTransport::stages()), and what looking at persons took of the last frame's time in
  // each of these cells (looks_ms(); empty = nothing anywhere). It stands until the next call.
  // Looking takes the longer the finer cells are, in every frame: where that leaves a live show no
  // time, cells stay as they are; where it makes frames late, those that take most of it are found
  // anew, coarser, as long as that helps.
  // `last`: the stage at which cells are left, the finished one or the finer one; the latter only
  // in a live show, and only as long as nothing moves and frames have half of their time left.
  SharpeningPlan& next(std::span<const int> kept,
                       std::span<const float> looks_ms = {},
                       int last = render::finished_stage);
  // The frame's stages with what was found ahead, and what that took.
  void found_ahead(std::span<const std::uint8_t> stages, double ms);
  // What a cell may take ahead of a frame.
  double most_of_cell_ms() const;
  // What rendering the frame took then, what of that finding cells did, and whether what it found
  // could not all be kept.
  void took(double render_ms, double finding_ms, bool full);
  // Of the last frame: 0 = coarse, 1 = as the effort asks, or finer.
  double share() const;
  // Why the last frame is not as sharp as the effort asks, and stays so until something moves, in
  // words; "" where it is, or gets there: the memory for kept cells is used up, or cells take so
  // long to be found finer that a live show waits for none of them.
  std::string why_coarse() const;
  // Share of its cells that had to be found anew, for something moved.
  double lost_share() const;

 private:
  template <class T>
  using ByStage = std::array<T, render::refinement_stages>;

  double rest_ms(bool at_rest) const;
  double time_to_go_on(bool at_rest) const;
  void follow_last_frame();
  // What a frame takes that finds no cell anew; and what frames do.
  double relight_ms() const { return relight_but_looks_ms_ + looks_ms_; }
  double mean_ms() const { return all_but_looks_ms_ + looks_ms_; }
  std::size_t after(std::size_t stage, std::size_t coarse) const;
  std::size_t stage_of_lost(std::size_t lost) const;
  void go_on(double left, std::span<const float> looks_ms, int last);
  bool takes_too_long(std::size_t cell, std::size_t to) const;
  bool may_take_too_long(std::size_t cell, std::size_t to) const;
  void follow_cells();
  bool looks_matter() const;
  bool looks_much(float look_ms) const;
  std::vector<std::size_t> too_costly(std::span<const float> looks_ms);
  void learn(const ByStage<std::size_t>& found, double ms);

  double frame_ms_, frames_a_second_;
  bool live_;
  double looks_ms_ = 0;  // at persons, of the last frame
  // Cells that became coarser for these.
  struct Shed {
    bool now = false;                       // in this frame
    int late = 0;                           // frames since, less those that were not
    double before_ms = 0, foreseen_ms = 0;  // that looks took, and by how much it should be less
    int in_vain = 0;                        // so often in a row it was not
    double looks_ms = 0;                    // then
  };
  Shed shed_;
  bool full_ = false, stopped_ = false;  // there is no memory for more
  bool moves_ = false;                   // in the last plan, live cells were lost
  bool beyond_ = false;                  // ... and those that go on do so beyond the effort
  // Of a cell that is kept: the last stage that was found ahead and what that took, and the stage
  // that took too long.
  struct CellTime {
    std::uint8_t stage = 0, too_fine = 0, too_fine_in_motion = 0;  // 0 = none
    float ms = 0;
  };
  std::vector<CellTime> cell_times_;
  // A cell that took as much before may take too long at this stage.
  ByStage<double> least_of_slow_ms_;
  std::size_t slow_cells_ = 0, waiting_cells_ = 0;  // of the last plan
  // Of the last frame, where none of its cells was shed.
  struct Told {
    double relight_ms, render_ms;
  };
  std::optional<Told> told_;
  double relight_but_looks_ms_ = 0, all_but_looks_ms_ = 0;
  ByStage<double> cost_;   // of a cell: live in ms, once one was timed
  ByStage<bool> timed_{};  // whether that is more than a guess
  SharpeningPlan plan_;
  ByStage<std::size_t> lost_{};  // cells of the last frame that were lost, by where they began
  bool went_on_ = false;         // whether any other was found anew
  std::size_t reached_ = 0;      // sum of all cells' stages, up to the finished one
};

// Renders a frame so: render_frame() with the stages that sharpening plans, which it tells what was
// done. For inputs with `kept`; throws as render_frame().
void render_sharpening(Sharpening& sharpening,
                       const render::FrameInputs& inputs,
                       render::FrameJob& job,
                       const capture::HalfImage& plate,
                       render::FrameResult& result);

}  // namespace studio
