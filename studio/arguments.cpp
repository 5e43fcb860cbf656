// Arguments through CLI11.
#include "studio/arguments.h"

#include <cmath>
#include <cstdlib>

#include <CLI/CLI.hpp>

namespace studio {
namespace {

// NaN is in every range, as CLI11 compares.
std::string refuse_nan(const std::string& given) {
  return std::isnan(std::strtod(given.c_str(), nullptr)) ? given + " is not a number" : "";
}

// CLI11 takes numbers that begin with a zero as octal ones.
std::string without_leading_zeros(std::string given) {
  const std::size_t first = given.starts_with('-') || given.starts_with('+') ? 1 : 0;
  const auto is_digit = [&](std::size_t i) {
    return i < given.size() && given[i] >= '0' && given[i] <= '9';
  };
  while (is_digit(first) && given[first] == '0' && is_digit(first + 1)) given.erase(first, 1);
  return given;
}

}  // namespace

void Arguments::positional(const std::string& name, std::string& target, const std::string& help) {
  app_->add_option(name, target, help)->required()->type_name("");
}

void Arguments::optional_positional(const std::string& name,
                                    std::string& target,
                                    const std::string& help) {
  app_->add_option(name, target, help)->type_name("");
}

void Arguments::positionals(const std::string& name,
                            std::vector<std::string>& target,
                            const std::string& help) {
  app_->add_option(name, target, help)->required()->type_name("");
}

void Arguments::option(const std::string& names, std::string& target, const std::string& help) {
  app_->add_option(names, target, help)->type_name("TEXT")->check([](const std::string& given) {
    return given.empty() ? std::string("must not be empty") : std::string();
  });
}

void Arguments::option(const std::string& names,
                       std::optional<std::int64_t>& target,
                       std::int64_t low,
                       std::int64_t high,
                       const std::string& help) {
  app_->add_option(names, target, help)
      ->type_name("N")
      ->transform(without_leading_zeros)
      ->check(CLI::Range(low, high));
}

void Arguments::option(const std::string& names,
                       std::optional<double>& target,
                       double low,
                       double high,
                       const std::string& help) {
  app_->add_option(names, target, help)
      ->type_name("X")
      ->check(CLI::Range(low, high))
      ->check(refuse_nan);
}

void Arguments::choices(const std::string& names,
                        std::vector<std::string>& target,
                        const std::vector<std::string>& choices,
                        const std::string& help) {
  std::string list;
  for (const std::string& choice : choices) list += (list.empty() ? "" : ",") + choice;
  app_->add_option(names, target, help)
      ->delimiter(',')
      ->allow_extra_args(false)
      ->type_name(list)
      ->check(CLI::IsMember(choices));
}

void Arguments::choice(const std::string& names,
                       std::string& target,
                       const std::vector<std::string>& choices,
                       const std::string& help) {
  std::string list;
  for (const std::string& choice : choices) list += (list.empty() ? "" : "|") + choice;
  app_->add_option(names, target, help)->type_name(list)->check(CLI::IsMember(choices));
}

void Arguments::repeated(const std::string& names,
                         std::vector<std::string>& target,
                         const std::string& help) {
  app_->add_option(names, target, help)->type_name("TEXT")->allow_extra_args(false);
}

void Arguments::flag(const std::string& names, bool& target, const std::string& help) {
  app_->add_flag(names, target, help);
}

void Arguments::required(const std::string& name) { app_->get_option(name)->required(); }

}  // namespace studio
