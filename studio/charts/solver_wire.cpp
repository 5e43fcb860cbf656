// Questions to other tools' solvers, and their answers.
#include "studio/charts/solver_wire.h"

namespace studio {

std::vector<double> to_doubles(const SolverQuestion& question) {
  const calibrate::LensProblem& problem = question.problem;
  std::vector<double> doubles{
      static_cast<double>(question.model),      static_cast<double>(problem.width),
      static_cast<double>(problem.height),      static_cast<double>(problem.board.columns),
      static_cast<double>(problem.board.rows),  problem.board.square_m,
      static_cast<double>(problem.views.size())};
  for (const calibrate::BoardView& view : problem.views) {
    for (const auto& q : view.corners) {
      doubles.push_back(q ? q->x : 0);
      doubles.push_back(q ? q->y : 0);
      doubles.push_back(q ? 1 : -1);
    }
  }
  return doubles;
}

std::optional<SolverQuestion> read_question(std::FILE* file) {
  std::vector<double> head(7);
  if (std::fread(head.data(), sizeof(double), head.size(), file) != head.size()) {
    return std::nullopt;
  }
  SolverQuestion question;
  question.model = static_cast<int>(head[0]);
  calibrate::LensProblem& problem = question.problem;
  problem.width = static_cast<int>(head[1]);
  problem.height = static_cast<int>(head[2]);
  problem.board = {calibrate::Board::Kind::chessboard,
                   static_cast<int>(head[3]),
                   static_cast<int>(head[4]),
                   head[5],
                   0,
                   ""};
  problem.views.resize(static_cast<std::size_t>(head[6]));
  for (calibrate::BoardView& view : problem.views) {
    std::vector<double> corners(3 * problem.board.corner_count());
    if (std::fread(corners.data(), sizeof(double), corners.size(), file) != corners.size()) {
      return std::nullopt;
    }
    for (std::size_t i = 0; i < corners.size(); i += 3) {
      view.corners.emplace_back();
      if (corners[i + 2] > 0) view.corners.back() = calibrate::Vec2{corners[i], corners[i + 1]};
    }
  }
  return question;
}

void write_answer(std::FILE* file, double time_ms, std::span<const double> parameters) {
  const double head[2] = {time_ms, static_cast<double>(parameters.size())};
  std::fwrite(head, sizeof(double), 2, file);
  std::fwrite(parameters.data(), sizeof(double), parameters.size(), file);
}

void write_refusal(std::FILE* file, std::string_view reason) {
  const double head[2] = {0, -static_cast<double>(reason.size())};
  std::fwrite(head, sizeof(double), 2, file);
  std::fwrite(reason.data(), 1, reason.size(), file);
}

}  // namespace studio
