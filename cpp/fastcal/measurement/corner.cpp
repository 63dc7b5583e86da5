// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Corners of boards in the pictures of cameras; a row is one posture, its readings the corners of all its pictures.
//   r = draw(T_world_camera^-1 T_world_board c) - uv [px],  T_world_x = T_world_frame T_frame_x exp([p, w])
// T_world_frame being where the frame is when the corner's line is taken (rig.hpp).
// Cameras and boards stand on frames of the arm or in the measuring frame. Identified are p [m] and w [rad] of each
// that is not fixed, exp([p, w]) having the turn exp(w) and the shift p; and a camera's intrinsics where that is asked.
// Start: each picture's board by closed form (hand_eye.hpp), then camera and board of the pair with most pictures, then
// what hangs on these. Only what some picture shows is identified.
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "fastcal/math/check.hpp"
#include "fastcal/math/se3.hpp"
#include "fastcal/measurement/hand_eye.hpp"
#include "fastcal/measurement/registry.hpp"

namespace fastcal {
namespace {

constexpr Eigen::Index kLeastCorners = 4;  // of a picture from which its board is placed

/// One camera or board among the unknowns.
struct Own {
  int first = -1;  // its unknowns; -1: it has none
  int count = 0;
  bool placed = false;  // the first six are its placement
  int frame = -1;       // in frames(); -1: it stands in the measuring frame
};

class Corner : public Observation {
 public:
  Corner(Rig rig, RowMatrixXd uv, const RowMatrixXd* sigma) : rig_(std::move(rig)), uv_(std::move(uv)) {
    if (sigma != nullptr) sigma_ = *sigma;
    std::vector<bool> seen_by(rig_.cameras.size()), seen(rig_.boards.size());
    for (std::size_t c = 0; c < rig_.cameras.size(); ++c) {
      for (std::size_t b = 0; b < rig_.boards.size(); ++b) {
        const Eigen::Index corners = rig_.boards[b].corners.cols();
        const auto first = static_cast<Eigen::Index>(readings_.size());
        for (Eigen::Index k = 0; k < corners; ++k) readings_.push_back({c, b, k});
        const bool any = !uv_.middleCols(2 * first, 2 * corners).array().isNaN().all();
        if (any) seen_by[c] = seen[b] = true;
      }
    }
    for (std::size_t c = 0; c < seen_by.size(); ++c) add(rig_.cameras[c], "camera", seen_by[c], &rig_.cameras[c]);
    for (std::size_t b = 0; b < seen.size(); ++b) add(rig_.boards[b], "board", seen[b], nullptr);
    if (frames_.empty()) frames_.push_back(kBaseFrame);  // nothing moves: it shows that, and no more
    FASTCAL_CHECK(frames_.size() <= kMostFrames) << "cameras and boards must stand in the world or on at most "
                                                 << kMostFrames << " frames of the arm, got " << frames_.size();
  }

  std::string name() const override { return "corner"; }
  const std::vector<std::string>& components() const override {
    static const std::vector<std::string> names{"u", "v"};
    return names;
  }
  int reading_count() const override { return static_cast<int>(readings_.size()); }
  std::string unit() const override { return "px"; }
  std::string field() const override { return "corner"; }
  std::vector<int> frames() const override { return frames_; }
  const std::vector<Parameter>& parameters() const override { return parameters_; }
  double sigma(Eigen::Index row, int number) const override { return sigma_.size() == 0 ? 0 : sigma_(row, number / 2); }
  bool claims_sigma() const override { return sigma_.size() > 0; }
  bool shows_base() const override { return shows_base_; }
  bool shows_tool() const override { return false; }

  void compare(Eigen::Index row, const Sights& sights, const double* unknowns, Comparison& out) const override {
    compare_reading(row, 0, sights, unknowns, out);
  }

  void compare_reading(Eigen::Index row, int reading, const Sights& sights, const double* unknowns,
                       Comparison& out) const override {
    if (!is_there(row, reading)) return;
    Shot shot = shot_of(reading, sights, unknowns);
    place(shot, row, seconds_of(row, reading));
    compare_corner(shot, row, reading, out);
  }

