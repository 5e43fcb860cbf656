// Cameras that show picture files one after the other.
#include "capture/picture_camera.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "capture/coded_file.h"
#include "capture/exif.h"
#include "capture/exr.h"
#include "capture/files.h"
#include "capture/media_file.h"
#include "capture/pool.h"
#include "capture/rgbe.h"
#include "capture/still.h"

namespace capture {
namespace {

std::string ending_of(const std::string& path) {
  std::string ending = std::filesystem::path(path).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending;
}

bool is_exr(const std::string& path) { return ending_of(path) == ".exr"; }

bool is_radiance(const std::string& path) {
  const std::string ending = ending_of(path);
  return ending == ".hdr" || ending == ".pic";
}

// Grey is repeated; alpha is limited to 0..1, no number being 0, or left out.
Image as_colour(Image image, bool alpha) {
  if (image.channels == 3) {
    return image;
  }
  if (alpha && image.channels == 4) {
    for (std::size_t i = 3; i < image.pixels.size(); i += 4) {
      float& its = image.pixels[i];
      its = its > 0 ? std::min(its, 1.0F) : 0.0F;
    }
    return image;
  }
  Image colour = make_image(image.height, image.width);
  const std::size_t step = image.channels < 3 ? 0 : 1;
  const auto channels = static_cast<std::size_t>(image.channels);
  for (std::size_t i = 0; i < colour.pixels.size(); ++i) {
    colour.pixels[i] = image.pixels[i / 3 * channels + i % 3 * step];
  }
  return colour;
}

// Reads any picture file as three channels of light, or four where alpha is asked for: OpenEXR and
// Radiance pictures, by their endings (.exr, .hdr, .pic), are light already; other stills and
// recorded pictures become it.
class PictureReader {
 public:
  explicit PictureReader(const LightCurves& curves)
      : stills_(curves), coded_(curves), alpha_(curves.alpha) {}

  // Into `image` as it is if it has the size. Returns the description. Throws std::runtime_error
  // with path, reason and what to do.
  std::string read(const std::string& path, Image& image) {
    pixel_aspect_ = {1, 1};
    if (is_coded_file(path)) return coded_.read(path, image);
    if (!is_exr(path) && !is_radiance(path)) return read_still(path, stills_, image);
    check_is_file(path);
    ExrPicture picture = is_exr(path) ? read_exr_picture(path) : ExrPicture{read_rgbe(path)};
    if (is_exr(path)) limit_infinite(picture.image);
    image = as_colour(std::move(picture.image), alpha_);
    pixel_aspect_ = picture.pixel_aspect;
    const std::string words = is_exr(path) ? "OpenEXR, linear" : "Radiance, linear";
    return image.channels == 4 ? words + ", alpha" : words;
  }

  // Of the picture that was read last: 1/1 where it tells none.
  Rational pixel_aspect() const { return pixel_aspect_; }

 private:
  Lineariser stills_;
  CodedFileReader coded_;
  bool alpha_;
  Rational pixel_aspect_{1, 1};
};

class PictureCamera : public Camera {
 public:
  PictureCamera(const std::string& name,
                std::vector<PictureEntry> entries,
                Rational rate,
                const CameraOptions& options,
                const LightCurves& curves,
                Time jitter);

  const CameraInfo& info() const override { return info_; }
  std::optional<Frame> next() override { return pass(true); }
  bool skip() override { return pass(false).has_value(); }
  CameraStatistics statistics() const override { return statistics_; }

 private:
  std::optional<Frame> pass(bool reads_picture);
  // The picture of an entry. Throws std::runtime_error.
  std::shared_ptr<const Image> load(std::size_t entry);

  std::vector<PictureEntry> entries_;
  PictureReader reader_;
  bool loop_;
  Pool<Image> pool_;
  int source_width_ = 0;
  int source_height_ = 0;
  int channels_ = 0;
  Crop crop_;
  CameraInfo info_;
  Time pass_length_{};

