// Formulas of FFmpeg, OBS Studio and GStreamer.
#include "compositing/peer_keys.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "capture/colour.h"

namespace compositing {
namespace {

struct Chroma {
  float b, r;
};
struct Value {
  float r, g, b;
};

Value value_at(const MadePicture& seen, std::size_t pixel) {
  const auto at = [&](std::size_t c) {
    return static_cast<float>(seen.codes[3 * pixel + c]) / 255;
  };
  return {at(0), at(1), at(2)};
}

// Limited range, in codes about the middle.
Chroma bt601(Value v) {
  return {-37.797F * v.r - 74.203F * v.g + 112 * v.b, 112 * v.r - 93.786F * v.g - 18.214F * v.b};
}
Chroma bt709(Value v) {
  return {-0.100644F * v.r - 0.338572F * v.g + 0.439216F * v.b,
          0.439216F * v.r - 0.398942F * v.g - 0.040274F * v.b};
}

float light_of_value(float value) {
  return static_cast<float>(capture::decode(capture::Transfer::srgb, value));
}

// Straight colour and alpha into a premultiplied pixel.
void put(capture::Image& keyed, std::size_t pixel, Value v, float alpha) {
  float* to = &keyed.pixels[4 * pixel];
  to[3] = alpha;
  if (alpha <= 0) return;
  to[0] = alpha * light_of_value(v.r);
  to[1] = alpha * light_of_value(v.g);
  to[2] = alpha * light_of_value(v.b);
}

std::size_t pixels_of(const MadePicture& seen) { return seen.codes.size() / 3; }

Value value_of(const PeerKeyColour& key) { return {key[0], key[1], key[2]}; }

}  // namespace

PeerKeyColour pick_key_colour(const MadeFrame& frame) {
  const capture::Image light = light_of(frame.seen);
  std::array<double, 3> sum{};
  double count = 0;
  for (std::size_t i = 0; i < pixels_of(frame.seen); ++i) {
    if (frame.truth.pixels[4 * i + 3] >= 0.001F) continue;
    for (std::size_t c = 0; c < 3; ++c) sum[c] += light.pixels[3 * i + c];
    count += 1;
  }
  PeerKeyColour key{};
  for (std::size_t c = 0; c < 3; ++c) {
    key[c] =
        static_cast<float>(capture::encode(capture::Transfer::srgb, sum[c] / std::max(count, 1.0)));
  }
  return key;
}

capture::Image key_as_ffmpeg(const MadePicture& seen,
                             const PeerKeyColour& key,
                             const FfmpegKey& dials) {
  capture::Image keyed = capture::make_image(seen.height, seen.width, 4);
  const Chroma own = bt601(value_of(key));
  const bool blue = key[2] > key[1];
  for (std::size_t i = 0; i < pixels_of(seen); ++i) {
    Value v = value_at(seen, i);
    const Chroma c = bt601(v);
    const float apart = std::hypot(c.b - own.b, c.r - own.r) / (255 * std::numbers::sqrt2_v<float>);
    const float alpha =
        std::clamp((apart - dials.similarity) / std::max(dials.blend, 1e-4F), 0.0F, 1.0F);
    float& primary = blue ? v.b : v.g;
    const float other = blue ? v.g : v.b;
    primary = std::min(primary, v.r * dials.mix + other * (1 - dials.mix));
    put(keyed, i, v, alpha);
  }
  return keyed;
}

capture::Image key_as_obs(const MadePicture& seen, const PeerKeyColour& key, const ObsKey& dials) {
  capture::Image keyed = capture::make_image(seen.height, seen.width, 4);
  const Chroma own = bt709(value_of(key));
  std::vector<float> apart(pixels_of(seen));
  for (std::size_t i = 0; i < apart.size(); ++i) {
    const Chroma c = bt709(value_at(seen, i));
    apart[i] = std::hypot(c.b - own.b, c.r - own.r);
  }
  const auto at = [&](int y, int x) {
    const int j = std::clamp(y, 0, seen.height - 1), i = std::clamp(x, 0, seen.width - 1);
    return apart[static_cast<std::size_t>(j) * static_cast<std::size_t>(seen.width) +
                 static_cast<std::size_t>(i)];
  };
  std::size_t i = 0;
  for (int y = 0; y < seen.height; ++y) {
    for (int x = 0; x < seen.width; ++x, ++i) {
      // Its four samples lie between two texels each.
      const float around = at(y, x - 1) + at(y - 1, x - 1) + at(y, x + 1) + at(y + 1, x + 1) +
                           at(y + 1, x) + at(y + 1, x - 1) + at(y - 1, x) + at(y - 1, x + 1);
      const float beyond = (around + at(y, x)) / 9 - dials.similarity;
      const float alpha = std::pow(std::clamp(beyond / dials.smoothness, 0.0F, 1.0F), 1.5F);
      const float kept = std::pow(std::clamp(beyond / dials.spill, 0.0F, 1.0F), 1.5F);
      const Value v = value_at(seen, i);
      const Value l{light_of_value(v.r), light_of_value(v.g), light_of_value(v.b)};
      const float grey = 0.2126F * l.r + 0.7152F * l.g + 0.0722F * l.b;
      float* to = &keyed.pixels[4 * i];
      to[0] = alpha * (grey + kept * (l.r - grey));
      to[1] = alpha * (grey + kept * (l.g - grey));
      to[2] = alpha * (grey + kept * (l.b - grey));
      to[3] = alpha;
    }
  }
  return keyed;
}

capture::Image key_as_gstreamer(const MadePicture& seen,
                                const PeerKeyColour& key,
                                const GstreamerKey& dials) {
  capture::Image keyed = capture::make_image(seen.height, seen.width, 4);
  const Value target = value_of(key);
  const Chroma pure = bt601(target);
  const float length = std::hypot(pure.b, pure.r);
  const Chroma axis{pure.b / length, pure.r / length};
  const float luma = 16 + 65.481F * target.r + 128.553F * target.g + 24.966F * target.b;
  const float tangent = std::tan(dials.angle * std::numbers::pi_v<float> / 180);
  for (std::size_t i = 0; i < pixels_of(seen); ++i) {
    Value v = value_at(seen, i);
    const Chroma c = bt601(v);
    const float along = c.b * axis.b + c.r * axis.r, across = c.r * axis.b - c.b * axis.r;
    float alpha = 1;
    if (along > 0 && std::abs(across) <= along * tangent) {
      const float left = std::abs(across) / tangent;
      const float screen = along - left;
      alpha = std::clamp(1 - screen / length, 0.0F, 1.0F);
      if (std::hypot(across, along - std::min(length, 127.0F)) < dials.noise) alpha = 0;
      const float y = std::max(0.0F, 16 + 65.481F * v.r + 128.553F * v.g + 24.966F * v.b -
                                         screen * luma / length) -
                      16;
      const float cb = left * axis.b - across * axis.r, cr = left * axis.r + across * axis.b;
      const auto code = [](float value) { return std::clamp(value, 0.0F, 1.0F); };
      v = {code(1.164F / 255 * y + 1.596F / 255 * cr),
           code(1.164F / 255 * y - 0.392F / 255 * cb - 0.813F / 255 * cr),
           code(1.164F / 255 * y + 2.017F / 255 * cb)};
    }
    put(keyed, i, v, alpha);
  }
  return keyed;
}

}  // namespace compositing
