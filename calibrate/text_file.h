// Text files, whole, and numbers in them.
#pragma once

#include <string>
#include <string_view>

namespace calibrate {

// The content of a file of at most 64 MB. Throws std::runtime_error with path and reason.
std::string read_text_file(const std::string& path);

// Replaces a file. Throws std::runtime_error with path and reason.
void write_text_file(const std::string& path, std::string_view text);

// A number that reads back as the same double, whatever the locale.
std::string to_text(double value);

// The number that `text` is, all of it; false if it is none.
bool parse_number(std::string_view text, double& value);

}  // namespace calibrate
