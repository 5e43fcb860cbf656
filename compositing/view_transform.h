// A display's view as OpenColorIO computes it: slow and exact. Display makes fast tables from it.
#pragma once

#include <memory>
#include <span>

namespace compositing {

struct DisplaySettings;

class ViewTransform {
 public:
  // Throws std::runtime_error naming the file and the reason if a config or look file cannot be
  // read; std::invalid_argument listing what there is if display, view or working space are
  // unknown.
  explicit ViewTransform(const DisplaySettings& settings);
  ViewTransform(ViewTransform&&) noexcept;
  ViewTransform& operator=(ViewTransform&&) noexcept;
  ~ViewTransform();

  // Replaces packed RGB triples of working values (scene-linear, Rec.709 primaries) by display
  // values, nominally 0..1. Values must not be NaN: OpenColorIO turns NaN into a small number. May
  // be called from several threads.
  void apply(std::span<float> rgb) const;

  // Whether a channel's display value depends on the other channels.
  bool mixes_channels() const;

 private:
  struct Processor;
  std::unique_ptr<const Processor> processor_;
};

}  // namespace compositing
