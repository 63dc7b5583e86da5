// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include <limits>

#include "convert.hpp"
#include "fastcal/design/observability.hpp"
#include "fastcal/design/route.hpp"
#include "fastcal/design/separation.hpp"
#include "fastcal/design/surroundings.hpp"
#include "fastcal/identification/identifiability.hpp"
#include "fastcal/math/decompositions.hpp"

namespace fastcal {
namespace {

using design::Candidates;
using design::Choice;
using design::ObservabilityIndex;

ObservabilityIndex index_of(const std::string& name) {
  FASTCAL_CHECK(name.size() == 2 && name[0] == 'O' && name[1] >= '1' && name[1] <= '5')
      << "an observability index is O1, O2, O3, O4 or O5, got '" << name << "'";
  return static_cast<ObservabilityIndex>(name[1] - '0');
}

std::unique_ptr<design::Scan> make_scan(const Candidates& candidates, const std::string& criterion,
                                        const Eigen::MatrixXd& targets, int threads) {
  if (criterion == "variance") return std::make_unique<design::VarianceScan>(candidates, targets, threads);
  index_of(criterion);
  return std::make_unique<design::DeterminantScan>(candidates, threads);
}

Choice exchanged(const Candidates& candidates, const std::string& criterion, const Eigen::MatrixXd& start,
                 const Eigen::MatrixXd& targets, const std::vector<Eigen::Index>& members, int rounds, int threads) {
  design::SearchOptions options;
  options.most_rounds = rounds;
  const Choice choice = exchange(*make_scan(candidates, criterion, targets, threads), start, members, options);
  if (criterion == "variance" || index_of(criterion) == ObservabilityIndex::kO1) return choice;
  return improve_observability(index_of(criterion), candidates, start, choice.members, threads, options);
}

}  // namespace

void bind_design(py::module_& m) {
  py::class_<Candidates>(m, "Candidates", "What could be measured: k rows of derivatives each, whitened and scaled.")
      .def(py::init([](const RowMatrixXd& J, int rows) { return Candidates(J, rows); }), py::arg("J"), py::arg("rows"),
           py::call_guard<py::gil_scoped_release>(), "J (N rows, p)")
      .def("__len__", &Candidates::count)
      .def("information", &Candidates::information, py::arg("chosen"), "sum J_c^T J_c (p, p) over those chosen");

  py::class_<Choice>(m, "Choice", "A design and what it is worth.")
      .def_readonly("members", &Choice::members)
      .def_readonly("value", &Choice::value, "log det M, minus the variance, or the index")
      .def_readonly("bound", &Choice::bound, "no choice of as many candidates, each once, is worth more");

  m.def(
      "grow_design",
      [](const Candidates& candidates, const std::string& criterion, Eigen::Index count, const Eigen::MatrixXd& start,
         const Eigen::MatrixXd& targets,
         int threads) { return grow(*make_scan(candidates, criterion, targets, threads), start, count); },
      py::arg("candidates"), py::arg("criterion"), py::arg("count"), py::kw_only(), py::arg("start"),
      py::arg("targets") = Eigen::MatrixXd(), py::arg("threads") = 1, py::call_guard<py::gil_scoped_release>(),
      "Members one after the other, by O1, or by variance = tr(M^-1 targets), M = start + the members' information.");

  m.def("exchange_design", &exchanged, py::arg("candidates"), py::arg("criterion"), py::kw_only(), py::arg("start"),
        py::arg("targets"), py::arg("members"), py::arg("rounds") = 20, py::arg("threads") = 1,
        py::call_guard<py::gil_scoped_release>(), "Exchanges members while that improves O1 ... O5 or the variance.");

  m.def("draw_design", &design::draw, py::arg("candidates"), py::arg("count"), py::arg("seed"),
        "count of so many candidates without replacement, the same on every machine.");

  m.def(
      "observability_index",
      [](const std::string& index, const Eigen::VectorXd& eigenvalues, Eigen::Index poses) {
        return design::observability(index_of(index), eigenvalues, poses);
      },
      py::arg("index"), py::arg("eigenvalues"), py::arg("poses"), "Of J^T J, eigenvalues ascending.");

  m.def(
      "free_parameters",
      [](const Eigen::MatrixXd& R, const std::vector<Parameter>& parameters) {
        Eigen::VectorXd hold(R.cols());
        FASTCAL_CHECK(parameters.size() == static_cast<std::size_t>(R.cols()))
            << "R must have a column for each of " << parameters.size() << " parameters, got " << R.cols();
        for (Eigen::Index i = 0; i < hold.size(); ++i) {
          hold[i] = fixing_priority(parameters[static_cast<std::size_t>(i)]);
        }
        const Gauge gauge = choose_gauge(R, hold);
        return py::make_tuple(gauge.free, describe_directions(gauge, parameters));
      },
      py::arg("R"), py::arg("parameters"),
      "(indices, sentences): what data with the triangular factor R, whitened and scaled, can determine, and what they "
      "cannot.");

  m.def(
      "choose_gauge",
      [](const Eigen::MatrixXd& R, const Eigen::VectorXd& hold, double relative_tolerance) {
        FASTCAL_CHECK(hold.size() == R.cols()) << "hold must have " << R.cols() << " numbers, got " << hold.size();
        GaugeOptions options;
        options.relative_tolerance = relative_tolerance;
        options.practical_limit = std::numeric_limits<double>::infinity();
        const Gauge gauge = choose_gauge(R, hold, options);
        return py::make_tuple(gauge.held, gauge.directions, right_svd(R).values);
      },
      py::arg("R"), py::arg("hold"), py::arg("relative_tolerance"),
      "(held, directions (p, held), singular values): what a triangular factor R (p, p) does not fix to "
      "relative_tolerance of its largest singular value; of the columns that could be held those of large `hold`.");

  py::class_<design::Tracker>(m, "Tracker", "An instrument that looks at the tool; SI, measuring frame.")
      .def(py::init([](const Eigen::Vector3d& position, double nearest, double farthest,
                       const Eigen::Vector3d& reflector, double acceptance) {
             return design::Tracker{position, nearest, farthest, reflector, acceptance};
           }),
           py::arg("position"), py::arg("nearest"), py::arg("farthest"), py::arg("reflector"), py::arg("acceptance"));

  m.def(
      "posture_obstacles",
      [](const RobotModel& robot, const RowMatrixXd& q,
         const std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>>& keep_out,
         const std::optional<std::pair<Eigen::Vector3d, Eigen::Vector3d>>& region,
         const std::optional<design::Tracker>& tracker, double link_radius, int threads) {
        design::Surroundings surroundings;
        for (const auto& [low, high] : keep_out) surroundings.keep_out.push_back({low, high});
        if (region) surroundings.region = design::Box{region->first, region->second};
        surroundings.tracker = tracker;
        surroundings.link_radius = link_radius;
        std::vector<int> out;
        for (const design::Obstacle found : obstacles(robot, surroundings, q, threads))
          out.push_back(static_cast<int>(found));
        return out;
      },
      py::arg("robot"), py::arg("q"), py::kw_only(), py::arg("keep_out"), py::arg("region") = py::none(),
      py::arg("tracker") = py::none(), py::arg("link_radius") = 0.0, py::arg("threads") = 1,
      py::call_guard<py::gil_scoped_release>(),
      "Why each posture (N, n) cannot be measured: 0 it can, 1 keep-out, 2 region, 3 range, 4 acceptance, 5 sight.");

  m.def(
      "visiting_order",
      [](const RowMatrixXd& q, const Eigen::VectorXd& from) { return design::visiting_order(q, from); }, py::arg("q"),
      py::arg("from_"), py::call_guard<py::gil_scoped_release>(),
      "A short path through the rows (N, n), joints scaled, that begins near from_ (n).");

  using design::Separation;
  py::class_<Separation>(m, "Separation", "Candidates that separate causes of error.")
      .def_readonly("chosen", &Separation::chosen, "in the order in which they were added")
      .def_readonly("before", &Separation::before,
                    "(m, m) D_ij: what is left of cause i where cause j is fitted, of the data measured already")
      .def_readonly("after", &Separation::after, "the same with the chosen candidates");

  m.def(
      "separate",
      [](const RowMatrixXd& common, const std::vector<RowMatrixXd>& causes,
         const std::vector<Eigen::MatrixXd>& expected, int count, int rows, const std::optional<Eigen::MatrixXd>& prior,
         double enough, int threads) {
        return design::separate({common, causes, expected, rows, prior.value_or(Eigen::MatrixXd())}, count, enough,
                                threads);
      },
      py::arg("common"), py::arg("causes"), py::arg("expected"), py::arg("count"), py::kw_only(), py::arg("rows") = 3,
      py::arg("prior") = py::none(), py::arg("enough") = std::numeric_limits<double>::infinity(),
      py::arg("threads") = 1, py::call_guard<py::gil_scoped_release>(),
      "T-optimal choice: common (N rows, p) and causes (N rows, c_i) whitened columns, expected (c_i, e_i) how much of "
      "each there may be.");
}

}  // namespace fastcal
