// The benchmarks of `platelight bench`, one function each.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "studio/console.h"

namespace studio {

// The kernel against bare Embree over the same rays, the best of `runs`.
void bench_kernel(int runs, Console& console);

struct PapersBench {
  int runs = 5;
  int check = 64;        // paths a pixel of the reference; 0 = no error
  std::string pictures;  // directory, or none
  std::string scene;     // this one only; "" = all
  int width = 640, height = 480;
};
// Both papers' scenes: the papers' table with ours beside it.
void bench_papers(const PapersBench& bench, Console& console);

// A part of each scene of the papers, or of one, dragged for a second of frames at 25 a second and
// then left alone, as a live show does it: when it shows, what a frame takes, when it is sharp.
// `pictures`: a directory for what is shown at the end of the drag and a second later, or none.
// Throws UsageError, listing the scenes, for one in which nothing is dragged.
void bench_drag(const std::string& scene, const std::string& pictures, Console& console);

// Time a frame, and of bare Embree over the same rays, from 100,000 triangles to 800,000 that are
// all in sight, on all threads and on one; the best of `runs`.
void bench_growth(int runs, Console& console);

// A cloth of 200,000 triangles that waves and curls up: what it takes to fit its tree, or build it
// anew, and how fast rays are then, the best of `runs`.
void bench_deform(int runs, Console& console);

struct CyclesBench {
  std::string
      directory;         // for the scenes as files, both renderers' pictures, and what Blender says
  int runs = 5;          // of each point, ours and theirs: the best counts
  int check = 64;        // paths a pixel of each of our two references
  int converged = 1024;  // samples of each of Cycles' two
  std::string scene;     // this one only; "" = all
};
// The scenes of peer_scene.h in Blender's Cycles and here: how far the converged pictures are
// apart, and error against time of both. Throws std::runtime_error if Blender is missing or fails.
void bench_cycles(const CyclesBench& bench, Console& console);

// CPU time a frame that a set's inputs take: plate, probe, light table; the best of `runs` passes
// over the show's frames, but at most so many: a still plate has no last one. A live plate's are
// made as its pictures come. Throws SetError.
void bench_inputs(const std::string& set_path,
                  int runs,
                  std::int64_t most_frames,
                  Console& console);

// CPU time of a live lightprobe's HDR frame of 1024x1024 pixels, a bracket of five, by the camera's
// format: from its bytes to light, labelled, and merged; the best of `runs` passes.
void bench_hdr(int runs, Console& console);

// From a model's file to its first picture at 640x480, one ray a pixel, nothing kept: time and peak
// memory of each stage, the best of `runs`; each file in turn, or the made headlight as GLB if
// there is none. Throws as render::load_model.
void bench_load(std::vector<std::string> files, int runs, Console& console);

}  // namespace studio
