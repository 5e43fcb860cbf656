// Cameras by Aravis.
#include "capture/aravis_device.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <arpa/inet.h>
#include <arv.h>

namespace capture {
namespace {

constexpr std::size_t most_listed = 60;  // names in one message

std::string text_of(const char* text) { return text == nullptr ? std::string() : text; }

// The library keeps one list for all.
std::mutex& list_mutex() {
  static std::mutex mutex;
  return mutex;
}

bool is_address(const std::string& text) {
  in_addr address{};
  return inet_pton(AF_INET, text.c_str(), &address) == 1;
}

std::string words_of(const AravisDevice& device) { return device.id + " at " + device.address; }

[[noreturn]] void refuse_name(const std::string& why, const std::vector<AravisDevice>& devices) {
  std::vector<std::string> words;
  for (const AravisDevice& device : devices) words.push_back(words_of(device));
  throw std::runtime_error(
      why + (words.empty()
                 ? "; no GigE Vision or USB3 Vision camera answers: is it powered, in "
                   "this network, and not held back by a firewall?"
                 : "; there " + std::string(words.size() == 1 ? "is " : "are ") + list_of(words)));
}

std::vector<std::string> names_of_features(ArvDevice* device) {
  std::vector<std::string> names;
  std::vector<std::string> categories{"Root"};
  while (!categories.empty() && names.size() < most_listed) {
    ArvGcNode* node = arv_device_get_feature(device, categories.back().c_str());
    categories.pop_back();
    if (!ARV_IS_GC_CATEGORY(node)) continue;
    for (const GSList* item = arv_gc_category_get_features(ARV_GC_CATEGORY(node)); item != nullptr;
         item = item->next) {
      const std::string name = text_of(static_cast<const char*>(item->data));
      ArvGcNode* feature = arv_device_get_feature(device, name.c_str());
      if (ARV_IS_GC_CATEGORY(feature)) {
        categories.push_back(name);
      } else if (ARV_IS_GC_FEATURE_NODE(feature)) {
        names.push_back(name);
      }
    }
  }
  return names;
}

void set_choice(ArvDevice* device, const std::string& name, const std::string& value) {
  AravisError error;
  arv_device_set_string_feature_value(device, name.c_str(), value.c_str(), &error);
  AravisError read_error;
  const std::string now =
      error ? "" : text_of(arv_device_get_string_feature_value(device, name.c_str(), &read_error));
  if (!error && (read_error || now == value)) return;
  AravisError list_error;
  guint many = 0;
  const char** choices = arv_device_dup_available_enumeration_feature_values_as_strings(
      device, name.c_str(), &many, &list_error);
  std::vector<std::string> words;
  for (guint i = 0; choices != nullptr && i < many; ++i) words.push_back(text_of(choices[i]));
  g_free(choices);
  throw std::runtime_error(name + "=" + value + " was asked for; " +
                           (error ? "it can be " : "the camera sets " + now + " of ") +
                           list_of(words));
}

void set_whole(ArvDevice* device, const std::string& name, const std::string& value) {
  const auto whole = number_in<std::int64_t>(value);
  if (!whole) throw std::runtime_error(name + " takes a whole number, not \"" + value + "\"");
  const std::string asked = name + "=" + value + " was asked for";
  gint64 low = 0;
  gint64 high = 0;
  AravisError error;
  arv_device_get_integer_feature_bounds(device, name.c_str(), &low, &high, &error);
  if (!error && (*whole < low || *whole > high)) {
    throw std::runtime_error(asked + "; it can be " + std::to_string(low) + " to " +
                             std::to_string(high));
  }
  error.clear();
  arv_device_set_integer_feature_value(device, name.c_str(), *whole, &error);
  error.check(asked);
  const gint64 now = arv_device_get_integer_feature_value(device, name.c_str(), &error);
  if (!error && now != *whole) {
    throw std::runtime_error(asked + "; the camera sets " + std::to_string(now) + " instead");
  }
}

void set_real(ArvDevice* device, const std::string& name, const std::string& value) {
  const auto real = number_in<double>(value);
  if (!real || !std::isfinite(*real)) {
    throw std::runtime_error(name + " takes a number, not \"" + value + "\"");
  }
  const std::string asked = name + "=" + value + " was asked for";
  double low = 0;
  double high = 0;
  AravisError error;
  arv_device_get_float_feature_bounds(device, name.c_str(), &low, &high, &error);
  if (!error && (*real < low || *real > high)) {
    throw std::runtime_error(asked + "; it can be " + std::to_string(low) + " to " +
                             std::to_string(high));
  }
  error.clear();
  arv_device_set_float_feature_value(device, name.c_str(), *real, &error);
  error.check(asked);
}

}  // namespace

void AravisCloser::operator()(_ArvCamera* camera) const { g_object_unref(camera); }

AravisError::~AravisError() { clear(); }

void AravisError::clear() { g_clear_error(&error_); }

std::string AravisError::words() const { return error_ == nullptr ? "" : text_of(error_->message); }

void AravisError::check(const std::string& what) const {
  if (error_ != nullptr) throw std::runtime_error(what + ": " + words());
}

std::string list_of(const std::vector<std::string>& words) {
  std::string all;
  for (std::size_t i = 0; i < std::min(words.size(), most_listed); ++i) {
    all += (i == 0 ? "" : ", ") + words[i];
  }
  if (words.size() > most_listed) all += " and more";
  return all.empty() ? "nothing" : all;
}

std::vector<AravisDevice> find_aravis() {
  const std::lock_guard lock(list_mutex());
  arv_update_device_list();
  std::vector<AravisDevice> devices;
  for (unsigned i = 0; i < arv_get_n_devices(); ++i) {
    devices.push_back({text_of(arv_get_device_id(i)), text_of(arv_get_device_vendor(i)),
                       text_of(arv_get_device_model(i)), text_of(arv_get_device_serial_nbr(i)),
                       text_of(arv_get_device_address(i)), text_of(arv_get_device_protocol(i))});
  }
  std::ranges::sort(devices, {}, &AravisDevice::id);
  return devices;
}

AravisListing list_aravis() {
  AravisListing listing;
  for (AravisDevice& device : find_aravis()) {
    AravisListing::Entry entry{std::move(device), {}, {}};
    try {
      entry.abilities = abilities_of(*open_aravis_handle(entry.device));
    } catch (const std::runtime_error& error) {
      entry.fault = error.what();
    }
    listing.cameras.push_back(std::move(entry));
  }
  return listing;
}

AravisDevice resolve_aravis(const std::string& name) {
  if (is_address(name)) return {name, "", "", "", name, "GigEVision"};
  const std::vector<AravisDevice> devices = find_aravis();
  if (name.empty()) {
    if (devices.size() != 1) refuse_name("no camera is named", devices);
    return devices.front();
  }
  for (const auto member : {&AravisDevice::id, &AravisDevice::serial, &AravisDevice::address}) {
    if (std::ranges::count(devices, name, member) == 1) {
      return *std::ranges::find(devices, name, member);
    }
  }
  const auto has_part = [&](const AravisDevice& device) {
    return device.id.find(name) != name.npos;
  };
  const auto many = std::ranges::count_if(devices, has_part);
  if (many != 1) {
    refuse_name(many == 0 ? "no camera is called that" : "several cameras are called that",
                devices);
  }
  return *std::ranges::find_if(devices, has_part);
}

AravisHandle open_aravis_handle(const AravisDevice& device) {
  AravisError error;
  const std::string& name = device.protocol == "GigEVision" ? device.address : device.id;
  AravisHandle camera(arv_camera_new(name.c_str(), &error));
  error.check("the camera cannot be reached");
  if (!camera) throw std::runtime_error("the camera cannot be reached");
  return camera;
}

std::optional<ExposureRange> exposure_range_of(_ArvCamera& camera) {
  AravisError error;
  if (!arv_camera_is_exposure_time_available(&camera, &error) || error) return std::nullopt;
  double low_us = 0;
  double high_us = 0;
  arv_camera_get_exposure_time_bounds(&camera, &low_us, &high_us, &error);
  if (error || !(low_us >= 0 && low_us <= high_us && high_us > 0 && std::isfinite(high_us))) {
    return std::nullopt;
  }
  return ExposureRange{low_us * 1e-6, high_us * 1e-6};
}

AravisAbilities abilities_of(_ArvCamera& camera) {
  AravisAbilities abilities;
  AravisError error;
  guint many = 0;
  const char** names = arv_camera_dup_available_pixel_formats_as_strings(&camera, &many, &error);
  for (guint i = 0; names != nullptr && i < many; ++i)
    abilities.formats.push_back(text_of(names[i]));
  g_free(names);
  error.clear();
  PictureSize low;
  PictureSize high;
  arv_camera_get_width_bounds(&camera, &low.width, &high.width, &error);
  if (!error) arv_camera_get_height_bounds(&camera, &low.height, &high.height, &error);
  if (!error) {
    abilities.smallest = low;
    abilities.largest = high;
  }
  error.clear();
  if (arv_camera_is_frame_rate_available(&camera, &error) && !error) {
    double slow = 0;
    double fast = 0;
    arv_camera_get_frame_rate_bounds(&camera, &slow, &fast, &error);
    if (!error && std::isfinite(slow) && std::isfinite(fast)) {
      abilities.lowest_rate = slow;
      abilities.highest_rate = fast;
    }
  }
  abilities.exposures = exposure_range_of(camera);
  return abilities;
}

void set_aravis_feature(_ArvCamera& camera, const std::string& name, const std::string& value) {
  ArvDevice* device = arv_camera_get_device(&camera);
  ArvGcNode* node = arv_device_get_feature(device, name.c_str());
  if (!ARV_IS_GC_FEATURE_NODE(node) || ARV_IS_GC_CATEGORY(node)) {
    throw std::runtime_error(name + "=" + value + " was asked for; its features are " +
                             list_of(names_of_features(device)));
  }
  AravisError error;
  const std::string asked = name + "=" + value + " was asked for";
  if (!arv_device_is_feature_available(device, name.c_str(), &error) || error) {
    throw std::runtime_error(asked + "; the camera has that feature, but not now");
  }
  if (ARV_IS_GC_COMMAND(node)) {
    arv_device_execute_command(device, name.c_str(), &error);
  } else if (ARV_IS_GC_ENUMERATION(node)) {
    set_choice(device, name, value);
  } else if (ARV_IS_GC_BOOLEAN(node)) {
    if (value != "0" && value != "1") throw std::runtime_error(asked + "; it can be 0 or 1");
    arv_device_set_boolean_feature_value(device, name.c_str(), value == "1", &error);
  } else if (ARV_IS_GC_FLOAT(node)) {
    set_real(device, name, value);
  } else if (ARV_IS_GC_INTEGER(node)) {
    set_whole(device, name, value);
  } else if (ARV_IS_GC_STRING(node)) {
    arv_device_set_string_feature_value(device, name.c_str(), value.c_str(), &error);
  } else {
    throw std::runtime_error(asked + "; it is of a kind that cannot be set");
  }
  error.check(asked);
}

}  // namespace capture
