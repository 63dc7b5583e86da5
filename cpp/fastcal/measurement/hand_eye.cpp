// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/measurement/hand_eye.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>

#include "fastcal/math/decompositions.hpp"
#include "fastcal/math/se3.hpp"

namespace fastcal {
namespace {

constexpr double kFlat = 1e-6;     // of the largest extent of a board: below, its points lie in a plane
constexpr double kOnALine = 1e-3;  // the same of the second extent
constexpr int kSubset = 5;         // pictures of a subset to begin with
constexpr int kSubsets = 60;
constexpr int kConcentrations = 8;

/// The unit vector that A makes shortest.
Eigen::VectorXd least_direction(const Eigen::MatrixXd& A) {
  const Eigen::MatrixXd gram = A.transpose() * A;
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(gram).eigenvectors().col(0);
}

/// Gauss and Newton's steps on the directions; the pose before where they lead nowhere.
Pose refined(const Pose& start, const Eigen::Matrix3Xd& points, const Eigen::Matrix2Xd& directions) {
  Pose best = start;
  double least = std::numeric_limits<double>::infinity();
  Pose here = start;
  for (int round = 0; round < 12; ++round) {
    Matrix6d A = Matrix6d::Zero();
    Vector6d g = Vector6d::Zero();
    double cost = 0;
    for (Eigen::Index k = 0; k < points.cols(); ++k) {
      const Eigen::Vector3d P = here * points.col(k).eval();
      if (!(P.z() > 0)) return best;
      const Eigen::Vector2d r = P.hnormalized() - directions.col(k);
      Eigen::Matrix<double, 2, 3> by_point;
      by_point << 1 / P.z(), 0, -P.x() / (P.z() * P.z()), 0, 1 / P.z(), -P.y() / (P.z() * P.z());
      Eigen::Matrix<double, 2, 6> J;  // by [d p, d turn], axes of the camera
      J << by_point, -by_point * skew(P - here.p);
      A += J.transpose() * J;
      g += J.transpose() * r;
      cost += r.squaredNorm();
    }
    if (!(cost < least)) break;
    least = cost;
    best = here;
    const Vector6d step = -A.ldlt().solve(g);
    if (!step.allFinite()) break;
    here.p += step.head<3>();
    here.R = exp_so3(step.tail<3>()) * here.R;
  }
  return best;
}

/// By homography; the points are (2, K) in their plane.
std::optional<Pose> pose_from_plane(const Eigen::Matrix2Xd& points, const Eigen::Matrix2Xd& directions) {
  const double size = std::sqrt(points.squaredNorm() / static_cast<double>(points.cols()));
  const Eigen::Vector2d middle = directions.rowwise().mean();
  const double spread = std::sqrt((directions.colwise() - middle).squaredNorm() / static_cast<double>(points.cols()));
  if (!(size > 0 && spread > 0)) return std::nullopt;
  Eigen::MatrixXd A(2 * points.cols(), 9);
  for (Eigen::Index k = 0; k < points.cols(); ++k) {
    const Eigen::RowVector3d X((points.col(k) / size).homogeneous().transpose());
    const Eigen::Vector2d x = (directions.col(k) - middle) / spread;
    A.row(2 * k) << X, Eigen::RowVector3d::Zero(), -x.x() * X;
    A.row(2 * k + 1) << Eigen::RowVector3d::Zero(), X, -x.y() * X;
  }
  const Eigen::VectorXd h = least_direction(A);
  Eigen::Matrix3d H = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(h.data());
  Eigen::Matrix3d back = Eigen::Matrix3d::Identity();
  back.topLeftCorner<2, 2>() *= spread;
  back.topRightCorner<2, 1>() = middle;
  H = back * H;
  H.leftCols<2>() /= size;
  H /= 0.5 * (H.col(0).norm() + H.col(1).norm());
  if (H(2, 2) < 0) H = -H;
  if (!H.allFinite() || !(H(2, 2) > 0)) return std::nullopt;
  Eigen::Matrix3d R;
  R << H.col(0), H.col(1), H.col(0).cross(H.col(1));
  return Pose{nearest_rotation(R), H.col(2)};
}

std::optional<Pose> pose_from_space(const Eigen::Matrix3Xd& points, const Eigen::Matrix2Xd& directions) {
  if (points.cols() < 6) return std::nullopt;
  const double size = std::sqrt(points.squaredNorm() / static_cast<double>(points.cols()));
  Eigen::MatrixXd A(2 * points.cols(), 12);
  for (Eigen::Index k = 0; k < points.cols(); ++k) {
    const Eigen::RowVector4d X((points.col(k) / size).homogeneous().transpose());
    A.row(2 * k) << X, Eigen::RowVector4d::Zero(), -directions(0, k) * X;
    A.row(2 * k + 1) << Eigen::RowVector4d::Zero(), X, -directions(1, k) * X;
  }
  const Eigen::VectorXd h = least_direction(A);
  const Eigen::Matrix<double, 3, 4> M = Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(h.data());
  Eigen::Matrix3d R = M.leftCols<3>();
  const double scale = std::cbrt(R.determinant());
  if (!(std::abs(scale) > 0)) return std::nullopt;
  return Pose{nearest_rotation(R / scale), M.col(3) / scale * size};
}

/// Turn and shift, the shift over the distance between camera and board, that one picture is off.
double misfit(const Picture& picture, const HandEye& at) {
  const Pose seen = picture.T_b_a * at.T_a_camera * picture.T_camera_board;
  const double distance = std::max(picture.T_camera_board.p.norm(), 1e-9);
  return log_so3(at.T_b_board.R.transpose() * seen.R).norm() + (seen.p - at.T_b_board.p).norm() / distance;
}

HandEye shah(const std::vector<Picture>& pictures, const std::vector<std::size_t>& chosen) {
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(9, 9);
  for (const std::size_t i : chosen) {
    const Eigen::Matrix3d &D = pictures[i].T_b_a.R, &C = pictures[i].T_camera_board.R;
    for (int a = 0; a < 3; ++a) {
      for (int b = 0; b < 3; ++b) K.block<3, 3>(3 * a, 3 * b) += C(b, a) * D;
    }
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(K, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::VectorXd x = svd.matrixV().col(0), y = svd.matrixU().col(0);
  Eigen::Matrix3d X = Eigen::Map<const Eigen::Matrix3d>(x.data());
  Eigen::Matrix3d Y = Eigen::Map<const Eigen::Matrix3d>(y.data());
  if (X.determinant() < 0) {
    X = -X;
    Y = -Y;
  }
  HandEye out{{nearest_rotation(X), Eigen::Vector3d::Zero()}, {nearest_rotation(Y), Eigen::Vector3d::Zero()}};
  Eigen::MatrixXd A(3 * chosen.size(), 6);
  Eigen::VectorXd b(3 * chosen.size());
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    const Picture& picture = pictures[chosen[k]];
    const auto at = static_cast<Eigen::Index>(3 * k);
    A.middleRows<3>(at) << picture.T_b_a.R, -Eigen::Matrix3d::Identity();
    b.segment<3>(at) = -(picture.T_b_a * (out.T_a_camera.R * picture.T_camera_board.p));
  }
  const Eigen::VectorXd shifts = least_squares(A, b);
  out.T_a_camera.p = shifts.head<3>();
  out.T_b_board.p = shifts.tail<3>();
  return out;
}

}  // namespace

std::optional<Pose> pose_from_points(const Eigen::Matrix3Xd& points, const Eigen::Matrix2Xd& directions) {
  if (points.cols() < 4) return std::nullopt;
  const Eigen::Vector3d middle = points.rowwise().mean();
  const Eigen::Matrix3Xd about = points.colwise() - middle;
  const Eigen::Matrix3d spread = about * about.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(spread);
  const Eigen::Vector3d extents = axes.eigenvalues().cwiseMax(0).cwiseSqrt();
  if (!(extents[1] > kOnALine * extents[2])) return std::nullopt;
  // The board's own axes, whose first two span its plane.
  Eigen::Matrix3d R;
  R << axes.eigenvectors().col(2), axes.eigenvectors().col(1),
      axes.eigenvectors().col(2).cross(axes.eigenvectors().col(1));
  const Pose T_board_axes{R, middle};
  std::optional<Pose> found;
  if (extents[0] < kFlat * extents[2]) {
    found = pose_from_plane((R.transpose() * about).topRows<2>(), directions);
  } else {
    found = pose_from_space(R.transpose() * about, directions);
  }
  if (!found) return std::nullopt;
  return refined(*found * T_board_axes.inverse(), points, directions);
}

std::optional<HandEye> hand_eye(const std::vector<Picture>& pictures) {
  const std::size_t count = pictures.size();
  if (count < 3) return std::nullopt;
  std::optional<HandEye> best;
  double least = std::numeric_limits<double>::infinity();
  std::vector<std::size_t> order(count);
  std::vector<double> misfits(count);
  std::uint64_t state = 1;  // always the same subsets: D. Knuth's MMIX generator
  const auto next = [&state](std::size_t below) {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<std::size_t>((state >> 33) % below);
  };
  for (int subset = 0; subset <= kSubsets; ++subset) {
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::vector<std::size_t> chosen = order;
    if (subset > 0 && count > kSubset) {
      for (std::size_t k = 0; k < kSubset; ++k) std::swap(order[k], order[k + next(count - k)]);
      chosen.assign(order.begin(), order.begin() + kSubset);
    }
    for (int round = 0; round < kConcentrations; ++round) {
      const HandEye here = shah(pictures, chosen);
      for (std::size_t i = 0; i < count; ++i) misfits[i] = misfit(pictures[i], here);
      std::iota(order.begin(), order.end(), std::size_t{0});
      std::stable_sort(order.begin(), order.end(),
                       [&](std::size_t a, std::size_t b) { return misfits[a] < misfits[b]; });
      const double median = misfits[order[count / 2]];
      if (median < least) {
        least = median;
        best = here;
      }
      std::vector<std::size_t> agree(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count / 2 + 1));
      if (agree == chosen) break;
      chosen = std::move(agree);
    }
    if (count <= kSubset) break;
  }
  return best;
}

Pose typical_pose(const std::vector<Pose>& poses) {
  const auto distance = [](const Pose& a, const Pose& b) {
    return log_so3(a.R.transpose() * b.R).norm() + (a.p - b.p).norm();
  };
  double least = std::numeric_limits<double>::infinity();
  Pose middle;
  for (const Pose& pose : poses) {
    std::vector<double> far;
    for (const Pose& other : poses) far.push_back(distance(pose, other));
    std::nth_element(far.begin(), far.begin() + static_cast<std::ptrdiff_t>(far.size() / 2), far.end());
    if (!(far[far.size() / 2] < least)) continue;
    least = far[far.size() / 2];
    middle = pose;
  }
  Eigen::Matrix3d R = Eigen::Matrix3d::Zero();
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  double count = 0;
  for (const Pose& pose : poses) {
    if (distance(middle, pose) > 2 * least) continue;
    R += pose.R;
    p += pose.p;
    ++count;
  }
  return count > 0 ? Pose{nearest_rotation(R), p / count} : middle;
}

}  // namespace fastcal
