// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/kernels/spring_rows.hpp"

#include "fastcal/kernels/instruction_sets.hpp"
#include "fastcal/kernels/lane_groups.hpp"

#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"  // of constructors that it inlines late
#endif

namespace fastcal::kernels {
namespace {

constexpr int kMaxRounds = 40;
constexpr double kSettled = 1e-30;  // square of what the step after the last would be [rad, m]
constexpr double kNothing = 1e-100;
constexpr double kSoft = 1e-6;   // square by which steps shrink from where on Newton's pays
constexpr double kSmall = 0.01;  // [rad]: to there the series of turned() miss less than 1e-17

/// Sine and cosine of an angle, turned on by d, |d| <= kSmall; z = d^2.
template <typename Rows>
FASTCAL_INLINE void turned(const Rows& s, const Rows& c, const Rows& d, const Rows& z, Rows& sine, Rows& cosine) {
  const Rows sine_d = d + d * z * (-1.0 / 6 + z * (1.0 / 120));
  const Rows less = z * (-1.0 / 2 + z * (1.0 / 24 + z * (-1.0 / 720)));  // cos d - 1
  sine = s + (c * sine_d + s * less);
  cosine = c + (c * less - s * sine_d);
}

/// v <- Rz v.
template <typename Rows>
FASTCAL_INLINE void turn(Rows* v, const Rows& sine, const Rows& cosine) {
  const Rows x = v[0];
  v[0] = cosine * x - sine * v[1];
  v[1] = sine * x + cosine * v[1];
}

/// v <- Rz^-1 v.
template <typename Rows>
FASTCAL_INLINE void turn_back(Rows* v, const Rows& sine, const Rows& cosine) {
  const Rows x = v[0];
  v[0] = cosine * x + sine * v[1];
  v[1] = cosine * v[1] - sine * x;
}

/// v <- R v + mass p, the pose of kPoseNumbers as in a FrameRows.
template <typename Rows, typename Number>
FASTCAL_INLINE void move(Rows* v, const Rows& mass, const Number* pose) {
  const Rows x = v[0], y = v[1], z = v[2];
  for (int r = 0; r < 3; ++r) v[r] = (x * pose[r] + y * pose[3 + r]) + (z * pose[6 + r] + mass * pose[9 + r]);
}

/// v <- R^-1 v.
template <typename Rows, typename Number>
FASTCAL_INLINE void rotate_back(Rows* v, const Number* pose) {
  const Rows x = v[0], y = v[1], z = v[2];
  for (int c = 0; c < 3; ++c) v[c] = x * pose[3 * c] + y * pose[3 * c + 1] + z * pose[3 * c + 2];
}

/// v <- Rx v.
template <typename Rows>
FASTCAL_INLINE void pass(Rows* v, const SpringLink& link) {
  const Rows y = v[1];
  v[1] = y * link.cosine - v[2] * link.sine;
  v[2] = y * link.sine + v[2] * link.cosine;
}

/// v <- Rx^-1 v.
template <typename Rows>
FASTCAL_INLINE void pass_back(Rows* v, const SpringLink& link) {
  const Rows y = v[1];
  v[1] = y * link.cosine + v[2] * link.sine;
  v[2] = v[2] * link.cosine - y * link.sine;
}

/// A group of arms in one posture each. Vectors of a joint are in its frame behind its turn, whose z is the axis. N:
/// the joints, all of which turn, between links that are the same in all rows; 0: any chain.
template <int W, int N>
struct Arms {
  using Rows = Group<W>;
  static constexpr int kMost = N > 0 ? N : kMostSprings;

  const Springs& springs;
  const int stride;
  int row = 0;

  Rows payload;
  Rows base_sine[kMost], base_cosine[kMost];      // of the joints
  Rows turns[kMost], sine[kMost], cosine[kMost];  // the turns that are sought; of the joints with them
  Rows down[kMost][3];                            // direction of gravity
  Rows moment[kMost][2];                          // x, y of the first moment of all beyond about the origin [kg m]
  Rows short_of[kMost];                           // c tau - d

