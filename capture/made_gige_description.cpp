// GenICam XML of a made GigE Vision camera.
#include "capture/made_gige_description.h"

#include <array>
#include <cstdio>

namespace capture::gige {
namespace {

std::string hex(std::uint32_t value) {
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), "0x%x", value);
  return text.data();
}

std::string number(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.10g", value);
  return text.data();
}

std::string element(const std::string& name, const std::string& content) {
  return "<" + name + ">" + content + "</" + name + ">\n";
}

std::string node(const std::string& kind, const std::string& name, const std::string& content) {
  return "<" + kind + " Name=\"" + name + "\" NameSpace=\"Standard\">\n" + content + "</" + kind +
         ">\n";
}

std::string place(std::uint32_t address, int length, const std::string& access) {
  return element("Address", hex(address)) + element("Length", std::to_string(length)) +
         element("AccessMode", access) + element("pPort", "Device");
}

const std::string unsigned_big = "<Sign>Unsigned</Sign>\n<Endianess>BigEndian</Endianess>\n";
const std::string big = "<Endianess>BigEndian</Endianess>\n";

std::string register_of(const std::string& name,
                        std::uint32_t address,
                        const std::string& access = "RW") {
  return node("IntReg", name + "Register", place(address, 4, access) + unsigned_big);
}

std::string text_feature(const std::string& name, std::uint32_t address, int length) {
  return node("StringReg", name, place(address, length, "RO"));
}

std::string whole_feature(const std::string& name,
                          std::uint32_t address,
                          const std::string& bounds,
                          const std::string& access = "RW") {
  return node("Integer", name, element("pValue", name + "Register") + bounds) +
         register_of(name, address, access);
}

std::string real_feature(const std::string& name,
                         std::uint32_t address,
                         double low,
                         double high,
                         const std::string& unit) {
  return node("Float", name,
              element("pValue", name + "Register") + element("Min", number(low)) +
                  element("Max", number(high)) + element("Unit", unit)) +
         node("FloatReg", name + "Register", place(address, 8, "RW") + big);
}

std::string entry(const std::string& name, std::uint32_t value) {
  return node("EnumEntry", name, element("Value", std::to_string(value)));
}

std::string choice_feature(const std::string& name,
                           std::uint32_t address,
                           const std::string& entries,
                           const std::string& more = "") {
  return node("Enumeration", name, entries + element("pValue", name + "Register") + more) +
         register_of(name, address);
}

std::string command(const std::string& name, std::uint32_t address, int value) {
  return node("Command", name,
              element("pValue", name + "Register") +
                  element("CommandValue", std::to_string(value))) +
         register_of(name, address);
}

std::string category(const std::string& name, std::initializer_list<const char*> features) {
  std::string content;
  for (const char* feature : features) content += element("pFeature", feature);
  return node("Category", name, content);
}

std::string image_features(const MadeDescription& camera) {
  std::string formats;
  for (const GenicamFormat& format : camera.formats) {
    formats += entry(std::string(format.name), format.code);
  }
  const auto within = [](int low, const std::string& high) {
    return element("Min", std::to_string(low)) + element("pMax", high) + element("Inc", "1");
  };
  return category("ImageFormatControl", {"SensorWidth", "SensorHeight", "Width", "Height",
                                         "OffsetX", "OffsetY", "PixelFormat"}) +
         whole_feature("SensorWidth", feature::sensor_width, "", "RO") +
         whole_feature("SensorHeight", feature::sensor_height, "", "RO") +
         whole_feature("Width", feature::width, within(4, "SensorWidth")) +
         whole_feature("Height", feature::height, within(4, "SensorHeight")) +
         whole_feature("OffsetX", feature::offset_x, within(0, "SensorWidth")) +
         whole_feature("OffsetY", feature::offset_y, within(0, "SensorHeight")) +
         choice_feature("PixelFormat", feature::pixel_format, formats);
}

std::string acquisition_features(const MadeDescription& camera) {
  constexpr double us = 1e6;
  return category("AcquisitionControl", {"AcquisitionMode", "AcquisitionStart", "AcquisitionStop",
                                         "AcquisitionFrameRate", "ExposureTime"}) +
         choice_feature("AcquisitionMode", feature::acquisition_mode, entry("Continuous", 0)) +
         command("AcquisitionStart", feature::acquisition, 1) +
         command("AcquisitionStop", feature::acquisition, 0) +
         real_feature("AcquisitionFrameRate", feature::frame_rate, camera.lowest_rate,
                      camera.highest_rate, "Hz") +
         real_feature("ExposureTime", feature::exposure_us, camera.exposures.shortest_s * us,
                      camera.exposures.longest_s * us, "us") +
         category("AnalogControl", {"Gain"}) +
         real_feature("Gain", feature::gain_db, 0, most_gain_db, "dB");
}

