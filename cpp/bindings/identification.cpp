// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "convert.hpp"
#include "fastcal/identification/alignment.hpp"
#include "fastcal/identification/identify.hpp"
#include "fastcal/model/settle.hpp"

namespace fastcal {
namespace {

Method method_of(const std::string& name) {
  if (name == "nls") return Method::kLeastSquares;
  if (name == "ceres") return Method::kTrustRegion;
  if (name == "bfgs") return Method::kBfgs;
  FASTCAL_CHECK(name == "bfgs_mean_distance")
      << "the method must be nls, ceres, bfgs or bfgs_mean_distance, got '" << name << "'";
  return Method::kBfgsMeanDistance;
}

std::string status_name(Status status) {
  switch (status) {
    case Status::kConverged:
      return "converged";
    case Status::kTooFewEquations:
      return "too_few_equations";
    default:
      return "not_converged";
  }
}

/// Rows that Python reads: `read(begin, end)` and `pick(rows)` return Samples and Measurements.
class PythonRows : public RowSource {
 public:
  explicit PythonRows(py::object rows) : rows_(std::move(rows)), count_(static_cast<Eigen::Index>(py::len(rows_))) {}

  Eigen::Index count() const override { return count_; }
  SomeRows read(Eigen::Index begin, Eigen::Index end) const override {
    const py::gil_scoped_acquire lock;
    return held(rows_.attr("read")(begin, end), end - begin);
  }
  SomeRows pick(const std::vector<Eigen::Index>& rows) const override {
    const py::gil_scoped_acquire lock;
    return held(rows_.attr("pick")(rows), static_cast<Eigen::Index>(rows.size()));
  }

 private:
  /// What Python's objects hold, which live as long as it is needed.
  static SomeRows held(py::tuple given, Eigen::Index count) {
    const auto* samples = given[0].cast<const Samples*>();
    const auto* measured = given[1].cast<const Measurements*>();
    FASTCAL_CHECK(samples->count() == count && measured->rows() == count)
        << "expected " << count << " rows, got " << samples->count() << " and " << measured->rows();
    const std::shared_ptr<py::tuple> owner(new py::tuple(std::move(given)), [](py::tuple* object) {
      const py::gil_scoped_acquire lock;
      delete object;
    });
    return {{owner, samples}, {owner, measured}};
  }

