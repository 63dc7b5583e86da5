// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// What bench_pinocchio.py compares fastcal with: pinocchio's C++ over the rows of a file, one thread.
//
//   pinocchio_rows CHAIN.bin Q.bin OUT.bin
//
// CHAIN.bin: (n + 1, 4, 4) doubles, column by column, the place of each joint, which turns about its z, on the one
// before it, then that of the tool; Q.bin: (N, n). OUT.bin gets the tool's position in each row, (N, 3).
//
// Prints the CPU seconds of N forward kinematics with the tool's frame, and of N of these with the regressor of all
// joint placements behind them.
#include <cmath>
#include <ctime>
#include <fstream>
#include <iostream>
#include <pinocchio/algorithm/frames.hpp>
#include <pinocchio/algorithm/kinematics.hpp>
#include <pinocchio/algorithm/regressor.hpp>
#include <string>
#include <vector>

namespace {

double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

std::vector<double> numbers(const char* path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  std::vector<double> out(static_cast<std::size_t>(file.tellg()) / sizeof(double));
  file.seekg(0).read(reinterpret_cast<char*>(out.data()), static_cast<std::streamsize>(out.size() * sizeof(double)));
  return out;
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 4) return 2;
  pinocchio::Model model;
  const std::vector<double> chain = numbers(arguments[1]);
  const auto placement = [&chain](std::size_t k) {
    return pinocchio::SE3(Eigen::Map<const Eigen::Matrix4d>(&chain[16 * k]));
  };
  const std::size_t joints = chain.size() / 16 - 1;
  for (std::size_t k = 0; k < joints; ++k)
    model.addJoint(k, pinocchio::JointModelRZ(), placement(k), "joint" + std::to_string(k + 1));
  model.addFrame({"tool", joints, 0, placement(joints), pinocchio::OP_FRAME});
  pinocchio::Data data(model);
  const std::vector<double> given = numbers(arguments[2]);
  const Eigen::Map<const Eigen::MatrixXd> q(given.data(), model.nq, static_cast<Eigen::Index>(given.size()) / model.nq);
  const pinocchio::FrameIndex tool = model.nframes - 1;
  Eigen::MatrixXd at(3, q.cols());

  double start = cpu_seconds();
  for (Eigen::Index i = 0; i < q.cols(); ++i) {
    pinocchio::forwardKinematics(model, data, q.col(i));
    at.col(i) = pinocchio::updateFramePlacement(model, data, tool).translation();
  }
  const double forward = cpu_seconds() - start;

  pinocchio::Data::Matrix6x J = pinocchio::Data::Matrix6x::Zero(6, 6 * (model.njoints - 1));
  double sum = 0;  // so that nothing is left out
  start = cpu_seconds();
  for (Eigen::Index i = 0; i < q.cols(); ++i) {
    pinocchio::forwardKinematics(model, data, q.col(i));
    pinocchio::updateFramePlacement(model, data, tool);
    pinocchio::computeFrameKinematicRegressor(model, data, tool, pinocchio::LOCAL_WORLD_ALIGNED, J);
    sum += J(0, 0);
  }
  const double regressor = cpu_seconds() - start;
  std::ofstream(arguments[3], std::ios::binary)
      .write(reinterpret_cast<const char*>(at.data()), static_cast<std::streamsize>(at.size() * sizeof(double)));
  std::cout.precision(9);
  std::cout << forward << ' ' << regressor << '\n';
  return std::isfinite(sum) ? 0 : 1;
}