  std::size_t loaded_entry_;  // of last_image_
  bool shown_ = false;        // a good picture was given
  std::shared_ptr<const Image> last_image_;
  std::size_t entry_ = 0;  // of the next frame
  std::int64_t number_ = 0;
  std::int64_t pass_first_ = 0;
  Time pass_start_{};
  CameraStatistics statistics_;
};

PictureCamera::PictureCamera(const std::string& name,
                             std::vector<PictureEntry> entries,
                             Rational rate,
                             const CameraOptions& options,
                             const LightCurves& curves,
                             Time jitter)
    : entries_(std::move(entries)),
      reader_(curves),
      loop_(options.loop),
      loaded_entry_(entries_.size()) {
  const auto fail = [&](const std::string& why) {
    throw std::runtime_error("cannot open " + name + why);
  };
  number_ = options.frame.value_or(0);
  if (number_ < 0 || number_ >= static_cast<std::int64_t>(entries_.size())) {
    fail(" at frame " + std::to_string(number_) + ": it has " + std::to_string(entries_.size()) +
         (entries_.size() == 1 ? " frame" : " frames") + ", counted from 0");
  }
  entry_ = static_cast<std::size_t>(number_);
  std::string reason;
  for (std::size_t i = entry_; i < entries_.size() && !last_image_; ++i) {
    try {
      const std::shared_ptr<Image> image = pool_.lend();
      info_.description = reader_.read(entries_[i].path, *image);
      source_width_ = image->width;
      source_height_ = image->height;
      channels_ = image->channels;
      crop_ = crop_within(options.crop, source_width_, source_height_);
      cut(*image, crop_);
      last_image_ = image;
      loaded_entry_ = i;
      info_.pixel_aspect = reader_.pixel_aspect();
    } catch (const std::runtime_error& error) {
      if (source_width_ > 0) {
        fail(std::string(": ") + error.what());
      }
      if (reason.empty() && !entries_[i].path.empty()) {
        reason = error.what();
      }
    }
  }
  if (!last_image_) {
    fail(": no picture can be read" + (reason.empty() ? "" : "; " + reason));
  }
  info_.width = crop_.width;
  info_.height = crop_.height;
  info_.whole_width = source_width_;
  info_.whole_height = source_height_;
  info_.rate = rate;
  info_.jitter = jitter;
  info_.frames = loop_ ? 0 : static_cast<std::int64_t>(entries_.size());
  const Time step = entries_.size() > 1 ? entries_.back().time - entries_[entries_.size() - 2].time
                                        : time_of_frame(1, options.picture_rate);
  pass_length_ = entries_.back().time + step;
}

std::shared_ptr<const Image> PictureCamera::load(std::size_t entry) {
  if (entry == loaded_entry_) {
    return last_image_;
  }
  const std::shared_ptr<Image> image = pool_.lend();
  reader_.read(entries_[entry].path, *image);
  if (image->width != source_width_ || image->height != source_height_) {
    throw std::runtime_error(entries_[entry].path + " has another size than the first picture");
  }
  if (image->channels != channels_) {
    throw std::runtime_error(entries_[entry].path +
                             (image->channels == 4 ? " has alpha, and the first picture has none"
                                                   : " has no alpha, but the first picture has"));
  }
  loaded_entry_ = entry;
  cut(*image, crop_);
  return image;
}

std::optional<Frame> PictureCamera::pass(bool reads_picture) {
  if (entry_ == entries_.size()) {
    if (!loop_) {
      return std::nullopt;
    }
    entry_ = 0;
    pass_first_ = number_;
    pass_start_ += pass_length_;
  }
  const PictureEntry& entry = entries_[entry_];
  Frame frame;
  frame.number = number_++;
  frame.pass_first = pass_first_;
  frame.time = pass_start_ + entry.time;
  frame.exposure_s = entry.exposure_s;
  frame.status = entry.status;
  frame.note = entry.note;
  if (reads_picture && !entry.path.empty() && entry.status != FrameStatus::lost) {
    try {
      last_image_ = load(entry_);
      shown_ = true;
    } catch (const std::runtime_error& error) {
      frame.status = FrameStatus::lost;
      frame.note = error.what();
    }
  }
  // Before the first good picture there is none, although one was read ahead for its size.
  frame.image = shown_ ? last_image_ : nullptr;
  ++entry_;
  ++statistics_.delivered;
  statistics_.lost += frame.status == FrameStatus::lost ? 1 : 0;
  statistics_.damaged += frame.status == FrameStatus::damaged ? 1 : 0;
  return frame;
}

}  // namespace

bool is_picture(const std::string& path) {
  return is_exr(path) || is_radiance(path) || is_coded_file(path) || is_still(path);
}

double exposure_in(const std::string& path) {
  if (is_exr(path) || is_radiance(path) || is_coded_file(path)) {
    return 0;
  }
  const double marked_s = shot_settings(read_file(path)).exposure_s;
  return marked_s > 0 ? snapped_exposure_s(marked_s) : 0;
}

std::unique_ptr<Camera> make_picture_camera(const std::string& name,
                                            std::vector<PictureEntry> entries,
                                            Rational rate,
                                            const CameraOptions& options,
                                            const LightCurves& curves,
                                            Time jitter) {
  if (entries.empty()) {
    throw std::invalid_argument("a camera without pictures");
  }
  return std::make_unique<PictureCamera>(name, std::move(entries), rate, options, curves, jitter);
}

}  // namespace capture