  FASTCAL_INLINE Arms(const Springs& of, int rows) : springs(of), stride(rows) {}

  FASTCAL_INLINE int joints() const { return N > 0 ? N : springs.joint_count; }
  FASTCAL_INLINE bool slides(int j) const { return N == 0 && springs.joints[j].slides; }

  FASTCAL_INLINE void start() {
    if (loaded()) payload.load(springs.payload + row);
    for (int j = 0; j < joints(); ++j) {
      const SpringJoint& joint = springs.joints[j];
      load_joint(j, base_sine[j], base_cosine[j]);
      if (joint.sine != 0) {
        const Rows s = base_sine[j], c = base_cosine[j];
        base_sine[j] = s * joint.cosine + c * joint.sine;
        base_cosine[j] = c * joint.cosine - s * joint.sine;
      }
      sine[j] = base_sine[j];
      cosine[j] = base_cosine[j];
      turns[j] = 0.0;
    }
  }

  FASTCAL_INLINE void load_joint(int j, Rows& s, Rows& c) const {
    if (slides(j)) return;
    s.load(springs.joints[j].sine_cosine + row);
    c.load(springs.joints[j].sine_cosine + stride + row);
  }

  /// Sines and cosines of the joints with their turns, `s` and `c` without.
  FASTCAL_INLINE void turn_joints(const Rows* s, const Rows* c) {
    Rows sum = 0.0;
    for (int j = 0; j < joints(); ++j) {
      const Rows square = turns[j] * turns[j];
      sum += square;
      turned(s[j], c[j], turns[j], square, sine[j], cosine[j]);
    }
    if (!Rows::choose(sum, kSmall * kSmall, 1.0, 0.0).any()) return;
    for (int j = 0; j < joints(); ++j) {
      const Rows square = turns[j] * turns[j];
      Rows s_j, c_j;
      for (int p = 0; p < Rows::kParts; ++p) sine_cosine<W>(turns[j].part[p], s_j.part[p], c_j.part[p]);
      sine[j] = Rows::choose(square, kSmall * kSmall, s[j] * c_j + c[j] * s_j, sine[j]);
      cosine[j] = Rows::choose(square, kSmall * kSmall, c[j] * c_j - s[j] * s_j, cosine[j]);
    }
  }

  /// Does joint j make the turn of this frame?
  FASTCAL_INLINE bool is_turned(int f) const { return f % 2 == 1 && !slides(f / 2); }

  FASTCAL_INLINE void load_turn(int f, Rows& s, Rows& c) const {
    s.load(springs.frames[f].sine_cosine + row);
    c.load(springs.frames[f].sine_cosine + stride + row);
  }

  FASTCAL_INLINE void load_motion(int f, Rows* motion) const {
    for (int k = 0; k < kPoseNumbers; ++k) motion[k].load(springs.frames[f].motion + k * stride + row);
  }

  /// A direction of the frame before as one of this frame.
  FASTCAL_INLINE void enter_frame(int f, Rows* v) const {
    const FrameRows& frame = springs.frames[f];
    rotate_back(v, frame.constant);
    if (is_turned(f)) {
      turn_back(v, sine[f / 2], cosine[f / 2]);
    } else if (frame.turn) {
      Rows s, c;
      load_turn(f, s, c);
      turn_back(v, s, c);
    }
    if (!frame.motion) return;
    Rows motion[kPoseNumbers];
    load_motion(f, motion);
    rotate_back(v, motion);
  }

