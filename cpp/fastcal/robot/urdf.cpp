// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/robot/urdf.hpp"

#include <console_bridge/console.h>
#include <urdf_model/model.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <map>
#include <mutex>
#include <numbers>
#include <string>
#include <utility>

#include "fastcal/math/check.hpp"
#include "fastcal/robot/urdf_ends.hpp"

namespace fastcal {
namespace {

/// While it lives, urdfdom's complaints come here and not onto the terminal.
class Complaints : public console_bridge::OutputHandler {
 public:
  Complaints() : lock_(mutex_) { console_bridge::useOutputHandler(this); }
  ~Complaints() override { console_bridge::restorePreviousOutputHandler(); }
  Complaints(const Complaints&) = delete;
  Complaints& operator=(const Complaints&) = delete;
  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    if (level >= console_bridge::CONSOLE_BRIDGE_LOG_ERROR && first_.empty()) first_ = text;
  }
  const std::string& first() const { return first_; }

 private:
  static inline std::mutex mutex_;  // the handler is one for the whole process
  std::lock_guard<std::mutex> lock_;
  std::string first_;
};

/// The place behind the next `close`, or the end of the text.
std::size_t skipped(const std::string& xml, std::size_t start, const char* close) {
  const std::size_t end = xml.find(close, start);
  return end == std::string::npos ? xml.size() : end + std::string(close).size();
}

/// The place of the '>' that ends the tag at `start`. Only behind '=' does a quote begin a value, as the parser has it.
std::size_t end_of_tag(const std::string& xml, std::size_t start) {
  char last = ' ';
  std::size_t i = start;
  for (; i < xml.size() && xml[i] != '>'; ++i) {
    if ((xml[i] == '"' || xml[i] == '\'') && last == '=') i = std::min(xml.find(xml[i], i + 1), xml.size() - 1);
    if (std::isspace(static_cast<unsigned char>(xml[i])) == 0) last = xml[i];
  }
  return i;
}

/// The XML parser behind urdfdom calls itself for each level: a deep text would end the process, not the call.
void check_nesting(const std::string& xml) {
  constexpr int kDeepest = 1000;
  int depth = 0;
  for (std::size_t i = xml.find('<'); i < xml.size(); i = xml.find('<', i)) {
    if (xml.compare(i, 4, "<!--") == 0) {
      i = skipped(xml, i + 4, "-->");
    } else if (xml.compare(i, 9, "<![CDATA[") == 0) {
      i = skipped(xml, i + 9, "]]>");
    } else if (xml.compare(i, 2, "<?") == 0) {
      i = skipped(xml, i + 2, "?>");
    } else {
      const std::size_t end = end_of_tag(xml, i);
      if (xml.compare(i, 2, "</") == 0) {
        --depth;
      } else if (xml.compare(i, 2, "<!") != 0 && xml[end - 1] != '/') {
        ++depth;
      }
      i = end;
    }
    FASTCAL_CHECK(depth <= kDeepest) << "the URDF nests its elements more than " << kDeepest << " deep";
  }
}

urdf::ModelInterfaceSharedPtr parse(const std::string& xml) {
  check_nesting(xml);
  const Complaints complaints;
  urdf::ModelInterfaceSharedPtr model = urdf::parseURDF(xml);
  FASTCAL_CHECK(model != nullptr) << "the text is not a URDF that can be read"
                                  << (complaints.first().empty() ? "" : ": " + complaints.first());
  return model;
}

Eigen::Vector3d vector(const urdf::Vector3& v) { return {v.x, v.y, v.z}; }

Pose pose(const urdf::Pose& p) {
  const urdf::Rotation& r = p.rotation;
  return {Eigen::Quaterniond(r.w, r.x, r.y, r.z).normalized().toRotationMatrix(), vector(p.position)};
}

/// Inertia of a point mass about the origin, at p (parallel-axis theorem).
Eigen::Matrix3d point_inertia(double mass, const Eigen::Vector3d& p) {
  return mass * (p.squaredNorm() * Eigen::Matrix3d::Identity() - p * p.transpose());
}

/// `link`'s own body in the frame that sees the link at `T`; the inertia turns with the inertial origin.
Body body_of(const urdf::Link& link, const Pose& T) {
  Body body;
  if (!link.inertial) return body;
  const urdf::Inertial& inertial = *link.inertial;
  const Pose centre = T * pose(inertial.origin);
  Eigen::Matrix3d inertia;
  inertia << inertial.ixx, inertial.ixy, inertial.ixz,  //
      inertial.ixy, inertial.iyy, inertial.iyz,         //
      inertial.ixz, inertial.iyz, inertial.izz;
  FASTCAL_CHECK(inertial.mass >= 0) << "link '" << link.name << "': the mass must not be negative, got "
                                    << inertial.mass;
  body.mass = inertial.mass;
  body.com = centre.p;
  body.inertia = centre.R * inertia * centre.R.transpose();
  return body;
}

/// Two bodies of one frame as one.
Body join(const Body& a, const Body& b) {
  if (b.mass == 0 && b.inertia.isZero(0)) return a;
  if (a.mass == 0 && a.inertia.isZero(0)) return b;
  Body both;
  both.mass = a.mass + b.mass;
  both.com = both.mass > 0 ? ((a.mass * a.com + b.mass * b.com) / both.mass).eval() : a.com;
  both.inertia =
      a.inertia + b.inertia + point_inertia(a.mass, a.com - both.com) + point_inertia(b.mass, b.com - both.com);
  return both;
}

/// All that hangs on `link`, seen at `T`, without crossing `next`, the chain's own next joint; names of joints on the
/// way go to `held`.
Body carried(const urdf::ModelInterface& model, const urdf::Link& link, const Pose& T, const urdf::Joint* next,
             std::vector<std::string>& held) {
  Body body;
  std::vector<std::pair<const urdf::Link*, Pose>> open{{&link, T}};
  while (!open.empty()) {
    const auto [parent, T_parent] = open.back();
    open.pop_back();
    body = join(body, body_of(*parent, T_parent));
    for (const urdf::JointSharedPtr& joint : parent->child_joints) {
      if (joint.get() == next) continue;
      if (joint->type != urdf::Joint::FIXED) held.push_back(joint->name);
      open.emplace_back(model.links_.at(joint->child_link_name).get(),
                        T_parent * pose(joint->parent_to_joint_origin_transform));
    }
  }
  return body;
}

std::string joined(const std::vector<std::string>& names) {
  constexpr std::size_t kMostListed = 20;
  std::string text;
  for (std::size_t i = 0; i < std::min(names.size(), kMostListed); ++i) text += (i == 0 ? "" : ", ") + names[i];
  return names.size() > kMostListed ? text + " and " + std::to_string(names.size() - kMostListed) + " more" : text;
}

/// Which link hangs on which, and how.
LinkTree link_tree(const urdf::ModelInterface& model) {
  LinkTree tree;
  for (const auto& [name, link] : model.links_) {
    LinkMount& mount = tree[name];
    if (const urdf::Joint* joint = link->parent_joint.get(); joint != nullptr) {
      mount.parent = joint->parent_link_name;
      mount.is_free = joint->type == urdf::Joint::FLOATING || joint->type == urdf::Joint::PLANAR;
      mount.moves = joint->type != urdf::Joint::FIXED && !mount.is_free;
    }
  }
  return tree;
}

/// The joints from the base to the tip, found from the tip, as each link has one parent.
std::vector<const urdf::Joint*> path(const urdf::ModelInterface& model, const std::string& base,
                                     const std::string& tip) {
  std::vector<const urdf::Joint*> joints;
  std::vector<std::string> links{tip};
  while (links.back() != base) {
    const urdf::Joint* joint = model.links_.at(links.back())->parent_joint.get();
    const bool leads_on = joint != nullptr && joints.size() < model.joints_.size();  // links may form a ring
    FASTCAL_CHECK(leads_on) << "base_link '" << base << "' does not carry tip_link '" << tip
                            << "', which is carried by " << joined(links);
    joints.push_back(joint);
    links.push_back(joint->parent_link_name);
  }
  std::reverse(joints.begin(), joints.end());
  return joints;
}

constexpr double kUnlimitedSlide = 10;  // [m] either way, where a file gives a slide no limits

UrdfJoint moving_joint(const urdf::Joint& joint) {
  FASTCAL_CHECK(joint.type == urdf::Joint::REVOLUTE || joint.type == urdf::Joint::CONTINUOUS ||
                joint.type == urdf::Joint::PRISMATIC)
      << "joint '" << joint.name
      << "': only revolute, continuous, prismatic and fixed joints make a serial arm, and it is none of them";
  UrdfJoint out;
  out.name = joint.name;
  out.type = joint.type == urdf::Joint::PRISMATIC ? JointType::kPrismatic : JointType::kRevolute;
  // Limits that are left out read as 0 and 0.
  out.unlimited = joint.type == urdf::Joint::CONTINUOUS || (joint.limits->lower == 0 && joint.limits->upper == 0);
  out.axis = vector(joint.axis);
  FASTCAL_CHECK(out.axis.allFinite() && out.axis.norm() > 0)
      << "joint '" << joint.name << "': its axis has no direction";
  out.axis.normalize();
  const double range = out.type == JointType::kPrismatic ? kUnlimitedSlide : 2 * std::numbers::pi;
  out.lower = out.unlimited ? -range : joint.limits->lower;
  out.upper = out.unlimited ? range : joint.limits->upper;
  FASTCAL_CHECK(out.lower < out.upper) << "joint '" << joint.name
                                       << "': its lower limit must be below the upper one, got " << out.lower << " and "
                                       << out.upper;
  return out;
}

/// The joint that moves `joint` in the end, and how: q = multiplier q_driver + offset. A mimic of a mimic follows the
/// first in the row.
struct Driver {
  std::string name;
  double multiplier = 1;
  double offset = 0;
};

Driver driver_of(const urdf::ModelInterface& model, const std::string& joint) {
  Driver out{joint};
  const urdf::Joint* at = model.joints_.at(joint).get();
  for (std::size_t steps = 0; at != nullptr && at->mimic; ++steps) {
    FASTCAL_CHECK(steps < model.joints_.size()) << "joint '" << joint << "' in the end mimics itself";
    out.name = at->mimic->joint_name;
    out.offset += out.multiplier * at->mimic->offset;
    out.multiplier *= at->mimic->multiplier;
    const auto next = model.joints_.find(out.name);
    at = next == model.joints_.end() ? nullptr : next->second.get();
  }
  FASTCAL_CHECK(std::isfinite(out.multiplier) && std::isfinite(out.offset))
      << "joint '" << joint << "': expected a finite multiplier and offset of its mimic";
  return out;
}

/// What drives the joints of the chain that mimic others. Where the driver lies beside the chain (a motor that is a
/// joint of its own) or nowhere, the first joint that follows it moves by itself, and the others follow that one:
/// with q_1 = m_1 d + o_1 of the driver's d, q_k = m_k / m_1 q_1 + o_k - m_k / m_1 o_1.
void add_mimics(const urdf::ModelInterface& model, UrdfChain& chain) {
  std::map<std::string, std::pair<int, Driver>> leads;  // by the driver's name: the joint that stands for it
  for (std::size_t i = 0; i < chain.joints.size(); ++i) {
    leads.insert({chain.joints[i].name, {static_cast<int>(i), Driver{chain.joints[i].name}}});
  }
  for (std::size_t i = 0; i < chain.joints.size(); ++i) {
    UrdfJoint& joint = chain.joints[i];
    const Driver driver = driver_of(model, joint.name);
    if (driver.name == joint.name) continue;
    const auto lead = leads.find(driver.name);
    if (lead == leads.end() || lead->second.second.multiplier == 0) {
      chain.notes.push_back("joint '" + joint.name + "' mimics joint '" + driver.name +
                            "', which is not between the base and the tip: give its own position");
      leads[driver.name] = {static_cast<int>(i), driver};
      continue;
    }
    const auto& [first, of_first] = lead->second;
    const double multiplier = driver.multiplier / of_first.multiplier;
    joint.mimic = Mimic{first, multiplier, driver.offset - multiplier * of_first.offset};
  }
}

}  // namespace

