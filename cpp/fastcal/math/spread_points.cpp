// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/math/spread_points.hpp"

#include "fastcal/math/check.hpp"

namespace fastcal {

std::vector<Eigen::Index> spread_points(const Eigen::Ref<const Eigen::MatrixXd>& x, Eigen::Index first, int most,
                                        double apart) {
  FASTCAL_CHECK(first >= 0 && first < x.rows()) << "there is no point " << first << "; there are " << x.rows();
  FASTCAL_CHECK(most >= 1) << "at least one point must be chosen, got " << most;
  const auto squares = [&x](Eigen::Index i) {
    Eigen::ArrayXd square = Eigen::ArrayXd::Zero(x.rows());
    for (Eigen::Index k = 0; k < x.cols(); ++k) square += (x.col(k).array() - x(i, k)).square();
    return square;
  };
  std::vector<Eigen::Index> chosen{first};
  Eigen::ArrayXd near = squares(first);  // of each point to the nearest that is chosen
  while (static_cast<int>(chosen.size()) < most) {
    Eigen::Index farthest = 0;
    if (near.maxCoeff(&farthest) <= apart * apart) break;
    chosen.push_back(farthest);
    near = near.min(squares(farthest));
  }
  return chosen;
}

}  // namespace fastcal
