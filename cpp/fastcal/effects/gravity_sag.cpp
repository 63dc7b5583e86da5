// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Gravity sag: what a joint gives under the arm's own weight where no masses are known. With the joint's compliance c
// and the first moments s_i [kg m] of all that hangs beyond joint i, in the axes R_i of that joint's frame,
//   dq_j = c tau_j = sum_(i >= j) z_j . (R_i theta_i x g / |g|),   theta_i = c |g| s_i [rad],
// linear in the theta_i. Of each s_i only what lies across joint i's axis is visible (the rest turns with the joint
// before), of a slider only the mass that it carries: the minimal parameters of the gravity torque (M. Gautier,
// W. Khalil, "Direct calculation of minimum set of inertial parameters of serial robots", 1990).
// The first parameter, `even`, is the turn of the stretched, level arm if its mass were spread evenly along its links;
// the others, `shape`, are an orthonormal basis of all other distributions, in shares of what even links weigh beyond
// each joint, and have the penalty 1. Option `moments`: free (default), or even: the first parameter alone.
// The payload's part is joint_compliance's. What even links are follows from the geometry, which identification moves:
// `even_shares` and `shape_shares` keep what the parameters count from.
#include <algorithm>
#include <cmath>

#include "fastcal/effects/owners.hpp"
#include "fastcal/math/check.hpp"
#include "fastcal/math/decompositions.hpp"