  /// The first moment of a mass about the origin of this frame as that about the origin of the frame before.
  FASTCAL_INLINE void leave_frame(int f, Rows* v, const Rows& mass) const {
    const FrameRows& frame = springs.frames[f];
    if (frame.motion) {
      Rows motion[kPoseNumbers];
      load_motion(f, motion);
      move(v, mass, motion);
    }
    if (is_turned(f)) {
      turn(v, sine[f / 2], cosine[f / 2]);
    } else if (frame.turn) {
      Rows s, c;
      load_turn(f, s, c);
      turn(v, s, c);
    }
    if (frame.slide) {
      Rows slide;
      slide.load(frame.slide + row);
      v[2] += mass * slide;
    }
    if (f % 2 == 1 && slides(f / 2)) v[2] += mass * turns[f / 2];
    move(v, mass, frame.constant);
  }

  FASTCAL_INLINE bool loaded() const { return springs.payload != nullptr; }
  /// Adds what the payload alone, behind a link, has about its beginning.
  FASTCAL_INLINE void carry(Rows* v, const SpringLink& link) const {
    if (!loaded()) return;
    for (int r = 0; r < 3; ++r) v[r] += payload * link.p[r];
  }

  /// First moment of the payload about the last joint.
  FASTCAL_INLINE void hang_payload(Rows* s) const {
    for (int r = 0; r < 3; ++r) s[r] = payload * springs.payload_at[r];
    if (!linked()) return leave_frame(2 * joints(), s, payload);
    pass(s, springs.links[joints()]);
    carry(s, springs.links[joints()]);
  }

  FASTCAL_INLINE bool linked() const { return N > 0 || springs.links != nullptr; }

  FASTCAL_INLINE void enter_joint(int j, Rows* v) const {
    if (linked()) {
      pass_back(v, springs.links[j]);
      return turn_back(v, sine[j], cosine[j]);
    }
    enter_frame(2 * j, v);
    enter_frame(2 * j + 1, v);
  }

  FASTCAL_INLINE void leave_joint(int j, Rows* v, const Rows& mass) const {
    if (linked()) {
      turn(v, sine[j], cosine[j]);
      pass(v, springs.links[j]);
      return carry(v, springs.links[j]);
    }
    leave_frame(2 * j + 1, v, mass);
    leave_frame(2 * j, v, mass);
  }

  /// What the turns fall short of: g goes up the arm, the first moments s come down, tau = |g| z . (s x g).
  FASTCAL_INLINE void weigh() {
    Rows g[3], s[3], mass = payload;
    for (int r = 0; r < 3; ++r) g[r] = springs.down[r];
    for (int j = 0; j < joints(); ++j) {
      enter_joint(j, g);
      for (int r = 0; r < 3; ++r) down[j][r] = g[r];
    }
    if (loaded()) hang_payload(s);
    for (int j = joints() - 1; j >= 0; --j) {
      const SpringJoint& joint = springs.joints[j];
      for (int r = 0; r < 3; ++r) s[r] += joint.moment[r];
      if (!linked()) mass += joint.mass;
      for (int r = 0; r < 2; ++r) moment[j][r] = s[r];
      Rows load = s[0] * down[j][1] - s[1] * down[j][0];
      if (slides(j)) load = mass * down[j][2];
      short_of[j] = load * joint.give - turns[j];
      if (j > 0) leave_joint(j, s, mass);
    }
  }

