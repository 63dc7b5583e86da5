// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/design/search.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

namespace fastcal::design {
namespace {

using Members = std::vector<Eigen::Index>;

constexpr double kRounding = 1e-10;  // of a value: less is no gain

/// The candidate that gains most of those not taken, -1 where all are.
Eigen::Index best_addition(const Scan& scan, const std::vector<bool>& taken) {
  const Eigen::VectorXd gains = scan.gains();
  Eigen::Index best = -1;
  for (Eigen::Index c = 0; c < gains.size(); ++c) {
    if (!taken[static_cast<std::size_t>(c)] && (best < 0 || gains[c] > gains[best])) best = c;
  }
  return best;
}

void restart(Scan& scan, const Eigen::MatrixXd& start, const Members& members) {
  scan.restart(start + scan.candidates().information(members));
}

/// Exchanges within scan's candidates, pass after pass over the members, until a pass changes nothing.
void exchange_within(Scan& scan, Members& members, int most_passes) {
  std::vector<bool> taken(static_cast<std::size_t>(scan.candidates().count()), false);
  for (const Eigen::Index c : members) taken[static_cast<std::size_t>(c)] = true;
  for (int pass = 0; pass < most_passes; ++pass) {
    bool changed = false;
    for (Eigen::Index& member : members) {
      const double before = scan.value();
      const Eigen::Index old = member;
      scan.remove(old);
      taken[static_cast<std::size_t>(old)] = false;
      Eigen::Index best = best_addition(scan, taken);
      scan.add(best);
      if (best != old && !(scan.value() > before + kRounding * std::abs(before))) {
        scan.remove(best);
        scan.add(best = old);
      }
      taken[static_cast<std::size_t>(best)] = true;
      changed = changed || best != old;
      member = best;
    }
    if (!changed) return;
  }
}

}  // namespace

std::vector<Eigen::Index> draw(Eigen::Index n, Eigen::Index count, std::uint64_t seed) {
  Members all(static_cast<std::size_t>(n));
  std::iota(all.begin(), all.end(), Eigen::Index{0});
  std::mt19937_64 random(seed);
  for (Eigen::Index i = 0; i < count; ++i) {  // the standard's distributions differ from library to library
    const auto j = i + static_cast<Eigen::Index>(random() % static_cast<std::uint64_t>(n - i));
    std::swap(all[static_cast<std::size_t>(i)], all[static_cast<std::size_t>(j)]);
  }
  all.resize(static_cast<std::size_t>(count));
  return all;
}

std::vector<Eigen::Index> best_of(const Eigen::VectorXd& scores, Eigen::Index count,
                                  const std::vector<Eigen::Index>& always) {
  Members order(static_cast<std::size_t>(scores.size()));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  const auto end = order.begin() + std::min(count, scores.size());
  std::partial_sort(order.begin(), end, order.end(), [&](Eigen::Index a, Eigen::Index b) {
    return scores[a] > scores[b] || (scores[a] == scores[b] && a < b);
  });
  order.erase(end, order.end());
  order.insert(order.end(), always.begin(), always.end());
  std::sort(order.begin(), order.end());
  order.erase(std::unique(order.begin(), order.end()), order.end());
  return order;
}

std::vector<Eigen::Index> grow(Scan& scan, const Eigen::MatrixXd& start, Eigen::Index count) {
  FASTCAL_CHECK(count >= 1 && count <= scan.candidates().count())
      << "count must lie between 1 and the " << scan.candidates().count() << " candidates, got " << count;
  std::vector<bool> taken(static_cast<std::size_t>(scan.candidates().count()), false);
  Members members;
  scan.restart(start);
  while (static_cast<Eigen::Index>(members.size()) < count) {
    members.push_back(best_addition(scan, taken));
    taken[static_cast<std::size_t>(members.back())] = true;
    scan.add(members.back());
  }
  return members;
}

Choice exchange(Scan& scan, const Eigen::MatrixXd& start, std::vector<Eigen::Index> members,
                const SearchOptions& options) {
  constexpr int kMostPasses = 50;
  restart(scan, start, members);
  for (int round = 0; round < options.most_rounds; ++round) {
    const double before = scan.value();
    const Members listed = best_of(scan.gains(), options.shortlist, members);
    const Candidates few = scan.candidates().subset(listed);
    const std::unique_ptr<Scan> within = scan.over(few);
    Members places;
    for (const Eigen::Index member : members) {
      places.push_back(std::lower_bound(listed.begin(), listed.end(), member) - listed.begin());
    }
    restart(*within, start, places);
    exchange_within(*within, places, kMostPasses);
    std::transform(places.begin(), places.end(), members.begin(),
                   [&](Eigen::Index place) { return listed[static_cast<std::size_t>(place)]; });
    restart(scan, start, members);
    if (scan.value() - before <= options.tolerance * std::abs(before)) break;
  }
  Eigen::VectorXd most = scan.sensitivities();
  double excess = 0;
  for (const Eigen::Index c : members) excess -= most[c];
  const auto n = static_cast<Eigen::Index>(members.size());
  std::nth_element(most.data(), most.data() + n, most.data() + most.size(), std::greater<>());
  excess += most.head(n).sum();
  return {members, scan.value(), scan.bound(excess)};
}

}  // namespace fastcal::design
