// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/structure/elimination.hpp"

#include <algorithm>
#include <set>

namespace fastcal::beam {

int Elimination::block(int row, int column) const {
  if (row == column) return row;
  const auto begin = slot_row.begin() + slot_begin[static_cast<std::size_t>(column)];
  const auto end = slot_row.begin() + slot_begin[static_cast<std::size_t>(column) + 1];
  return free_count + static_cast<int>(std::lower_bound(begin, end, row) - slot_row.begin());
}

Elimination plan_elimination(const std::vector<std::pair<int, int>>& edges, const std::vector<bool>& held) {
  std::vector<std::set<int>> neighbours(held.size());
  const auto at = [](int index) { return static_cast<std::size_t>(index); };
  for (const auto& [a, b] : edges) {
    if (held[at(a)] || held[at(b)]) continue;
    neighbours[at(a)].insert(b);
    neighbours[at(b)].insert(a);
  }
  std::set<std::pair<std::size_t, int>> by_degree;
  for (std::size_t node = 0; node < held.size(); ++node) {
    if (!held[node]) by_degree.emplace(neighbours[node].size(), static_cast<int>(node));
  }

  Elimination plan;
  plan.position.assign(held.size(), -1);
  std::vector<std::vector<int>> column_nodes;
  while (!by_degree.empty()) {
    const int node = by_degree.begin()->second;
    by_degree.erase(by_degree.begin());
    plan.position[at(node)] = plan.free_count++;
    const std::set<int> clique = std::move(neighbours[at(node)]);
    for (const int i : clique) {
      by_degree.erase({neighbours[at(i)].size(), i});
      neighbours[at(i)].erase(node);
      for (const int j : clique) {
        if (i != j) neighbours[at(i)].insert(j);
      }
      by_degree.emplace(neighbours[at(i)].size(), i);
    }
    column_nodes.emplace_back(clique.begin(), clique.end());
  }

  plan.slot_begin.push_back(0);
  for (std::vector<int>& rows : column_nodes) {
    for (int& row : rows) row = plan.position[at(row)];
    std::sort(rows.begin(), rows.end());
    plan.slot_row.insert(plan.slot_row.end(), rows.begin(), rows.end());
    plan.slot_begin.push_back(static_cast<int>(plan.slot_row.size()));
  }
  for (const std::vector<int>& rows : column_nodes) {
    for (const int i : rows) {
      for (const int j : rows) {
        if (j <= i) plan.update.push_back(plan.block(i, j));
      }
    }
  }
  return plan;
}

}  // namespace fastcal::beam
