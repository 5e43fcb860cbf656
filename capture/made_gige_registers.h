// The memory of a made GigE Vision camera, and what may be written to it.
#pragma once

#include <cstdint>
#include <string>

#include "capture/gige_wire.h"
#include "capture/made_gige.h"
#include "capture/made_gige_description.h"

namespace capture::gige {

// A part of the sensor.
struct Region {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
};

// Not thread-safe.
class MadeRegisters {
 public:
  // As they are when the camera gets power. `address` is its IPv4 address.
  MadeRegisters(const MadeGigeSettings& settings, std::uint32_t address, const std::string& serial);

  // The answer's data to a read, or why there is none. `size` is a whole number of registers.
  Status read(std::uint32_t address, std::size_t size, Bytes& data) const;
  // Takes nothing of what it refuses.
  Status write(std::uint32_t address, ByteSpan data);

  std::uint32_t value(std::uint32_t address) const { return get32(memory_.data() + address); }
  void set(std::uint32_t address, std::uint32_t value);
  double real(std::uint32_t address) const;
  bool running() const { return value(feature::acquisition) != 0; }
  Region region() const;
  const GenicamFormat& format() const;
  bool has_chunk(std::uint32_t chunk) const;
  // Exposures are rounded to steps, and into their range, as they are written.
  double exposure_s() const { return real(feature::exposure_us) * 1e-6; }

 private:
  void set_real(std::uint32_t address, double value);
  void set_text(std::uint32_t address, const std::string& text, std::size_t size);
  Status settle(std::uint32_t address, std::size_t size);
  void tell_payload();

  MadeGigeSettings settings_;
  Bytes memory_;  // of all registers, and then the description
};

}  // namespace capture::gige
