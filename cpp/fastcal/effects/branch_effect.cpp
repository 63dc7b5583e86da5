// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/effects/branch_effect.hpp"

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "fastcal/math/check.hpp"

namespace fastcal {
namespace {

/// What both kinds of effects forward to the arm's own.
template <class Base>
class OnBranch : public Base {
 public:
  OnBranch(std::shared_ptr<const Effect> effect, const Branch& branch, Chain chain, const ColumnsBefore& before)
      : effect_(std::move(effect)),
        arm_(branch.arm),
        first_frame_(branch.first_frame),
        first_joint_(branch.first_joint),
        joint_count_(branch.joint_count),
        before_(before),
        chain_(std::move(chain)),
        weights_(branch.joint_count),
        parameters_(effect_->parameters()) {
    for (Parameter& parameter : parameters_) parameter.owner = branch.name + "." + parameter.owner;
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  unsigned needs() const override { return effect_->needs(); }
  bool follows_loads() const override { return effect_->follows_loads(); }
  std::vector<std::string> data_columns() const override { return effect_->data_columns(); }
  std::vector<double> penalty() const override { return effect_->penalty(); }
  std::map<std::string, ListOption> reference() const override { return effect_->reference(); }
  bool is_spring() const override { return effect_->is_spring(); }

  double output_error(int joint, const double* theta) const override {
    return is_own(joint) ? effect_->output_error(joint - first_joint_, theta) : 0;
  }
  double joint_compliance(const State& state, int joint, const double* theta) const override {
    return is_own(joint) ? effect_->joint_compliance(part(state), joint - first_joint_, theta) : 0;
  }

 protected:
  bool is_own(int joint) const { return joint >= first_joint_ && joint < first_joint_ + joint_count_; }

  /// The branch's part of a row. The chain is the arm's as it stands in its file: what is identified since turns an
  /// effect's axes by thousandths.
  State part(const State& state) const {
    State out = state.of_arm(arm_);
    const auto skip = [](auto*& from, int by) { from = from == nullptr ? nullptr : from + by; };
    for (const double** joints : {&out.q, &out.approach, &out.current, &out.output, &out.compliance})
      skip(*joints, first_joint_);
    for (const double** loads : {&out.load, &out.payload_load}) skip(*loads, 6 * first_frame_);
    skip(out.frames, first_frame_);
    skip(out.extra, before_.extra);
    skip(out.table, before_.table);
    out.chain = &chain_;
    out.weights = &weights_;
    return out;
  }

  void put(TwistColumns& columns, std::size_t from) const {
    for (std::size_t i = from; i < columns.size(); ++i) columns[i].frame += first_frame_;
  }

  std::shared_ptr<const Effect> effect_;
  int arm_, first_frame_, first_joint_, joint_count_;
  ColumnsBefore before_;
  Chain chain_;
  Weights weights_;  ///< none beside the files': effects that change weights are refused

 private:
  std::vector<Parameter> parameters_;
};

class AnyOnBranch : public OnBranch<Effect> {
 public:
  using OnBranch::OnBranch;

  void deflect(const State& state, const double* theta, Twists& xi, TwistColumns* columns) const override {
    Twists own = Twists::Zero(6, chain_.frame_count());
    const std::size_t first = columns == nullptr ? 0 : columns->size();
    effect_->deflect(part(state), theta, own, columns);
    xi.middleCols(first_frame_, own.cols()) += own;
    if (columns != nullptr) put(*columns, first);
  }
};

class LinearOnBranch : public OnBranch<LinearEffect> {
 public:
  LinearOnBranch(const std::shared_ptr<const LinearEffect>& effect, const Branch& branch, Chain chain,
                 const ColumnsBefore& before)
      : OnBranch(effect, branch, std::move(chain), before), linear_(*effect) {}

  void basis(const State& state, TwistColumns& columns) const override {
    const std::size_t first = columns.size();
    linear_.basis(part(state), columns);
    put(columns, first);
  }

 private:
  const LinearEffect& linear_;
};

}  // namespace

std::shared_ptr<const Effect> on_branch(std::shared_ptr<const Effect> effect, const RobotModel& tree,
                                        const std::string& name, const RobotModel& arm, const ColumnsBefore& before) {
  const std::vector<Branch>& branches = tree.tree().branches();
  const auto found = std::find_if(branches.begin(), branches.end(), [&](const auto& b) { return b.name == name; });
  FASTCAL_CHECK(found != branches.end() && found->joint_count == arm.joint_count() && arm.tree().is_serial())
      << "the cell has no arm '" << name << "' of " << arm.joint_count() << " joints";
  const std::string owner = effect->parameters().empty() ? "" : effect->parameters().front().owner;
  FASTCAL_CHECK(!effect->is_weight() && (effect->needs() & kBending) == 0)
      << "an effect of " << name << "." << owner << " changes weights or beams, which is for an arm that stands alone";
  if (auto linear = std::dynamic_pointer_cast<const LinearEffect>(effect); linear != nullptr)
    return std::make_shared<LinearOnBranch>(linear, *found, arm.chain(), before);
  return std::make_shared<AnyOnBranch>(std::move(effect), *found, arm.chain(), before);
}

}  // namespace fastcal