std::string transport_features(const MadeDescription& camera) {
  return category("TransportLayerControl", {"PayloadSize", "GevSCPSPacketSize"}) +
         whole_feature("PayloadSize", feature::payload_size, "", "RO") +
         node("Integer", "GevSCPSPacketSize",
              element("pValue", "GevSCPSPacketSizeRegister") + element("Min", "220") +
                  element("Max", std::to_string(camera.largest_packet)) + element("Inc", "4")) +
         node("MaskedIntReg", "GevSCPSPacketSizeRegister",
              place(0x0d04, 4, "RW") + element("LSB", "31") + element("MSB", "16") + unsigned_big);
}

std::string chunk_features() {
  const std::string selector = "ChunkSelector";
  const auto port = [](const std::string& name, std::uint32_t chunk) {
    return node("Port", name + "Port", element("ChunkID", hex(chunk_id(chunk)).substr(2)));
  };
  const auto chunk_place = [](const std::string& name) {
    return element("Address", "0x0") + element("Length", "8") + element("AccessMode", "RO") +
           element("pPort", name + "Port");
  };
  return category("ChunkDataControl", {"ChunkModeActive", "ChunkSelector", "ChunkEnable",
                                       "ChunkExposureTime", "ChunkTimestamp", "ChunkFrameID"}) +
         node("Boolean", "ChunkModeActive",
              element("pValue", "ChunkModeActiveRegister") + element("OnValue", "1") +
                  element("OffValue", "0")) +
         register_of("ChunkModeActive", feature::chunk_mode) +
         choice_feature(selector, feature::chunk_selector,
                        entry("ExposureTime", exposure_chunk) +
                            entry("Timestamp", timestamp_chunk) + entry("FrameID", frame_id_chunk),
                        element("pSelected", "ChunkEnable")) +
         node("Boolean", "ChunkEnable",
              element("pValue", "ChunkEnableRegister") + element("OnValue", "1") +
                  element("OffValue", "0")) +
         node("IntReg", "ChunkEnableRegister",
              place(feature::chunk_enable, 4, "RW") + "<pIndex Offset=\"4\">" + selector +
                  "</pIndex>\n" + unsigned_big) +
         node("FloatReg", "ChunkExposureTime", chunk_place("ChunkExposureTime") + big) +
         port("ChunkExposureTime", exposure_chunk) +
         node("IntReg", "ChunkTimestamp", chunk_place("ChunkTimestamp") + unsigned_big) +
         port("ChunkTimestamp", timestamp_chunk) +
         node("IntReg", "ChunkFrameID", chunk_place("ChunkFrameID") + unsigned_big) +
         port("ChunkFrameID", frame_id_chunk);
}

}  // namespace

std::string describe_made(const MadeDescription& camera) {
  std::string content =
      "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
      "<RegisterDescription ModelName=\"MadeGigE\" VendorName=\"Platelight\" "
      "StandardNameSpace=\"GEV\" SchemaMajorVersion=\"1\" SchemaMinorVersion=\"1\" "
      "SchemaSubMinorVersion=\"0\" MajorVersion=\"1\" MinorVersion=\"0\" SubMinorVersion=\"0\" "
      "ToolTip=\"Made camera\" ProductGuid=\"0\" VersionGuid=\"0\" "
      "xmlns=\"http://www.genicam.org/GenApi/Version_1_1\">\n";
  content += camera.has_chunks
                 ? category("Root", {"DeviceControl", "ImageFormatControl", "AcquisitionControl",
                                     "AnalogControl", "TransportLayerControl", "ChunkDataControl"})
                 : category("Root", {"DeviceControl", "ImageFormatControl", "AcquisitionControl",
                                     "AnalogControl", "TransportLayerControl"});
  content += category("DeviceControl",
                      {"DeviceVendorName", "DeviceModelName", "DeviceVersion", "DeviceID"});
  content += text_feature("DeviceVendorName", 0x48, 32) +
             text_feature("DeviceModelName", 0x68, 32) + text_feature("DeviceVersion", 0x88, 32) +
             text_feature("DeviceID", 0xd8, 16);
  content += image_features(camera) + acquisition_features(camera) + transport_features(camera);
  if (camera.has_chunks) content += chunk_features();
  return content + node("Port", "Device", "") + "</RegisterDescription>\n";
}

}  // namespace capture::gige