UrdfChain read_urdf(const std::string& xml, const std::string& base_link, const std::string& tip_link) {
  const urdf::ModelInterfaceSharedPtr model = parse(xml);
  const UrdfEnds ends = choose_ends(link_tree(*model), base_link, tip_link);
  UrdfChain chain;
  chain.name = model->getName();
  chain.base_link = ends.base;
  chain.tip_link = ends.tip;
  chain.notes = ends.notes;

  const std::vector<const urdf::Joint*> joints = path(*model, chain.base_link, chain.tip_link);
  std::vector<std::string> held;
  std::vector<std::string> unlimited;
  Pose T;  // the present link in the frame of the last moving joint
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const Pose mount = T;
    T = T * pose(joints[i]->parent_to_joint_origin_transform);
    if (joints[i]->type != urdf::Joint::FIXED) {
      chain.joints.push_back(moving_joint(*joints[i]));
      chain.joints.back().mount = mount;
      chain.joints.back().origin = T;
      T = Pose{};
      if (chain.joints.back().unlimited) unlimited.push_back(joints[i]->name);
    }
    if (chain.joints.empty()) continue;  // a link that never moves loads no joint
    const urdf::Link& link = *model->links_.at(joints[i]->child_link_name);
    const urdf::Joint* next = i + 1 < joints.size() ? joints[i + 1] : nullptr;
    Body& body = chain.joints.back().body;
    body = join(body, carried(*model, link, T, next, held));
  }
  FASTCAL_CHECK(!chain.joints.empty()) << "no joint moves between link '" << chain.base_link << "' and link '"
                                       << chain.tip_link << "'";
  chain.flange = T;
  add_mimics(*model, chain);
  if (!unlimited.empty())
    chain.notes.push_back("joints without limits get -360 and 360 degrees, slides -10 and 10 m: " + joined(unlimited));
  if (!held.empty()) chain.notes.push_back("joints beside the arm are held at 0 with what they carry: " + joined(held));
  return chain;
}

}  // namespace fastcal
