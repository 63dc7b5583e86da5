// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/robot/urdf_ends.hpp"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <set>
#include <string_view>
#include <utility>

#include "fastcal/math/check.hpp"

namespace fastcal {
namespace {

constexpr std::size_t kMostListed = 12;

/// A link at which an arm may end.
struct Tip {
  std::string name;
  std::string last_moved;  ///< the link that the last moving joint before it carries
  int joint_count = 0;     ///< moving joints from the base
};

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < std::min(names.size(), kMostListed); ++i) text += (i == 0 ? "" : ", ") + names[i];
  return names.size() > kMostListed ? text + " and " + std::to_string(names.size() - kMostListed) + " more" : text;
}

const std::string& root_of(const LinkTree& tree) {
  const auto root = std::find_if(tree.begin(), tree.end(), [](const auto& link) { return link.second.parent.empty(); });
  FASTCAL_CHECK(root != tree.end()) << "the URDF has no root link";
  return root->first;
}

/// The links that hang on `base` (empty: below the last floating or planar joint), in the order of their names; with
/// `leaves_alone` those on which no other hangs.
std::vector<Tip> links(const LinkTree& tree, const std::string& base, bool leaves_alone) {
  std::set<std::string> parents;
  for (const auto& [name, mount] : tree) parents.insert(mount.parent);
  std::vector<Tip> found;
  for (const auto& [name, mount] : tree) {
    if (leaves_alone && parents.contains(name)) continue;
    Tip tip{name, "", 0};
    const std::string* link = &name;
    // A ring of links has no end: no way is longer than the tree.
    for (std::size_t steps = 0; steps < tree.size() && *link != base; ++steps) {
      const LinkMount& up = tree.at(*link);
      if (up.parent.empty() || (base.empty() && up.is_free)) break;
      if (up.moves && tip.joint_count++ == 0) tip.last_moved = *link;
      link = &up.parent;
    }
    if (base.empty() || *link == base) found.push_back(tip);
  }
  return found;
}

bool is_named(const Tip& tip, const std::string& name) { return tip.name == name || tip.name.ends_with("_" + name); }

/// A flange with the prefix of the arm's own links: a gripper may have one too.
bool is_flange(const Tip& tip) {
  constexpr std::string_view kName = "flange";
  if (!is_named(tip, std::string(kName))) return false;
  return tip.last_moved.starts_with(tip.name.substr(0, tip.name.size() - kName.size()));
}

/// The frame at which the controller's tools begin in ROS (REP-199), whatever is fixed on it; else the flange, else a
/// leaf that is called the tool's centre. Empty where none or several are called so. A file that fastcal wrote has the
/// robot file's tool as a frame `tool` on its flange, and ends there.
std::string named_end(const LinkTree& tree, const std::string& base) {
  const auto only = [](const std::vector<Tip>& tips, const auto& fits) {
    const auto moved = [&](const Tip& tip) { return tip.joint_count > 0 && fits(tip); };
    return std::count_if(tips.begin(), tips.end(), moved) == 1 ? std::find_if(tips.begin(), tips.end(), moved)->name
                                                               : std::string();
  };
  const std::vector<Tip> all = links(tree, base, false);
  std::string name = only(all, [](const Tip& tip) { return is_named(tip, "tool0"); });
  const auto written = tree.find("tool");
  if (name.empty() && written != tree.end() && written->second.parent == "flange") return "tool";
  if (name.empty()) name = only(all, is_flange);
  if (name.empty()) name = only(links(tree, base, true), [](const Tip& tip) { return is_named(tip, "tcp"); });
  return name;
}

std::string chosen_tip(const LinkTree& tree, const std::string& base, std::vector<std::string>& notes) {
  const std::vector<Tip> all = links(tree, base, true);
  FASTCAL_CHECK(!all.empty()) << "no link of the URDF hangs on base_link '" << base << "'";
  std::vector<Tip> moving;
  std::copy_if(all.begin(), all.end(), std::back_inserter(moving), [](const Tip& tip) { return tip.joint_count > 0; });
  if (moving.empty()) return all.front().name;  // an arm without joints, which is refused elsewhere
  const auto chosen = [&](const std::string& name) {
    std::vector<std::string> others;
    for (const Tip& tip : all)
      if (tip.name != name) others.push_back(tip.name);
    if (!others.empty()) notes.push_back("tip_link '" + name + "' was chosen; the URDF also ends in " + listed(others));
    return name;
  };
  if (const std::string name = named_end(tree, base); !name.empty()) return chosen(name);
  std::map<std::string, std::vector<Tip>> ways;  // by the last link that moves: beyond it tips differ by constants
  for (const Tip& tip : moving) ways[tip.last_moved].push_back(tip);
  const auto name_of = [](const auto& way) { return way.second.size() == 1 ? way.second[0].name : way.first; };
  if (ways.size() == 1) return chosen(name_of(*ways.begin()));

  std::vector<std::pair<int, std::string>> ordered;
  ordered.reserve(ways.size());
  for (const auto& way : ways) ordered.emplace_back(-way.second[0].joint_count, name_of(way));
  std::sort(ordered.begin(), ordered.end());
  std::vector<std::string> names;
  names.reserve(ways.size());
  for (const auto& [count, name] : ordered)
    names.push_back(name + " (" + std::to_string(-count) + (count == -1 ? " joint)" : " joints)"));
  FASTCAL_CHECK(false) << "the URDF has " << ways.size() << " arms, name the end of one as tip_link: " << listed(names);
  return {};
}

/// The root, or the link below the last floating or planar joint above `tip`.
std::string chosen_base(const LinkTree& tree, const std::string& tip, std::vector<std::string>& notes) {
  const std::string* link = &tip;
  for (std::size_t steps = 0; steps < tree.size() && !tree.at(*link).parent.empty(); ++steps) {
    if (tree.at(*link).is_free) {
      notes.push_back("base_link '" + *link + "' was chosen: the joint above it is floating or planar");
      return *link;
    }
    link = &tree.at(*link).parent;
  }
  return root_of(tree);
}

}  // namespace

UrdfEnds choose_ends(const LinkTree& tree, const std::string& base_link, const std::string& tip_link) {
  FASTCAL_CHECK(base_link.empty() || tree.contains(base_link))
      << "the URDF has no link '" << base_link << "' for base_link; its root is '" << root_of(tree) << "'";
  UrdfEnds ends{base_link, tip_link, {}};
  if (tip_link.empty()) ends.tip = chosen_tip(tree, base_link, ends.notes);
  if (!tree.contains(ends.tip)) {
    std::vector<std::string> names;
    for (const Tip& tip : links(tree, "", true)) names.push_back(tip.name);
    FASTCAL_CHECK(false) << "the URDF has no link '" << tip_link << "' for tip_link; it ends in " << listed(names);
  }
  if (base_link.empty()) ends.base = chosen_base(tree, ends.tip, ends.notes);
  return ends;
}

}  // namespace fastcal
