// Makes compositing/key_table.inc anew: make-key-table > compositing/key_table.inc (a minute).
#include <iostream>
#include <string>

#include "compositing/key_training.h"

namespace {

void print(const compositing::PlaceCodes& codes) {
  std::cout << '{';
  std::string line;
  for (const std::uint8_t code : codes) {
    const std::string number = std::to_string(code) + ",";
    if (line.size() + number.size() > 100) {
      std::cout << line << '\n';
      line.clear();
    }
    line += number;
  }
  std::cout << line << '}';
}

}  // namespace

int main() {
  const compositing::TableCodes codes = compositing::train_key_table(compositing::training_seeds);
  std::cout
      << "// Alpha and plate codes by hue, share and light, near the screen, then deep within\n"
      << "// what stands before it: written by make-key-table.\n"
      << "// clang-format off\n";
  print(codes.near);
  std::cout << ",\n";
  print(codes.deep);
}
