// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include <utility>

#include "convert.hpp"
#include "fastcal/diagnosis/score_tests.hpp"

namespace fastcal {

void bind_diagnosis(py::module_& m) {
  py::class_<BlockScores>(m, "BlockScores", "Rank and score statistic, one a block.")
      .def_readonly("rank", &BlockScores::rank, "directions that the fitted parameters do not absorb")
      .def_readonly("statistic", &BlockScores::statistic, "chi square of that rank where the block is not missing");

  using Release = py::call_guard<py::gil_scoped_release>;
  py::class_<ScoreTests>(m, "ScoreTests", "Score tests of blocks of columns that a least-squares fit lacks.")
      .def(
          py::init<const Eigen::Ref<const Eigen::MatrixXd>&, const Eigen::Ref<const Eigen::MatrixXd>&,
                   const Eigen::Ref<const Eigen::VectorXd>&, const std::vector<int>&, double>(),
          py::arg("A"), py::arg("C"), py::arg("r"), py::arg("sizes"), py::arg("least") = 3e-3, Release(),
          "A (m, p) whitened Jacobian of the fit, C (m, c) columns of the blocks, r (m) whitened, J dtheta ~ r; sizes: "
          "columns of each block.")
      .def_static(
          "projected",
          [](Eigen::MatrixXd R, Eigen::VectorXd r, Eigen::VectorXd length, int null_rank,
             const std::vector<int>& sizes) {
            return ScoreTests({std::move(R), std::move(r), std::move(length), null_rank}, sizes);
          },
          py::arg("R"), py::arg("r"), py::arg("length"), py::arg("null_rank"), py::arg("sizes"), Release(),
          "The same from what A leaves: R (k, c) of C with columns of length 1, r (k), and the lengths (c) of C.")
      .def_property_readonly("null_rank", &ScoreTests::null_rank)
      .def_property_readonly("remaining", &ScoreTests::remaining, "|r|^2 of what A leaves")
      .def_property_readonly("scores", &ScoreTests::scores)
      .def_property_readonly("surviving", &ScoreTests::surviving, "(blocks) share of a column's length that A leaves")
      .def_property_readonly("estimate", &ScoreTests::estimate, "(c) of each block when it alone is added")
      .def_property_readonly("deviation", &ScoreTests::deviation, "(c) its standard deviation for noise 1")
      .def_property_readonly("length", &ScoreTests::length, "(c) of each column, that A does not absorb")
      .def("given", &ScoreTests::given, py::arg("added"), Release(), "Scores of all once the blocks `added` are in.")
      .def(
          "remaining_with",
          [](const ScoreTests& self, const std::vector<int>& added) {
            int rank = 0;
            const double left = self.remaining_with(added, rank);
            return std::pair(left, rank);
          },
          py::arg("added"), "|r|^2 that A and the blocks `added` leave, and the rank of these.")
      .def("correlation", &ScoreTests::correlation, py::arg("of"), py::arg("with_"), Release(),
           "(of, with_) largest canonical correlations.")
      .def("shared", &ScoreTests::shared, py::arg("of"), py::arg("with_"), Release(),
           "(of, with_) share of a block's fitted signature that another block explains as well.")
      .def("detectable", &ScoreTests::detectable, py::arg("columns"), py::arg("limits"), py::arg("power") = 0.8,
           py::arg("draws") = 256, py::arg("seed") = 0, py::arg("threads") = 1, Release(),
           "Root of the noncentrality at which each column alone lets some block pass its limit.");
}

}  // namespace fastcal