  void compare_all(Eigen::Index row, const Sights& sights, const double* unknowns, Comparison& out,
                   const std::function<void(int)>& take) const override {
    std::optional<Shot> shot;
    for (int reading = 0; reading < reading_count(); ++reading) {
      if (!is_there(row, reading)) continue;
      const auto& [c, b, k] = readings_[static_cast<std::size_t>(reading)];
      const double seconds = seconds_of(row, reading);
      const bool is_new = !shot || shot->camera != &rig_.cameras[c] || shot->board != &rig_.boards[b];
      if (is_new) shot = shot_of(reading, sights, unknowns);
      if (is_new || seconds != shot->seconds) place(*shot, row, seconds);
      compare_corner(*shot, row, reading, out);
      take(reading);
    }
  }

  std::string start(const std::vector<Sights>& sights, Eigen::Ref<Eigen::VectorXd> unknowns) const override {
    unknowns.setZero();
    const std::size_t cameras = rig_.cameras.size(), boards = rig_.boards.size();
    std::map<std::pair<std::size_t, std::size_t>, std::vector<Picture>> pictures;
    for (std::size_t c = 0; c < cameras; ++c) {
      for (std::size_t b = 0; b < boards; ++b) pictures[{c, b}] = pictures_of(c, b, sights);
    }
    std::vector<std::optional<Pose>> eyes(cameras), seen(boards);
    for (std::size_t c = 0; c < cameras; ++c) {
      if (!owns_[c].placed) eyes[c] = rig_.cameras[c].T_frame_own;
    }
    for (std::size_t b = 0; b < boards; ++b) {
      if (!owns_[cameras + b].placed) seen[b] = rig_.boards[b].T_frame_own;
    }
    while (true) {
      // What hangs on something that is placed, by most pictures; else the pair with most.
      std::size_t most = 0;
      std::pair<std::size_t, std::size_t> next;
      bool hangs = false;
      for (const auto& [pair, of] : pictures) {
        const bool eye = eyes[pair.first].has_value(), board = seen[pair.second].has_value();
        if (of.empty() || (eye && board)) continue;
        if (std::pair(eye || board, of.size()) <= std::pair(hangs, most)) continue;
        hangs = eye || board;
        most = of.size();
        next = pair;
      }
      if (most == 0) break;
      const auto& [c, b] = next;
      const std::vector<Picture>& of = pictures[next];
      if (!hangs) {
        const std::optional<HandEye> found = hand_eye(of);
        if (!found) {
          return "camera " + rig_.cameras[c].name + " and board " + rig_.boards[b].name +
                 " need at least three pictures with four corners each, got " + std::to_string(of.size());
        }
        eyes[c] = found->T_a_camera;
        seen[b] = found->T_b_board;
        continue;
      }
      std::vector<Pose> poses;
      poses.reserve(of.size());
      for (const Picture& picture : of) {
        poses.push_back(eyes[c] ? picture.T_b_a * *eyes[c] * picture.T_camera_board
                                : picture.T_b_a.inverse() * *seen[b] * picture.T_camera_board.inverse());
      }
      (eyes[c] ? seen[b] : eyes[c]) = typical_pose(poses);
    }
    for (std::size_t c = 0; c < cameras; ++c) {
      if (owns_[c].placed && !eyes[c]) return nowhere("camera", rig_.cameras[c].name);
      if (owns_[c].placed) pack(owns_[c], rig_.cameras[c].T_frame_own, *eyes[c], unknowns);
    }
    for (std::size_t b = 0; b < boards; ++b) {
      const Own& own = owns_[cameras + b];
      if (own.placed && !seen[b]) return nowhere("board", rig_.boards[b].name);
      if (own.placed) pack(own, rig_.boards[b].T_frame_own, *seen[b], unknowns);
    }
    return "";
  }

 private:
  struct Reading {
    std::size_t camera, board;
    Eigen::Index corner;
  };

  /// The turn exp(w) and its right Jacobian, the shift.
  struct Placement {
    Eigen::Matrix3d R, J_r;
    Eigen::Vector3d p;
  };

