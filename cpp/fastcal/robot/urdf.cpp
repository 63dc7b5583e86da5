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

using Joints = std::vector<const urdf::Joint*>;

/// All that hangs on `link`, seen at `T`, without crossing joints on the way to a tip; names of joints beside go to
/// `held`.
Body carried(const urdf::ModelInterface& model, const urdf::Link& link, const Pose& T, const Joints& on_the_way,
             std::vector<std::string>& held) {
  Body body;
  std::vector<std::pair<const urdf::Link*, Pose>> open{{&link, T}};
  while (!open.empty()) {
    const auto [parent, T_parent] = open.back();
    open.pop_back();
    body = join(body, body_of(*parent, T_parent));
    for (const urdf::JointSharedPtr& joint : parent->child_joints) {
      if (std::find(on_the_way.begin(), on_the_way.end(), joint.get()) != on_the_way.end()) continue;
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
Joints path(const urdf::ModelInterface& model, const std::string& base, const std::string& tip) {
  Joints joints;
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

/// The chain of these joints, which begin at its base_link and end at its tip_link.
void read_chain(const urdf::ModelInterface& model, const Joints& joints, const Joints& on_the_way, UrdfChain& chain) {
  std::vector<std::string> held;
  std::vector<std::string> unlimited;
  Pose T;  // the present link in the frame of the last moving joint
  for (const urdf::Joint* joint : joints) {
    const Pose mount = T;
    T = T * pose(joint->parent_to_joint_origin_transform);
    if (joint->type != urdf::Joint::FIXED) {
      chain.joints.push_back(moving_joint(*joint));
      chain.joints.back().mount = mount;
      chain.joints.back().origin = T;
      T = Pose{};
      if (chain.joints.back().unlimited) unlimited.push_back(joint->name);
    }
    const urdf::Link& link = *model.links_.at(joint->child_link_name);
    Body& body = chain.joints.empty() ? chain.ahead : chain.joints.back().body;
    std::vector<std::string> unmoved;  // beside what no joint of the chain moves
    body = join(body, carried(model, link, T, on_the_way, chain.joints.empty() ? unmoved : held));
  }
  FASTCAL_CHECK(!chain.joints.empty()) << "no joint moves between link '" << chain.base_link << "' and link '"
                                       << chain.tip_link << "'";
  chain.flange = T;
  add_mimics(model, chain);
  if (!unlimited.empty())
    chain.notes.push_back("joints without limits get -360 and 360 degrees, slides -10 and 10 m: " + joined(unlimited));
  if (!held.empty()) chain.notes.push_back("joints beside the arm are held at 0 with what they carry: " + joined(held));
}

bool moves(const urdf::Joint* joint) { return joint->type != urdf::Joint::FIXED; }

/// The ways from a base to several tips, parted into chains.
class Ways {
 public:
  Ways(const urdf::ModelInterface& model, const std::string& base, const std::vector<std::string>& tips)
      : model_(model), tips_(tips) {
    for (const std::string& tip : tips) {
      for (const urdf::Joint* joint : path(model, base, tip)) {
        if (std::find(all_.begin(), all_.end(), joint) == all_.end()) all_.push_back(joint);
      }
    }
    follow(base, base, {}, -1);
  }

  std::vector<UrdfBranch> branches() && { return std::move(branches_); }

 private:
  /// From `link`, which `ahead` leads to from `start`, on: a chain ends where ways part or a tip is.
  void follow(const std::string& start, const std::string& link, Joints ahead, int parent) {
    Joints next;
    std::copy_if(all_.begin(), all_.end(), std::back_inserter(next),
                 [&](const urdf::Joint* joint) { return joint->parent_link_name == link; });
    const bool is_tip = std::find(tips_.begin(), tips_.end(), link) != tips_.end();
    const bool ends = std::any_of(ahead.begin(), ahead.end(), moves) && (is_tip || next.size() != 1);
    FASTCAL_CHECK(ends || !is_tip) << "no joint moves between link '" << start << "' and tip_link '" << link << "'";
    if (ends) {
      UrdfBranch branch{parent, {}};
      branch.chain.name = model_.getName();
      branch.chain.base_link = start;
      branch.chain.tip_link = link;
      read_chain(model_, ahead, all_, branch.chain);
      if (parent >= 0) {  // links of fixed joints behind the fork move with it
        UrdfChain& fork = branches_[static_cast<std::size_t>(parent)].chain;
        Body here = branch.chain.ahead;
        here.com = fork.flange * here.com;
        here.inertia = fork.flange.R * here.inertia * fork.flange.R.transpose();
        fork.joints.back().body = join(fork.joints.back().body, here);
      }
      parent = static_cast<int>(branches_.size());
      branches_.push_back(std::move(branch));
      ahead.clear();
    }
    for (const urdf::Joint* joint : next) {
      Joints way = ahead;
      way.push_back(joint);
      follow(ends ? link : start, joint->child_link_name, way, parent);
    }
  }

  const urdf::ModelInterface& model_;
  const std::vector<std::string>& tips_;
  Joints all_;
  std::vector<UrdfBranch> branches_;
};

}  // namespace

UrdfChain read_urdf(const std::string& xml, const std::string& base_link, const std::string& tip_link) {
  const urdf::ModelInterfaceSharedPtr model = parse(xml);
  const UrdfEnds ends = choose_ends(link_tree(*model), base_link, tip_link);
  UrdfChain chain;
  chain.name = model->getName();
  chain.base_link = ends.base;
  chain.tip_link = ends.tip;
  chain.notes = ends.notes;
  const Joints joints = path(*model, chain.base_link, chain.tip_link);
  read_chain(*model, joints, joints, chain);
  return chain;
}

std::vector<UrdfBranch> read_urdf_tree(const std::string& xml, const std::string& base_link,
                                       const std::vector<std::string>& tip_links) {
  FASTCAL_CHECK(!tip_links.empty()) << "expected at least one tip_link, got none";
  const urdf::ModelInterfaceSharedPtr model = parse(xml);
  std::string base = base_link;
  std::vector<std::string> tips;
  for (const std::string& tip : tip_links) {
    const UrdfEnds ends = choose_ends(link_tree(*model), base, tip);
    if (base.empty()) base = ends.base;
    tips.push_back(ends.tip);
  }
  return Ways(*model, base, tips).branches();
}

}  // namespace fastcal
