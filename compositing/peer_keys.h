// What other tools' chroma keys make of a frame, by their published formulas.
#pragma once

#include <array>

#include "compositing/made_clip.h"

namespace compositing {

// Key colour, R'G'B' 0..1: what their eye-droppers would give.
using PeerKeyColour = std::array<float, 3>;

// The mean light of the pixels that truth says are bare screen, as a value.
PeerKeyColour pick_key_colour(const MadeFrame& frame);

// FFmpeg 5.1, filters chromakey and despill (libavfilter/vf_chromakey.c, vf_despill.c), in floats:
// distance of Cb and Cr (BT.601) to the key's, a ramp, then the screen's primary limited at a mix
// of the two others.
struct FfmpegKey {
  float similarity = 0.12F;
  float blend = 0.16F;
  float mix = 0.5F;
};
capture::Image key_as_ffmpeg(const MadePicture& seen,
                             const PeerKeyColour& key,
                             const FfmpegKey& dials);

// OBS Studio 28, chroma_key_filter_v2.effect: distance of Cb and Cr (BT.709), averaged over a box,
// ramps of power 1.5 for alpha and for the loss of colour.
struct ObsKey {
  float similarity = 0.16F;
  float smoothness = 0.10F;
  float spill = 0.12F;
};
capture::Image key_as_obs(const MadePicture& seen, const PeerKeyColour& key, const ObsKey& dials);

// GStreamer 1.22, element alpha (gst/alpha/gstalpha.c), method custom, in floats: a cone of
// `angle` degrees around the key's chroma.
struct GstreamerKey {
  float angle = 20;
  float noise = 2;
};
capture::Image key_as_gstreamer(const MadePicture& seen,
                                const PeerKeyColour& key,
                                const GstreamerKey& dials);

}  // namespace compositing