  /// What the corners of one board in one camera share.
  struct Shot {
    const Camera* camera;
    const Board* board;
    const Own *eye, *seen;
    Pose read_camera, read_board;  // their frames when the joints were read
    Placement camera_own, board_own;
    Intrinsics intrinsics;
    int intrinsic_count;  // that are identified
    // So many seconds after the joints were read:
    double seconds = 0;
    Pose T_world_given{}, T_world_board{}, T_world_camera{};  // of the board without and with its own placement
  };

  static std::string nowhere(const std::string& what, const std::string& name) {
    return what + " " + name + " is in no picture with four corners of a board that are not on one line";
  }

  void add(const Standing& standing, const std::string& what, bool is_seen, const Camera* camera) {
    Own own;
    if (is_seen) {
      const std::string owner = what + " " + standing.name;
      const auto first = static_cast<int>(parameters_.size());
      own.placed = !standing.fixed;
      if (own.placed) {
        for (const char* axis : {"x", "y", "z"})
          parameters_.push_back(
              {owner, axis, "m", 1e-3, "shift of the " + what + " from where the file has it, in its axes"});
        for (const char* axis : {"rx", "ry", "rz"})
          parameters_.push_back({owner, axis, "rad", 1e-3, "turn of the " + what + " from where the file has it"});
      }
      if (camera != nullptr) {
        for (int i = 0; i < camera->identified_intrinsics; ++i) {
          const bool length = i < 4;  // in the picture
          parameters_.push_back({owner, intrinsic_names(camera->lens)[static_cast<std::size_t>(i)], length ? "px" : "1",
                                 length ? 1.0 : 1e-3, "change of the lens from what the file has"});
        }
      }
      own.count = static_cast<int>(parameters_.size()) - first;
      if (own.count > 0) own.first = first;
      if (standing.frame != kWorldFrame) {
        const auto known = std::find(frames_.begin(), frames_.end(), standing.frame);
        own.frame = static_cast<int>(known - frames_.begin());
        if (known == frames_.end()) frames_.push_back(standing.frame);
      } else if (standing.fixed) {
        shows_base_ = true;
      }
    }
    owns_.push_back(own);
  }

  static Pose frame_of(const Own& own, const Sights& sights) {
    return own.frame < 0 ? Pose{} : sights[static_cast<std::size_t>(own.frame)];
  }

  static Placement placement(const Own& own, const double* unknowns) {
    if (!own.placed) return {Eigen::Matrix3d::Identity(), Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero()};
    const Eigen::Vector3d w(unknowns + own.first + 3);
    return {exp_so3(w), right_jacobian_so3(w), Eigen::Vector3d(unknowns + own.first)};
  }

  bool is_there(Eigen::Index row, int reading) const {
    return !std::isnan(uv_(row, 2 * reading)) && !std::isnan(uv_(row, 2 * reading + 1));
  }

  double seconds_of(Eigen::Index row, int reading) const {
    return rig_.cameras[readings_[static_cast<std::size_t>(reading)].camera].seconds(uv_(row, 2 * reading + 1));
  }

  /// Of a reading; place() brings it to its time.
  Shot shot_of(int reading, const Sights& sights, const double* unknowns) const {
    const auto& [c, b, k] = readings_[static_cast<std::size_t>(reading)];
    const Own &eye = owns_[c], &seen = owns_[rig_.cameras.size() + b];
    Shot out{&rig_.cameras[c],
             &rig_.boards[b],
             &eye,
             &seen,
             frame_of(eye, sights),
             frame_of(seen, sights),
             placement(eye, unknowns),
             placement(seen, unknowns),
             rig_.cameras[c].intrinsics,
             eye.count - (eye.placed ? 6 : 0)};
    const double* change = unknowns + eye.first + (eye.placed ? 6 : 0);
    for (int i = 0; i < out.intrinsic_count; ++i) out.intrinsics[i] += change[i];
    return out;
  }

