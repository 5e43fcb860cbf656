// The newest picture, written about as often as eyes ask for it.
#include "studio/picture_file.h"

#include <exception>
#include <utility>

#include "capture/png.h"

namespace studio {

PictureFile::PictureFile(std::string path,
                         int width,
                         int height,
                         std::chrono::milliseconds period,
                         std::function<void(const std::string&)> failed,
                         capture::Rational pixel_aspect)
    : path_(std::move(path)),
      width_(width),
      height_(height),
      period_(period),
      failed_(std::move(failed)),
      pixel_aspect_(pixel_aspect),
      thread_([this](const std::stop_token& stop) { write_on(stop); }) {}

void PictureFile::show(Codes rgb8) {
  const std::lock_guard lock(mutex_);
  next_.swap(rgb8);
  shown_.notify_all();
}

void PictureFile::write_on(const std::stop_token& stop) {
  bool fails = false;
  while (true) {
    Codes picture;
    {
      std::unique_lock lock(mutex_);
      if (!shown_.wait(lock, stop, [&] { return next_ != nullptr; })) return;
      if (stop.stop_requested()) return;  // finish() writes it
      picture = next_;
    }
    const auto begin = std::chrono::steady_clock::now();
    try {
      capture::write_png(path_, width_, height_, 3, *picture, pixel_aspect_);
      fails = false;
    } catch (const std::exception& error) {
      if (!std::exchange(fails, true)) failed_(error.what());
    }
    std::unique_lock lock(mutex_);
    if (!fails && next_ == picture) next_.reset();
    shown_.wait_until(lock, stop, begin + period_, [] { return false; });
  }
}

void PictureFile::finish() {
  thread_ = {};
  if (const Codes last = std::exchange(next_, nullptr)) {
    capture::write_png(path_, width_, height_, 3, *last, pixel_aspect_);
  }
}

}  // namespace studio
