// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A link as a beam: decided once, on the robot that an effect is first fitted on, and kept with the effect's numbers.
// The geometry that the same fit identifies would turn and stretch it: by thousandths, and by a right angle where an
// identified a passes for the link's own length.
#pragma once

#include <map>
#include <string>

#include "fastcal/effects/effect.hpp"
#include "fastcal/effects/owners.hpp"
#include "fastcal/math/check.hpp"

namespace fastcal {

class Beam {
 public:
  static constexpr const char* kOption = "beam";

  /// That of the option `beam`, or else RobotModel::link_axis; throws InvalidInput where it has no length.
  Beam(const std::string& effect, const RobotModel& robot, int link, const Options& options) {
    const std::vector<double> given = list_option(options, kOption);
    if (options.count(kOption) > 0) {
      FASTCAL_CHECK(given.size() == 3) << effect << ": beam must have 3 numbers, got " << given.size();
      whole_ = {given[0], given[1], given[2]};
      FASTCAL_CHECK(whole_.allFinite()) << effect << ": beam must hold finite numbers";
    } else {
      const Chain chain = robot.chain();
      whole_ = chain.constants[static_cast<std::size_t>(link_frame(link))].R.transpose() * robot.link_axis(link);
    }
    length_ = whole_.norm();
    FASTCAL_CHECK(length_ > 0) << effect << ": link" << link + 1 << " has no length";
    axis_ = whole_ / length_;
  }

  double length() const { return length_; }              ///< [m]
  const Eigen::Vector3d& axis() const { return axis_; }  ///< from root to far end, in the axes of the far end
  std::map<std::string, ListOption> reference() const {  ///< Effect::reference
    return {{kOption, {"m", {whole_.x(), whole_.y(), whole_.z()}}}};
  }

 private:
  double length_ = 0;
  Eigen::Vector3d whole_, axis_;
};

}  // namespace fastcal