  static void place(Shot& of, Eigen::Index row, double seconds) {
    of.seconds = seconds;
    of.T_world_given = of.board->frame_at(of.read_board, row, seconds) * of.board->T_frame_own;
    of.T_world_board = of.T_world_given * Pose{of.board_own.R, of.board_own.p};
    of.T_world_camera = of.camera->frame_at(of.read_camera, row, seconds) * of.camera->T_frame_own *
                        Pose{of.camera_own.R, of.camera_own.p};
  }

  void compare_corner(const Shot& of, Eigen::Index row, int reading, Comparison& out) const {
    const Eigen::Vector3d corner = of.board->corners.col(readings_[static_cast<std::size_t>(reading)].corner);
    const Eigen::Vector3d p_world = of.T_world_board * corner;
    const Eigen::Matrix3d R_camera_world = of.T_world_camera.R.transpose();
    const Eigen::Vector3d p = R_camera_world * (p_world - of.T_world_camera.p);
    const Drawn drawn = draw(of.camera->lens, of.intrinsics, p);

    out.present[0] = out.present[1] = true;
    out.r.head<2>() = drawn.uv - uv_.row(row).segment<2>(2 * static_cast<Eigen::Index>(reading)).transpose();
    // What moves the corner by d in the world moves it by R_camera_world d before the camera, which does the opposite.
    const Eigen::Matrix<double, 2, 3> by_world = drawn.by_point * R_camera_world;
    if (of.seen->frame >= 0)
      add_motion(by_world, p_world - of.read_board.p, out.by_frame[static_cast<std::size_t>(of.seen->frame)]);
    if (of.eye->frame >= 0)
      add_motion(-by_world, p_world - of.read_camera.p, out.by_frame[static_cast<std::size_t>(of.eye->frame)]);

    out.first_unknown = std::max(of.eye->first, 0);
    out.unknown_count = of.eye->count;
    out.second_unknown = std::max(of.seen->first, 0);
    out.second_count = of.seen->count;
    if (of.eye->placed) {
      out.by_unknown.topLeftCorner<2, 3>() = -drawn.by_point * of.camera_own.R.transpose();
      out.by_unknown.block<2, 3>(0, 3) = drawn.by_point * skew(p) * of.camera_own.J_r;
    }
    if (of.intrinsic_count > 0) {
      out.by_unknown.block(0, of.eye->placed ? 6 : 0, 2, of.intrinsic_count) =
          drawn.by_intrinsic.leftCols(of.intrinsic_count);
    }
    if (of.seen->placed) {
      out.by_unknown.block<2, 3>(0, of.eye->count) = by_world * of.T_world_given.R;
      out.by_unknown.block<2, 3>(0, of.eye->count + 3) =
          -by_world * of.T_world_board.R * skew(corner) * of.board_own.J_r;
    }
  }

  static void pack(const Own& own, const Pose& given, const Pose& found, Eigen::Ref<Eigen::VectorXd> unknowns) {
    const Pose change = given.inverse() * found;
    unknowns.segment<3>(own.first) = change.p;
    unknowns.segment<3>(own.first + 3) = log_so3(change.R);
  }

  /// Adds d r / d [v; w] of a frame that carries the corner along: d p = v + w x arm.
  static void add_motion(const Eigen::Matrix<double, 2, 3>& by_world, const Eigen::Vector3d& arm,
                         Eigen::Matrix<double, kMostComponents, 6>& out) {
    out.topLeftCorner<2, 3>() += by_world;
    out.topRightCorner<2, 3>() -= by_world * skew(arm);
  }

