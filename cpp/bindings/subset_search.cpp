// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/subset_search.hpp"

#include <optional>

#include "convert.hpp"
#include "fastcal/identification/linearization.hpp"

namespace fastcal {

void bind_subset_search(py::module_& m) {
  using Sets = Eigen::Matrix<bool, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  py::class_<FoldErrors>(m, "FoldErrors", "Mean over the folds of the mean squared error held out, one a set.")
      .def_readonly("mean", &FoldErrors::mean)
      .def_readonly("standard_error", &FoldErrors::standard_error, "of the mean, from the spread over the folds");

  py::class_<SubsetSearch>(m, "SubsetSearch",
                           "Cross-validated error of subsets of the columns of a least-squares problem.")
      .def(py::init([](const RowMatrixXd& kept, const RowMatrixXd& optional, const Eigen::VectorXd& r,
                       const Eigen::VectorXi& fold,
                       double least_norm) { return SubsetSearch(kept, optional, r, fold, least_norm); }),
           py::arg("kept"), py::arg("optional"), py::arg("r"), py::arg("fold"), py::kw_only(),
           py::arg("least_norm") = 0.0, py::call_guard<py::gil_scoped_release>(),
           "kept (n, c) columns of every set, optional (n, m), r (n) with J b ~ r, fold (n) 0 ... K - 1 or, fitted "
           "always, -1.")
      .def("all", &SubsetSearch::all, py::call_guard<py::gil_scoped_release>(),
           "All 2^m sets; bit j of a set's index: optional column j is in it.")
      .def(
          "of", [](const SubsetSearch& self, const Sets& sets) { return self.of(sets); }, py::arg("sets"),
          py::call_guard<py::gil_scoped_release>(), "The sets of a boolean array (S, m).")
      .def_property_readonly("optional_count", &SubsetSearch::optional_count);

  py::class_<Linearization>(m, "Linearization",
                            "The problem near a parameter vector; one row a measured number, whitened.")
      .def_readonly("J", &Linearization::J, "(n, parameters and unknowns), SI")
      .def_readonly("r", &Linearization::r, "(n) predicted less measured")
      .def_readonly("row", &Linearization::row, "(n) row of the data")
      .def_readonly("number", &Linearization::number, "(n) which number of its row");

  py::class_<TwistMemory>(m, "TwistMemory",
                          "What the effects of one model make of one set of samples, kept from call to call.")
      .def(py::init<>());

  m.def(
      "linearize",
      [](const ErrorModel& model, const Samples& samples, const Measurements& measured, const Eigen::VectorXd& theta,
         const CommonNoise& common_noise, int threads, std::optional<TwistMemory*> memory, bool columns) {
        return linearize({model, samples, measured, threads, nullptr, memory.value_or(nullptr)}, theta, common_noise,
                         columns);
      },
      py::arg("model"), py::arg("samples"), py::arg("measured"), py::arg("theta"), py::arg("common_noise"),
      py::arg("threads") = 1, py::arg("memory") = py::none(), py::arg("columns") = true,
      py::call_guard<py::gil_scoped_release>(),
      "Whitened residuals and, with `columns`, their Jacobian at theta (model parameters and unknowns).");
}

}  // namespace fastcal