  py::object rows_;
  Eigen::Index count_;
};

Eigen::VectorXd row_weights(const Identification& result) {
  Eigen::VectorXd out(static_cast<Eigen::Index>(result.weights.size()));
  for (std::size_t i = 0; i < result.weights.size(); ++i) out[static_cast<Eigen::Index>(i)] = result.weights[i].weight;
  return out;
}

}  // namespace

void bind_identification(py::module_& m) {
  py::class_<Alignment>(m, "Alignment", "Best rigid fit of base and tool.")
      .def_property_readonly("T_world_base", [](const Alignment& self) { return from_pose(self.T_world_base); })
      .def_property_readonly("T_flange_tool", [](const Alignment& self) { return from_pose(self.T_flange_tool); })
      .def_readonly("unknowns", &Alignment::unknowns, "(U,) of the observations")
      .def_readonly("rms", &Alignment::rms, "[m] what the rigid fit leaves")
      .def_readonly("found", &Alignment::found)
      .def_readonly("message", &Alignment::message);

  m.def(
      "align",
      [](const ErrorModel& model, const Samples& samples, const Measurements& measured, int threads) {
        return align({model, samples, measured, threads});
      },
      py::arg("model"), py::arg("samples"), py::arg("measured"), py::arg("threads") = 1,
      py::call_guard<py::gil_scoped_release>(),
      "Closed-form base and tool and unknowns of the observations, refined; no initial guess is needed.");

  m.def(
      "start_unknowns",
      [](const ErrorModel& model, const Samples& samples, const Measurements& measured) {
        Samples settled = samples;
        settle(model, model.start(), 1, settled);
        const Problem problem{model, settled, measured};
        problem.check();
        Eigen::VectorXd unknowns;
        const std::string missing = start_unknowns(problem, unknowns);
        FASTCAL_CHECK(missing.empty()) << missing;
        return unknowns;
      },
      py::arg("model"), py::arg("samples"), py::arg("measured"), py::call_guard<py::gil_scoped_release>(),
      "(U,) unknowns of the observations in closed form, for a robot or tree that is where the model puts it.");

  py::class_<Identification>(m, "Identification", "What identify() found; SI.")
      .def_property_readonly("status", [](const Identification& self) { return status_name(self.status); })
      .def_readonly("message", &Identification::message)
      .def_readonly("theta", &Identification::theta)
      .def_readonly("parameters", &Identification::parameters, "of theta: the model's, then the observations' unknowns")
      .def_readonly("free", &Identification::free, "indices that were identified")
      .def_readonly("held", &Identification::held, "indices that the gauge holds at nominal")
      .def_readonly("covariance", &Identification::covariance, "of the free ones")
      .def_readonly("covariance_root", &Identification::covariance_root,
                    "lower triangular L with a positive diagonal, covariance = L L^T")
      .def_readonly("rank", &Identification::rank)
      .def_readonly("unidentifiable", &Identification::unidentifiable)
      .def_readonly("unidentifiable_parts", &Identification::unidentifiable_parts)
      .def_readonly("asked", &Identification::asked, "indices of the parameters in the rows of held_directions")
      .def_readonly("held_directions", &Identification::held_directions,
                    "(asked, held): how all move with a held one that is off by its plausible size; SI")
      .def_readonly("outliers", &Identification::outliers, "rows that the noise does not explain")
      .def_property_readonly("loss", [](const Identification& self) { return loss_name(self.loss); })
      .def_readonly("common_noise", &Identification::tau, "standard deviation common to all rows, by observation")
      .def_readonly("sigma", &Identification::sigma, "RMS standard deviation used, by observation")
      .def_readonly("variance_factor", &Identification::variance_factor)
      .def_readonly("degrees_of_freedom", &Identification::degrees_of_freedom)
      .def_readonly("iterations", &Identification::iterations)
      .def_readonly("residuals", &Identification::residuals, "(N, numbers), NaN where not measured")
      .def_property_readonly("weights", &row_weights, "(N,) robust weight of each row");

  m.def(
      "identify",
      [](const ErrorModel& model, const Samples& samples, const Measurements& measured, const std::vector<int>& asked,
         const Eigen::VectorXd& unknowns, const std::string& method, const std::string& loss,
         const Eigen::VectorXd& prior_mean, const Eigen::VectorXd& prior_sigma, const Eigen::VectorXd& lower,
         const Eigen::VectorXd& upper, const Eigen::VectorXd& pull_mean, const Eigen::VectorXd& pull_sigma,
         int max_iterations, double practical_limit, const CommonNoise& noise, bool gauge, int threads,
         const py::object& rows) {
        IdentifyOptions options;
        options.solver = {method_of(method), max_iterations};
        options.loss = loss_kind(loss);
        options.limits = {prior_mean, prior_sigma, lower, upper, pull_mean, pull_sigma};
        options.gauge.practical_limit = practical_limit;
        options.gauge.off = !gauge;
        options.noise = noise;
        std::optional<PythonRows> all;
        if (!rows.is_none()) all.emplace(rows);
        const py::gil_scoped_release unlocked;
        return identify({model, samples, measured, threads, nullptr, nullptr, all ? &*all : nullptr}, asked, unknowns,
                        options);
      },
      py::arg("model"), py::arg("samples"), py::arg("measured"), py::kw_only(), py::arg("asked"),
      py::arg("unknowns") = Eigen::VectorXd(), py::arg("method") = "nls", py::arg("loss") = "tukey",
      py::arg("prior_mean") = Eigen::VectorXd(), py::arg("prior_sigma") = Eigen::VectorXd(),
      py::arg("lower") = Eigen::VectorXd(), py::arg("upper") = Eigen::VectorXd(),
      py::arg("pull_mean") = Eigen::VectorXd(), py::arg("pull_sigma") = Eigen::VectorXd(),
      py::arg("max_iterations") = 100, py::arg("practical_limit") = 10.0, py::arg("noise") = CommonNoise(),
      py::arg("gauge") = true, py::arg("threads") = 1, py::arg("rows") = py::none(),
      "Identifies the parameters `asked` (indices) and all unknowns of the observations, from the model's start.\n\n"
      "With `rows`, samples and measured are some of them: it has a length, and read(begin, end) and pick(rows) return "
      "Samples and Measurements of the same kinds. Residuals and weights are those of samples and measured.");

  m.def(
      "residuals",
      [](const ErrorModel& model, const Samples& samples, const Measurements& measured, const Eigen::VectorXd& theta,
         int threads) {
        FASTCAL_CHECK(theta.size() == model.parameter_count() + measured.unknown_count())
            << "theta must hold " << model.parameter_count() + measured.unknown_count() << " numbers, got "
            << theta.size();
        Samples settled = samples;
        settle(model, theta.head(model.parameter_count()), threads, settled);
        const Problem problem{model, settled, measured, threads};
        problem.check();
        return residuals(problem, theta);
      },
      py::arg("model"), py::arg("samples"), py::arg("measured"), py::arg("theta"), py::arg("threads") = 1,
      py::call_guard<py::gil_scoped_release>(),
      "(N, numbers) predicted less measured at theta, model parameters and unknowns; NaN where not measured or "
      "unknown.");
}

}  // namespace fastcal