  std::vector<Picture> pictures_of(std::size_t c, std::size_t b, const std::vector<Sights>& sights) const {
    const Camera& camera = rig_.cameras[c];
    const Eigen::Matrix3Xd& corners = rig_.boards[b].corners;
    Eigen::Index first = 0;
    while (readings_[static_cast<std::size_t>(first)].camera != c ||
           readings_[static_cast<std::size_t>(first)].board != b)
      ++first;
    std::vector<Picture> out;
    for (Eigen::Index i = 0; i < uv_.rows(); ++i) {
      std::vector<Eigen::Index> there;
      for (Eigen::Index k = 0; k < corners.cols(); ++k) {
        if (!std::isnan(uv_(i, 2 * (first + k))) && !std::isnan(uv_(i, 2 * (first + k) + 1))) there.push_back(k);
      }
      if (static_cast<Eigen::Index>(there.size()) < kLeastCorners) continue;
      Eigen::Matrix2Xd directions(2, there.size());
      double v = 0;  // of its middle
      for (std::size_t k = 0; k < there.size(); ++k) {
        const Eigen::Vector2d uv = uv_.row(i).segment<2>(2 * (first + there[k])).transpose();
        v += uv[1] / static_cast<double>(there.size());
        directions.col(static_cast<Eigen::Index>(k)) = line_of_sight(camera.lens, camera.intrinsics, uv).hnormalized();
      }
      const std::optional<Pose> board = pose_from_points(corners(Eigen::all, there), directions);
      if (!board) continue;
      const Sights& at = sights[static_cast<std::size_t>(i)];
      const double seconds = camera.seconds(v);
      const Pose camera_frame = camera.frame_at(frame_of(owns_[c], at), i, seconds);
      const Pose board_frame = rig_.boards[b].frame_at(frame_of(owns_[rig_.cameras.size() + b], at), i, seconds);
      out.push_back({board_frame.inverse() * camera_frame, *board});
    }
    return out;
  }

  Rig rig_;
  RowMatrixXd uv_;     // (N, 2 K): u, v of each reading
  RowMatrixXd sigma_;  // (N, K); empty: none is claimed
  std::vector<Reading> readings_;
  std::vector<Own> owns_;  // of the cameras, then of the boards
  std::vector<int> frames_;
  std::vector<Parameter> parameters_;
  bool shows_base_ = false;
};

void check_rows(const Rig& rig, Eigen::Index rows) {
  const auto check = [rows](const std::string& owner, const char* what, const RowMatrixXd& table) {
    FASTCAL_CHECK(table.size() == 0 || (table.rows() == rows && table.cols() == 6 && table.allFinite()))
        << what << " of " << owner << " must have shape (" << rows << ", 6) and be finite, got (" << table.rows()
        << ", " << table.cols() << ")";
  };
  for (const Camera& camera : rig.cameras) {
    check("camera " + camera.name, "motion", camera.motion);
    check("camera " + camera.name, "shift", camera.shift);
  }
  for (const Board& board : rig.boards) {
    check("board " + board.name, "motion", board.motion);
    check("board " + board.name, "shift", board.shift);
  }
}

}  // namespace

FASTCAL_REGISTER_OBSERVATION("corner",
                             {.plural = "corners",
                              .fields = {{"corner", FieldRole::kMeasured, {}, "pixel", "px"},
                                         {"sigma_corner", FieldRole::kSigma, {}, "pixel", "px"}},
                              .note = "",
                              .make = [](const Tables& tables,
                                         const RobotModel&) -> std::vector<std::shared_ptr<const Observation>> {
                                Eigen::Index readings = 0;
                                for (const Board& board : tables.rig.boards) readings += board.corners.cols();
                                readings *= static_cast<Eigen::Index>(tables.rig.cameras.size());
                                const RowMatrixXd* uv = tables.find("corner", 2 * readings);
                                if (uv == nullptr) return {};
                                FASTCAL_CHECK(readings > 0) << "corners need a camera and a board";
                                check_rows(tables.rig, tables.rows);
                                const RowMatrixXd* sigma = tables.find("sigma_corner", readings);
                                for (Eigen::Index i = 0; sigma != nullptr && i < tables.rows; ++i) {
                                  for (Eigen::Index k = 0; k < readings; ++k) {
                                    FASTCAL_CHECK(std::isnan((*uv)(i, 2 * k)) || (*sigma)(i, k) > 0)
                                        << "row " << i << ": sigma_corner must be positive where a corner was seen";
                                  }
                                }
                                return {std::make_shared<Corner>(tables.rig, *uv, sigma)};
                              }})

}  // namespace fastcal
