// How fine the cells of the next picture are, while it sharpens.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "capture/frame.h"
#include "render/kept_transport.h"
#include "render/refinement.h"

namespace studio {

// Memory across frames, of a show: chooses the stages of each frame's cells
// (render::FrameJob::stages). Cells that something moved before, and all of them where the camera
// or the light's plan changed, are found anew; those that are kept go on to their next stage,
// whatever plate, videos and light energies do.
//
// In a live show as fast as a share of the frame's time allows; otherwise evenly, within a second
// of frames, so that pictures do not depend on timing. Where the memory for kept cells is used up,
// the picture stays as sharp as it is.
class Sharpening {
 public:
  Sharpening(capture::Rational rate, bool live);

  // Of the next frame, row by row, from what is still kept of the frames before
  // (render::KeptTransport::stages()).
  std::vector<std::uint8_t> next(std::span<const int> kept);
  // What rendering that frame took, and whether what it found could not all be kept.
  void took(double render_ms, bool full);
  // Of the last frame: 0 = coarse, 1 = as the effort asks.
  double share() const { return share_; }

 private:
  template <class T>
  using ByStage = std::array<T, render::refinement_stages>;

  double budget(std::size_t cells, bool at_rest) const;
  std::size_t after(std::size_t stage) const;

  double frame_ms_, frames_a_second_;
  bool live_;
  bool full_ = false, stopped_ = false;  // there is no memory for more
  double relight_ms_ = 0;                // a frame that finds no cell anew
  ByStage<double> cost_;                 // of a cell: live in ms, once a frame was timed
  ByStage<bool> timed_{};                // whether that is more than a guess
  ByStage<std::size_t> found_{};         // cells of the last frame that were found anew
  std::size_t promoted_ = 0;             // those that went on in it
  double share_ = 0;
};

}  // namespace studio
