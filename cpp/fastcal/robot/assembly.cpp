// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/robot/assembly.hpp"

#include <algorithm>
#include <cmath>

#include "fastcal/math/check.hpp"
#include "fastcal/math/decompositions.hpp"
#include "fastcal/math/pivoted_lu.hpp"

namespace fastcal {
namespace {

constexpr double kGap = 1e-12;          // [m], [rad]: closed
constexpr double kRounding = 1e-14;     // the same where a step hardly makes it less
constexpr double kStillClosed = 1e-10;  // the same where rounding leaves more
constexpr int kSteps = 60;
constexpr int kHalvings = 12;
constexpr double kLongest = 0.4;  // [rad], [m]: of a step of Newton's
constexpr double kJump = 0.5;     // [rad], [m]: further in one part of the way is another way of assembly
constexpr double kShortestPart = 1.0 / 1024;
constexpr double kCurved = 0.5;      // of a part's motion that the tangent at its begin may miss
constexpr double kFolded = 0.5;      // of the determinant that a part must leave
constexpr double kStill = 1e-6;      // [rad], [m] of that motion: rounding
constexpr double kSingular = 1e-5;   // of the largest singular value: where it is 0, a gap of kGap leaves its root
constexpr double kDependent = 1e-9;  // equations of which others are the sum, of the largest pivot
constexpr double kFarOpen = 0.05;    // [m], [rad]: more than redundant equations of machined parts may leave
constexpr const char* kHint = " (m or rad); give start_deg or start_mm of the joints so that it nearly does";
constexpr double kDamping = 1e-8;  // where no equation says where a joint goes

Eigen::VectorXd newton_step(const Eigen::MatrixXd& J, const Eigen::VectorXd& e) {
  const Eigen::FullPivLU<Eigen::MatrixXd> lu(J);
  if (lu.isInvertible()) return -solve(lu, e);
  const Eigen::MatrixXd A = J.transpose() * J;
  const Eigen::MatrixXd damped = A + kDamping * (1 + A.trace()) * Eigen::MatrixXd::Identity(A.rows(), A.cols());
  return -solve(Eigen::LDLT<Eigen::MatrixXd>(damped), J.transpose() * e);
}

}  // namespace

Assembler::Assembler(const Chain& chain) : chain_(chain) {}

void Assembler::look(const double* q, const Twists* xi) {
  forward(chain_, q, xi, frames_);
  rows_ = loop_rows(chain_, frames_, q, xi);
  const auto m = static_cast<Eigen::Index>(rows_.size());
  e_.resize(m);
  for (Eigen::Index r = 0; r < m; ++r) e_[r] = rows_[static_cast<std::size_t>(r)].value;
  by_passive_.resize(m, static_cast<Eigen::Index>(chain_.passive.size()));
  for (Eigen::Index r = 0; r < m; ++r) {
    for (std::size_t p = 0; p < chain_.passive.size(); ++p)
      by_passive_(r, static_cast<Eigen::Index>(p)) =
          by_joint(chain_, rows_[static_cast<std::size_t>(r)], frames_, chain_.passive[p], xi);
  }
}

bool Assembler::close(double* q, const Twists* xi) {
  look(q, xi);
  std::vector<double> to(q, q + chain_.joint_count());
  for (int step = 0; step < kSteps; ++step) {
    const double before = e_.norm();
    if (gap() <= kRounding) return true;
    // Near a singular posture passive joints are off by many times the gap: what is closed takes one step more.
    const bool is_closed = gap() <= kGap;
    Eigen::VectorXd dq = newton_step(by_passive_, e_);
    if (!dq.allFinite()) break;
    const double longest = dq.cwiseAbs().maxCoeff();
    double share = longest > kLongest ? kLongest / longest : 1;
    bool better = false;
    for (int half = 0; half < (is_closed ? 1 : kHalvings) && !better; ++half, share /= 2) {
      for (std::size_t p = 0; p < chain_.passive.size(); ++p) {
        const int joint = chain_.passive[p];
        to[static_cast<std::size_t>(joint)] = q[joint] + share * dq[static_cast<Eigen::Index>(p)];
      }
      look(to.data(), xi);
      better = e_.norm() < before;
    }
    if (!better) {
      look(q, xi);
      break;
    }
    std::copy(to.begin(), to.end(), q);
    if (is_closed) return true;
  }
  return gap() <= kStillClosed;
}

AssemblyStatus Assembler::assemble(double* q) {
  const auto n = static_cast<std::size_t>(chain_.joint_count());
  const std::vector<double> wanted(q, q + n);
  std::vector<double> here(chain_.home.data(), chain_.home.data() + n);
  const bool at_home = close(here.data(), nullptr);
  if (home_side_ == 0) home_side_ = side();
  const std::vector<double> start = here;
  std::vector<double> there(n);
  Eigen::VectorXd along = at_home ? tangent(wanted, start) : Eigen::VectorXd();
  double folded = kFolded * std::abs(determinant());
  double done = 0, part = 1;
  while (at_home && done < 1 && part >= kShortestPart) {
    const double to = std::min(1.0, done + part);
    for (std::size_t j = 0; j < n; ++j) there[j] = start[j] + to * (wanted[j] - start[j]);
    for (const int joint : chain_.passive)
      there[static_cast<std::size_t>(joint)] = here[static_cast<std::size_t>(joint)];
    bool near = close(there.data(), nullptr) && side() == home_side_ && std::abs(determinant()) >= folded;
    // A parallelogram's fold, where two ways of assembly cross, bends the way back.
    double moved = 0;
    double missed = 0;
    for (std::size_t p = 0; p < chain_.passive.size(); ++p) {
      const auto joint = static_cast<std::size_t>(chain_.passive[p]);
      const double motion = there[joint] - here[joint];
      moved = std::max(moved, std::abs(motion));
      missed = std::max(missed, std::abs(motion - (to - done) * along[static_cast<Eigen::Index>(p)]));
    }
    if (near && moved <= kJump && missed <= kCurved * moved + kStill) {
      here = there;
      along = tangent(wanted, start);
      folded = kFolded * std::abs(determinant());
      done = to;
      part *= 2;
    } else {
      part /= 2;
    }
  }
  for (const int joint : chain_.passive) q[joint] = here[static_cast<std::size_t>(joint)];
  const bool closed = close(q, nullptr);
  if (!closed) return AssemblyStatus::kOpen;
  if (is_singular()) return AssemblyStatus::kSingular;
  return done >= 1 ? AssemblyStatus::kClosed : AssemblyStatus::kOtherBranch;
}

double Assembler::gap() const { return e_.size() > 0 ? e_.cwiseAbs().maxCoeff() : 0; }

int Assembler::widest() const {
  Eigen::Index at = 0;
  e_.cwiseAbs().maxCoeff(&at);
  return static_cast<int>(at);
}

bool Assembler::is_singular() const {
  const Eigen::VectorXd s = Eigen::JacobiSVD<Eigen::MatrixXd>(by_passive_).singularValues();
  return s.size() > 0 && s[s.size() - 1] <= kSingular * s[0];
}

double Assembler::determinant() const { return by_passive_.determinant(); }

int Assembler::side() const { return determinant() < 0 ? -1 : 1; }

Eigen::VectorXd Assembler::tangent(const std::vector<double>& to, const std::vector<double>& from) const {
  Eigen::VectorXd by_way = Eigen::VectorXd::Zero(by_passive_.rows());
  for (int joint = 0; joint < chain_.joint_count(); ++joint) {
    const double share = to[static_cast<std::size_t>(joint)] - from[static_cast<std::size_t>(joint)];
    if (share == 0 || std::find(chain_.passive.begin(), chain_.passive.end(), joint) != chain_.passive.end()) continue;
    for (Eigen::Index r = 0; r < by_way.size(); ++r)
      by_way[r] += share * by_joint(chain_, rows_[static_cast<std::size_t>(r)], frames_, joint, nullptr);
  }
  return newton_step(by_passive_, by_way);
}

void choose_loop_rows(Chain& chain) {
  // All equations, of which those of a flat loop repeat each other, by least squares.
  const auto passive = static_cast<Eigen::Index>(chain.passive.size());
  std::vector<std::pair<int, int>> every;
  for (std::size_t l = 0; l < chain.loops.size(); ++l) {
    for (int c = 0; c < chain.loops[l].row_count(); ++c) every.emplace_back(static_cast<int>(l), c);
  }
  std::vector<Pose> frames;
  Eigen::VectorXd e(static_cast<Eigen::Index>(every.size()));
  Eigen::MatrixXd J(e.size(), passive);
  const auto look = [&] {
    forward(chain, chain.home.data(), nullptr, frames);
    const std::vector<LoopRow> rows = loop_rows(chain, frames, chain.home.data(), nullptr, true);
    for (Eigen::Index r = 0; r < e.size(); ++r) {
      e[r] = rows[static_cast<std::size_t>(r)].value;
      for (Eigen::Index p = 0; p < passive; ++p)
        J(r, p) = by_joint(chain, rows[static_cast<std::size_t>(r)], frames, chain.passive[static_cast<std::size_t>(p)],
                           nullptr);
    }
  };
  const Eigen::VectorXd given = chain.home;
  look();
  for (int step = 0; step < kSteps && e.size() > 0 && e.cwiseAbs().maxCoeff() > kGap; ++step) {
    const Eigen::VectorXd at = chain.home;
    const double before = e.norm();
    const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> cod(J);
    const Eigen::VectorXd dq = -cod.solve(e);
    double share = std::min(1.0, kLongest / std::max(dq.cwiseAbs().maxCoeff(), 1e-300));
    bool better = false;
    for (int half = 0; half < kHalvings && !better; ++half, share /= 2) {
      for (Eigen::Index p = 0; p < passive; ++p) {
        const int joint = chain.passive[static_cast<std::size_t>(p)];
        chain.home[joint] = at[joint] + share * dq[p];
      }
      look();
      better = e.norm() < before;
    }
    if (!better) {
      chain.home = at;
      look();
      break;
    }
  }
  if (e.size() > 0 && e.cwiseAbs().maxCoeff() > kFarOpen) {
    Eigen::Index widest = 0;
    const double gap = e.cwiseAbs().maxCoeff(&widest);
    const auto loop = static_cast<std::size_t>(every[static_cast<std::size_t>(widest)].first);
    FASTCAL_CHECK(false) << "the loops do not close at the start posture: '" << chain.loops[loop].name << "' lacks "
                         << gap << kHint;
  }
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(J.transpose());
  qr.setThreshold(kDependent);
  const auto rank = static_cast<Eigen::Index>(qr.rank());
  if (rank < passive) {
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(J, Eigen::ComputeFullV);
    Eigen::Index loose = 0;
    svd.matrixV().col(passive - 1).cwiseAbs().maxCoeff(&loose);
    FASTCAL_CHECK(false) << "the loops give " << rank << " independent equations for " << passive
                         << " passive joints at the start posture, so that joint"
                         << chain.passive[static_cast<std::size_t>(loose)] + 1 << " can move by itself";
  }
  for (Eigen::Index k = 0; k < rank; ++k)
    chain.loop_rows.push_back(every[static_cast<std::size_t>(qr.colsPermutation().indices()[k])]);
  std::sort(chain.loop_rows.begin(), chain.loop_rows.end());
  // What least squares could not close, the equations that are kept may.
  Assembler assembler(chain);
  if (e.size() > 0 && e.cwiseAbs().maxCoeff() > kGap && !assembler.close(chain.home.data(), nullptr)) {
    const auto [loop, component] = chain.loop_rows[static_cast<std::size_t>(assembler.widest())];
    (void)component;
    FASTCAL_CHECK(false) << "the loops do not close at the start posture: '"
                         << chain.loops[static_cast<std::size_t>(loop)].name << "' lacks " << assembler.gap() << kHint;
  }
}

}  // namespace fastcal