  /// The step of Newton instead of what was short, in rows that are 1 and not 0 in `here`: (1 - E)^-1 as 1 + E, where
  /// E = c d tau / d q is small for every arm that stands well. It is the derivative of weigh() along what was short,
  /// x. Squares by which E shrinks it, |E x|^2 / |x|^2.
  FASTCAL_INLINE Rows find_step(const Rows& here) {
    Rows g[3], s[3], mass = payload, step[kMost], change[kMost][3];
    Rows size = kNothing, moved;
    for (int j = 0; j < joints(); ++j) {
      if (j > 0) enter_joint(j, g);
      if (!slides(j)) {
        g[0] += short_of[j] * down[j][1];
        g[1] = g[1] - short_of[j] * down[j][0];
      }
      for (int r = 0; r < 3; ++r) change[j][r] = g[r];
    }
    for (int j = joints() - 1; j >= 0; --j) {
      if (!linked()) mass += springs.joints[j].mass;
      Rows load = s[0] * down[j][1] + moment[j][0] * change[j][1] - s[1] * down[j][0] - moment[j][1] * change[j][0];
      if (slides(j)) load = mass * change[j][2];
      load = load * springs.joints[j].give;
      step[j] = short_of[j] + here * load;
      size += short_of[j] * short_of[j];
      moved += load * load;
      if (slides(j)) {
        s[2] += mass * short_of[j];
      } else {
        s[0] = s[0] - short_of[j] * moment[j][1];
        s[1] += short_of[j] * moment[j][0];
      }
      if (j == 0) break;
      if (linked()) {
        turn(s, sine[j], cosine[j]);
        pass(s, springs.links[j]);
      } else {
        leave_joint(j, s, 0.0);
      }
    }
    for (int j = 0; j < joints(); ++j) short_of[j] = step[j];
    return moved / size;
  }

  FASTCAL_INLINE void write() {
    for (int j = 0; j < joints(); ++j) load_joint(j, base_sine[j], base_cosine[j]);
    turn_joints(base_sine, base_cosine);
    for (int j = 0; j < joints(); ++j) {
      const SpringJoint& joint = springs.joints[j];
      if (slides(j)) {
        Rows at;
        at.load(joint.slide + row);
        (at + turns[j]).store(joint.slide + row);
      } else {
        sine[j].store(joint.sine_cosine + row);
        cosine[j].store(joint.sine_cosine + stride + row);
      }
    }
  }
};

template <int W, int N>
FASTCAL_INLINE void settle_arms(const Springs& springs, int stride, bool& at_rest) {
  using Rows = Group<W>;
  Arms<W, N> arms(springs, stride);
  for (; arms.row < stride; arms.row += kGroup) {
    arms.start();
    Rows moving = 1.0, soft = 1.0;  // or 0
    Rows before, shrinking;         // the square of the step before; that by which the steps shrink
    for (int round = 0; round < kMaxRounds && moving.any(); ++round) {
      if (round > 0) arms.turn_joints(arms.base_sine, arms.base_cosine);
      arms.weigh();
      if ((soft * moving).any()) {
        const Rows square = arms.find_step(soft);
        if (round == 0) shrinking = square;
        if (round == 0) soft = Rows::choose(square, kSoft, 1.0, 0.0);
      }
      Rows size = kNothing;
      for (int j = 0; j < arms.joints(); ++j) {
        arms.turns[j] += moving * arms.short_of[j];
        size += arms.short_of[j] * arms.short_of[j];
      }
      if (round > 0) shrinking = Rows::larger(shrinking, size / before);
      moving = Rows::choose(kSettled, round > 0 ? size * shrinking : size, 0.0, moving);
      before = size;
    }
    at_rest &= !moving.any();
    arms.write();
  }
}

template <int W>
FASTCAL_INLINE void settle_lanes(const Springs& springs, int stride, bool& at_rest) {
  if (springs.links && springs.joint_count == 5)
    settle_arms<W, 5>(springs, stride, at_rest);
  else if (springs.links && springs.joint_count == 6)
    settle_arms<W, 6>(springs, stride, at_rest);
  else if (springs.links && springs.joint_count == 7)
    settle_arms<W, 7>(springs, stride, at_rest);
  else
    settle_arms<W, 0>(springs, stride, at_rest);
}

FASTCAL_FOR_EACH_SET(springs, settle_lanes, (const Springs& s, int stride, bool& at_rest), (s, stride, at_rest))

}  // namespace

bool settle_springs(const Springs& springs, int stride) {
  static const auto run = FASTCAL_BEST_SET(springs);
  bool at_rest = true;
  run(springs, stride, at_rest);
  return at_rest;
}

}  // namespace fastcal::kernels