namespace fastcal {
namespace {

constexpr double kSize = 2e-3;  // [rad] what joints give under an arm's own weight: 2 mm per metre of reach
constexpr const char* kEven = "even_shares";
constexpr const char* kShape = "shape_shares";
constexpr double kLeastShare = .02;  // of the owner's moment: what a link without a length may still weigh

class GravitySag : public LinearEffect {
 public:
  GravitySag(const RobotModel& robot, const std::string& owner, const Options& options)
      : first_(owner_index("gravity_sag", "joint", owner, robot.joint_count())),
        types_(robot.description().joint_types) {
    check_options("gravity_sag", options, {"moments", kEven, kShape});
    const std::string moments = text_option(options, "moments", "free");
    FASTCAL_CHECK(moments == "free" || moments == "even")
        << "gravity_sag: moments must be free or even, got '" << moments << "'";
    if (slides(first_)) {
      directions_ = Eigen::MatrixXd::Ones(1, 1);
      parameters_ = {{owner, "even", "m", 1e-4, "what the slider gives where it points down"}};
      return;
    }
    set_shares(robot);
    take_shares(options);
    set_directions(moments == "free");
    parameters_ = {{owner, "even", "rad", kSize, "turn of the stretched arm, its mass spread evenly along its links"}};
    for (Eigen::Index k = 1; k < directions_.cols(); ++k) {
      parameters_.push_back(
          {owner, "shape" + std::to_string(k), "rad", kSize, "share of another distribution of the mass"});
    }
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  unsigned needs() const override { return kFrames; }
  bool follows_loads() const override { return true; }  // the weights are in its parameters

  std::vector<double> penalty() const override {
    if (parameters_.size() == 1) return {};
    std::vector<double> out(parameters_.size(), 1.0);
    out.front() = 0;
    return out;
  }

  std::map<std::string, ListOption> reference() const override {
    if (slides(first_)) return {};
    return {{kEven, {"1", even_}}, {kShape, {"1", scale_}}};
  }

  void basis(const State& state, TwistColumns& columns) const override {
    const Eigen::Vector3d down = Eigen::Map<const Eigen::Vector3d>(state.gravity).normalized();
    const Eigen::Vector3d axis = state.frames[joint_frame(first_)].R.col(2);
    Eigen::VectorXd turn(directions_.rows());  // of the joint by each theta_i
    if (slides(first_)) turn[0] = axis.dot(down);
    Eigen::Index row = 0;
    for (int i = first_; i < static_cast<int>(types_.size()) && !slides(first_); ++i) {
      const Eigen::Matrix3d& R = state.frames[joint_frame(i)].R;
      if (slides(i)) {
        turn[row++] = state.q[i] * axis.dot(R.col(2).cross(down));
      } else {
        turn[row++] = axis.dot(R.col(0).cross(down));
        turn[row++] = axis.dot(R.col(1).cross(down));
      }
    }
    for (int k = 0; k < static_cast<int>(parameters_.size()); ++k)
      columns.push_back({k, joint_frame(first_), joint_motion(types_, first_, turn.dot(directions_.col(k)))});
  }

 private:
  bool slides(int joint) const { return types_[static_cast<std::size_t>(joint)] == JointType::kPrismatic; }

  /// Evenly spread mass on the links of this robot: theta_i in shares of the stretched arm's, and their sizes.
  void set_shares(const RobotModel& robot) {
    const Chain chain = robot.chain();
    const int n = chain.joint_count();
    std::vector<Pose> next;  // of joint i + 1 (of the tool) in joint i's frame, at q = 0
    std::vector<double> beyond(static_cast<std::size_t>(n) + 1, 0.0);  // length of the links from joint i on
    next.reserve(static_cast<std::size_t>(n));
    for (int i = 0; i < n; ++i) {
      const auto link = static_cast<std::size_t>(link_frame(i));
      next.push_back(chain.constants[link] * chain.constants[link + 1]);
    }
    for (int i = n - 1; i >= 0; --i)
      beyond[static_cast<std::size_t>(i)] =
          beyond[static_cast<std::size_t>(i) + 1] + next[static_cast<std::size_t>(i)].p.norm();
    std::vector<Eigen::Vector3d> moment;  // of even links of 1 kg/m, each where its own joint turns it
    std::vector<double> size;             // of the moments from joint i on, were they stretched
    double stretched = 0;
    for (int i = 0; i < n; ++i) {
      const auto k = static_cast<std::size_t>(i);
      moment.emplace_back((beyond[k] + beyond[k + 1]) / 2 * next[k].p);
    }
    size.resize(static_cast<std::size_t>(n));
    for (int i = n - 1; i >= first_; --i)
      size[static_cast<std::size_t>(i)] = stretched += moment[static_cast<std::size_t>(i)].norm();
    FASTCAL_CHECK(stretched > 0) << "gravity_sag needs a length beyond its joint, and there is none";
    for (int i = n - 1; i > first_; --i) {  // what does not turn against the joint before is that joint's
      const auto k = static_cast<std::size_t>(i);
      const Eigen::Vector3d fixed = slides(i) ? moment[k] : moment[k].cwiseProduct(Eigen::Vector3d::UnitZ()).eval();
      moment[k] -= fixed;
      moment[k - 1] += next[k - 1].R * fixed;
    }
    for (int i = first_; i < n; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const double share = std::max(size[k] / stretched, kLeastShare);
      if (slides(i)) {
        even_.push_back(beyond[k] / stretched);
        scale_.push_back(std::max(even_.back(), kLeastShare));
      } else {
        even_.insert(even_.end(), {moment[k].x() / stretched, moment[k].y() / stretched});
        scale_.insert(scale_.end(), {share, share});
      }
    }
  }

  /// Those of the robot that the parameters were identified on, where the options hold them.
  void take_shares(const Options& options) {
    for (const auto& [key, own] : {std::pair{kEven, &even_}, std::pair{kShape, &scale_}}) {
      const std::vector<double> given = list_option(options, key);
      if (given.empty()) continue;
      FASTCAL_CHECK(given.size() == own->size())
          << "gravity_sag: " << key << " must have " << own->size() << " numbers, got " << given.size();
      for (const double share : given)
        FASTCAL_CHECK(std::isfinite(share) && (own != &scale_ || share > 0))
            << "gravity_sag: " << key << " must hold " << (own == &scale_ ? "positive" : "finite") << " numbers";
      *own = given;
    }
  }

  /// Columns: the theta_i of each parameter, two a turning joint, one a slider.
  void set_directions(bool free) {
    const auto count = static_cast<Eigen::Index>(even_.size());
    const Eigen::Map<const Eigen::VectorXd> s(even_.data(), count);
    const Eigen::Map<const Eigen::VectorXd> D(scale_.data(), count);
    directions_ = s;
    if (!free) return;
    const Eigen::VectorXd unit = s.cwiseQuotient(D).normalized();
    directions_.resize(count, count);
    directions_ << s, D.asDiagonal() * complement(unit);
  }

  /// Orthonormal columns across a unit vector (n x (n - 1)), by the reflection that takes it to the first axis.
  static Eigen::MatrixXd complement(const Eigen::VectorXd& unit) {
    Eigen::VectorXd v = unit;
    v[0] += unit[0] >= 0 ? 1 : -1;
    const Eigen::Index n = unit.size();
    const Eigen::MatrixXd H = Eigen::MatrixXd::Identity(n, n) - 2 / v.squaredNorm() * v * v.transpose();
    return H.rightCols(n - 1);
  }

  int first_;
  std::vector<JointType> types_;
  std::vector<double> even_, scale_;
  Eigen::MatrixXd directions_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("gravity_sag",
                        {make<GravitySag>,
                         joint_owners,
                         {.phrase = "sag under the arm's own weight",
                          .place = Place::kJoint,
                          .depends_on = {"load"},
                          .needs_data = "no masses in the robot file; with them joint_compliance says more",
                          .shown_by = "poses in which the arm beyond {owner} turns about a level axis",
                          .options_from_data = {"reference"},
                          .diagnosed_with = "moments=even",
                          .without_masses = true}})

}  // namespace fastcal
