// A GigE Vision camera in this process: real packets on the loopback network, made pictures.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "capture/camera.h"
#include "capture/made_sensor.h"

namespace capture {

// What a picture of a made camera is asked for with.
struct MadeGigeShot {
  std::int64_t number = 0;  // counts exposures from 0, since the camera was plugged in
  double exposure_s = 0;    // of this one, whatever is set meanwhile
  double gain = 1;          // linear; the feature Gain is in dB
};

// Codes of the whole sensor: (height, width, 1 or 3). Of three channels, a Bayer format takes that
// of each site, a grey one the second. More bits than the format has are cut off at the low end.
// Called by the camera's own thread, for one shot after the other.
using MadeGigePicture = std::function<MadeShot(const MadeGigeShot&)>;

struct MadeGigeSettings {
  std::string serial;  // at most 15 characters; "" = made of its address
  int width = 256;     // of the sensor, >= 4
  int height = 256;
  std::vector<std::string> formats{"Mono12"};  // as genicam_formats() has them; set is the first
  double rate = 30;                            // frames a second, that are set at first
  double highest_rate = 1000;
  ExposureRange exposures{20e-6, 20};  // an exposure that is longer than a frame slows the camera
  double exposure_s = 0.005;           // that is set at first
  double exposure_step_s = 1e-6;       // exposures are rounded to steps
  // Frames that start after an exposure was written, and still have the one before.
  int exposure_lag = 2;
  std::uint16_t first_block = 65400;  // the first frame's number in the stream, of 1 .. 65535
  bool has_chunks = false;            // tells exposure, time and number with each frame
  bool resends = true;                // packets that are asked for again
  double packet_loss = 0;             // share of packets that are never sent, 0 to 1
  double drop_share = 0;              // of frames that are counted and not sent
  double repeat_share = 0;            // of frames that show the picture before once more
  std::uint64_t seed = 1;             // of what is lost
  double clock_rate = 1;              // of its time stamps against true time
  double link_bits_per_s = 4e9;
};

struct MadeGigeCounts {
  std::int64_t exposed = 0;
  std::int64_t dropped = 0;
  std::int64_t repeated = 0;
  std::int64_t packets = 0;       // that were to be sent, also again
  std::int64_t lost_packets = 0;  // of these
  std::int64_t resent_packets = 0;
  std::string fault;  // why a picture could not be made, the last time; its frame is dropped
};

// A GigE Vision 1.2 device with GenICam features (Width, Height, OffsetX, OffsetY, PixelFormat,
// AcquisitionFrameRate, ExposureTime in us, Gain in dB, chunks), at a loopback address of its own,
// 127.x.y.z: any number of them run at the same time, in this process and others, and none needs
// rights. It is found by discovery from 127.0.0.1 only. Time stamps are those of the exposures'
// starts. One application controls it; without a sign of life from that one for the heartbeat's
// time (3 s, or what it sets) the camera stops.
class MadeGigeCamera {
 public:
  // Throws std::invalid_argument for settings out of their ranges, std::runtime_error if there is
  // no loopback network.
  MadeGigeCamera(const MadeGigeSettings& settings, MadeGigePicture picture);
  ~MadeGigeCamera();
  MadeGigeCamera(const MadeGigeCamera&) = delete;
  MadeGigeCamera& operator=(const MadeGigeCamera&) = delete;

  const std::string& address() const;  // "127.1.2.3"
  const std::string& serial() const;
  std::string uri() const { return "aravis:" + address(); }
  MadeGigeCounts counts() const;

  // As if its cable were pulled: it answers nothing and forgets what was set. Twice has no effect.
  void unplug();
  // The same camera again, as it was made. Throws std::runtime_error if its address was taken.
  void plug_in();
  void drop_next(int frames);        // so many are counted and not sent
  void hide_exposures(bool hidden);  // tells 0 for the one that is set
  void set_packet_loss(double share);
  void set_exposure_lag(int frames);

 private:
  struct Device;
  std::unique_ptr<Device> device_;
};

// Pictures of a scene through a made sensor: `radiance` gives what exposure `number` sees. Gain
// fills the codes with so many fewer electrons. The sensor's seed tells one camera's noise from
// another's.
MadeGigePicture made_picture(
    const MadeSensor& sensor,
    std::function<std::shared_ptr<const Image>(std::int64_t number)> radiance);

}  // namespace capture
