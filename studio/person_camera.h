// One camera of a person, frame by frame: its video, keyed, and what it sees of the person.
#pragma once

#include <array>
#include <cstdint>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "capture/half.h"
#include "capture/pool.h"
#include "compositing/feet.h"
#include "compositing/keyed_texture.h"
#include "compositing/keyer.h"
#include "compositing/picture_window.h"
#include "render/live_picture.h"
#include "studio/clean_plates.h"
#include "studio/file_times.h"
#include "studio/plate_taking.h"
#include "studio/set.h"
#include "studio/timed_source.h"

namespace studio {

// A picture of nobody.
std::shared_ptr<const render::LivePicture> clear_picture();

// One thread uses it. A source that ends or stalls holds its last picture.
class PersonCameraFeed {
 public:
  struct Options {
    std::string base_dir;
    std::optional<capture::Time> start;  // as TimedSource has it
    bool live = false;
    bool needs_matte = false;  // keyed by whole frames whatever the settings
    bool bounded = false;      // pictures say where they are empty: for hulls
    friend bool operator==(const Options&, const Options&) = default;
  };
  // Opens the source, or goes on with that of `before`, which is then of no more use; reads plate
  // and masks. Adds faults at their places; is of no use then. May be made while `before` runs.
  // `held`: what to add to why the source cannot be opened.
  PersonCameraFeed(const PersonCamera& settings,
                   const Options& options,
                   Faults& faults,
                   const PersonCameraFeed* before = nullptr,
                   const std::string& held = "");

  // Whether another one would show just the same, so that this one may go on in its place: its
  // plate and masks are those that are on disk, too. `start` does not count.
  bool serves(const PersonCamera& settings, const Options& options) const;
  // Whether another one could go on with this one's source.
  bool has_source_of(const PersonCamera& settings) const;
  // As words_for_held() of timed_source.h; "" where this holds no such device.
  std::string words_for_held(const PersonCamera& asked, const std::string& holder) const;

  const PersonCamera& settings() const { return settings_; }
  float aspect() const { return aspect_; }  // of its picture: width over height

  // Goes on to the newest frame at the show's time, and keys nothing yet.
  void advance(capture::Time time);
  // Whether any frame has come with a picture.
  bool has_picture() const { return image_ != nullptr; }
  // Of the newest frame.
  capture::Time time() const { return time_; }
  // In which pass of a clip that loops: another one, another number.
  std::int64_t pass() const { return pass_; }
  // How old its picture is at the time that was asked for last, and how long a frame lasts.
  capture::Time age() const { return source_->age(); }
  capture::Time period() const { return period_; }
  std::vector<std::string> take_notes();
  // Whether the plate is not there yet: it is being taken of the frames that come, and nobody is
  // shown.
  bool takes_plate() const { return taking_ && !keyer_; }

  // Keys the newest frame, unless it is already. True if it did.
  bool show();

  // What follows is of the frame that was shown last. Of a camera whose pose is not known, the
  // picture is the part of the video in which anybody is; window() says which.
  const std::shared_ptr<const render::LivePicture>& picture() const { return picture_; }
  const compositing::Window& window() const { return window_; }
  float confidence() const { return confidence_; }
  std::string_view key() const { return key_; }
  // How far the picture has gone from its plate, if the camera was moved.
  const std::optional<compositing::PlateShift>& moved() const { return moved_; }
  // Share of the picture in which the screen is where the plate shows something else.
  float ghost() const { return ghost_; }
  const compositing::Feet& feet() const { return feet_; }
  bool sees_nobody() const { return has_matte_ && feet_.status == compositing::FeetStatus::absent; }
  // Edges of the person, and of all that may be its, in pixels: left, top, right, bottom. The whole
  // picture where there is no matte.
  std::array<float, 4> person_box() const;
  std::array<float, 4> outline() const;

 private:
  compositing::CleanPlate read_plate(const VideoSource& source, const ShownPart& shown) const;
  void begin_key(const VideoSource& source, const PersonCameraFeed* before);
  void check_length() const;
  void keep_garbage(const compositing::KeyMasks& masks);
  void make_keyer(const compositing::CleanPlate& plate, compositing::KeyMasks masks);
  void go_on_with_plate(bool good);
  void take_plate(bool good);
  void give_up_plate(const std::string& why);
  void key_frame();
  void show_keyed(std::shared_ptr<const compositing::KeyedTexture> texture);
  void look_for_person(const compositing::KeyedFrame& keyed);
  std::array<float, 4> whole() const;

  PersonCamera settings_;
  Options options_;
  FileTimes times_;  // of response, plate and masks, when they were read
  bool by_texel_ = false;
  VideoSource opened_;  // as source_ was
  std::shared_ptr<TimedSource> source_;
  std::unique_ptr<compositing::Keyer> keyer_;
  std::shared_ptr<PlateTaking> taking_;  // of plates that are taken
  bool plate_failed_ = false;
  std::size_t same_picture_for_ = 0;  // frames of the show, while a file's plate is taken
  std::shared_ptr<const compositing::CleanPlate> plate_before_;  // if one is taken anew
  compositing::KeyMasks masks_;  // for the key, once the plate is there
  capture::Image garbage_;       // of the matte's size, where feet are looked for
  std::future<std::unique_ptr<compositing::Keyer>> coming_keyer_;
  std::vector<std::string> notes_;
  float aspect_ = 1;
  capture::Time period_{}, time_{};
  std::shared_ptr<const capture::Image> image_, shown_;  // newest; that the picture was made from
  bool skipped_ = false;  // frames between these two, or they are of two passes
  std::int64_t pass_ = 0;
  std::shared_ptr<const render::LivePicture> picture_;
  compositing::Window window_;
  capture::Pool<compositing::KeyedTexture> textures_;
  float confidence_ = 1;
  std::string_view key_ = "none";
  std::optional<compositing::PlateShift> moved_;
  float ghost_ = 0;
  compositing::Feet feet_;
  bool has_matte_ = false;
  std::optional<std::array<float, 4>> outline_;
};

}  // namespace studio
