// GigE Vision and USB3 Vision cameras: which there are, and their features.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "capture/camera.h"
#include "capture/camera_settings.h"

struct _ArvCamera;
struct _GError;

namespace capture {

struct AravisCloser {
  void operator()(_ArvCamera* camera) const;
};
using AravisHandle = std::unique_ptr<_ArvCamera, AravisCloser>;

// What a call of the library says when it fails.
class AravisError {
 public:
  AravisError() = default;
  ~AravisError();
  AravisError(const AravisError&) = delete;
  AravisError& operator=(const AravisError&) = delete;

  _GError** operator&() { return &error_; }
  explicit operator bool() const { return error_ != nullptr; }
  std::string words() const;
  // Throws std::runtime_error "`what`: ..." if a call failed.
  void check(const std::string& what) const;
  void clear();

 private:
  _GError* error_ = nullptr;
};

// A camera that answered.
struct AravisDevice {
  std::string id;  // "Vendor-Model-Serial"
  std::string vendor;
  std::string model;
  std::string serial;
  std::string address;   // IP address, or where it is plugged in
  std::string protocol;  // "GigEVision", "USB3Vision"
};

// What a camera can be set to.
struct AravisAbilities {
  std::vector<std::string> formats;  // GenICam names, also of those that are not read
  std::optional<PictureSize> smallest;
  std::optional<PictureSize> largest;
  double lowest_rate = 0;  // 0 = not told
  double highest_rate = 0;
  std::optional<ExposureRange> exposures;
};

struct AravisListing {
  struct Entry {
    AravisDevice device;
    AravisAbilities abilities;
    std::string fault;  // why it could not be asked, or ""
  };
  std::vector<Entry> cameras;
};

// All cameras that answer within about a second. Any thread.
std::vector<AravisDevice> find_aravis();
// The same, and what each of them can: it is opened, and closed again.
AravisListing list_aravis();

// The one that is named by id, serial, address, or a part of the id that no other has; "" names the
// only one. Throws std::runtime_error with those that there are. An IPv4 address is not looked for:
// it is the answer's only member.
AravisDevice resolve_aravis(const std::string& name);

// Opens a camera that was resolved. Throws std::runtime_error, without its name.
AravisHandle open_aravis_handle(const AravisDevice& device);

AravisAbilities abilities_of(_ArvCamera& camera);
std::optional<ExposureRange> exposure_range_of(_ArvCamera& camera);

// Sets a GenICam feature from text: a number, 0 or 1, a choice's name; anything starts a command.
// Throws std::runtime_error, without the camera's name, with what was asked and what is possible.
void set_aravis_feature(_ArvCamera& camera, const std::string& name, const std::string& value);

// "Mono8, Mono12"
std::string list_of(const std::vector<std::string>& words);

}  // namespace capture
