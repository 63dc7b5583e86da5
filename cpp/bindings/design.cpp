// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "convert.hpp"
#include "fastcal/design/separation.hpp"

namespace fastcal {

void bind_design(py::module_& m) {
  using design::Separation;
  py::class_<Separation>(m, "Separation", "Candidates that tell causes of error from one another.")
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
