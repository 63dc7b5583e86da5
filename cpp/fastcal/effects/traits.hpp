// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// What anyone may ask of an effect beside its equation. Diagnosis, report, conversion and compensation know an effect
// by its traits alone; no table of names stands anywhere else.
//
// In the texts {owner} stands for the owner ("joint6<-joint5"), {n} for the number in it (6), {m} for that behind its
// arrow (5).
#pragma once

#include <string>
#include <vector>

namespace fastcal {

/// What an effect is to a diagnosis.
enum class Role {
  kCause,         ///< it may be what is wrong with an arm
  kNuisance,      ///< an error of the loads: held by its plausible size beside effects that follow loads, never named
  kLoadModifier,  ///< a cause that acts through the compliances alone: it may be the form of another effect of loads
  kCurve,         ///< a shape that stands for no cause: no search names it
  kScanned,       ///< a cause that is looked for by a scan where something remains: its own number is on a fine grid
  kOnRequest,     ///< a cause that looks like many others from afar: fitted where it is asked for, no search names it
};

/// Where it acts.
enum class Place { kJoint, kLink, kBase, kTool, kPayload, kInstrument, kStructure, kLoop, kFrame, kAnywhere };

/// What its numbers refer to, hence which conversion between kinds of kinematics keeps their meaning.
enum class Reference {
  kAxes,    ///< the joints' axes, or nothing that a kind sets: every kind has them
  kBase,    ///< the base's frame
  kFlange,  ///< the flange's frame
  kRows,    ///< frames that another kind does not have
};

struct Traits {
  std::string phrase = {};                    ///< what a person understands: "backlash (lost motion)"
  Role role = Role::kCause;                   ///< what it is to a diagnosis
  Place place = Place::kFrame;                ///< where it acts
  std::vector<std::string> depends_on = {};   ///< "q{n}", "torque" (about the joint's axis), "load" (all six), columns
  std::string needs_data = {};                ///< what data and robot file must hold beside poses; empty: nothing
  std::string shown_by = {};                  ///< the poses and conditions that would show it
  std::vector<std::string> generalizes = {};  ///< effects of the same owner that it holds as special cases
  std::vector<std::string> contrast = {};     ///< two of its parameters, equal where it is but that special case
  Reference refers_to = Reference::kRows;     ///< what its numbers refer to
  bool of_the_measurement = false;      ///< the instrument's or the set-up's, not the robot's: no compensation has it
  std::string plotted_over = "itself";  ///< the variable of its partial residual; "itself": its own size in the pose
  std::vector<std::string> options_from_data = {};  ///< such as "t0_c", "times", "stations", "range"; "reference"
  std::string labels = {};  ///< the option that lists the labels which it knows: "stations", "mounts"
  std::vector<std::string> among_parameters = {};  ///< options that a file lists with the parameters: "order", "at_s"
  std::string searched = {};        ///< what a search over fits finds: an option, or the start of "critical"
  std::string diagnosed_with = {};  ///< an option with which a diagnosis tries it: "moments=even"
  std::vector<std::string> forms =
      {};  ///< options that make another law: "side=load"; behind a colon one that is a load, tried over the loads met
  bool without_masses = false;  ///< does it stand for weights that the robot file does not give?
  bool is_wave = false;         ///< its two parameters are a sine and a cosine of one wave
  std::string number = {};      ///< what its parameter without a name is: "turn per moment"
};

/// The poses that show an effect of loads, and one of a joint's own position.
inline constexpr const char* kShownByLoads =
    "a load about it that varies in another way than the geometry: other poses, payloads or pulling sideways";
inline constexpr const char* kShownByMotion = "poses in which {owner} moves further";

}  // namespace fastcal
