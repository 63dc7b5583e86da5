// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "convert.hpp"
#include "fastcal/effects/surrogate_inputs.hpp"
#include "fastcal/math/parallel.hpp"
#include "fastcal/model/error_model.hpp"
#include "fastcal/model/prediction.hpp"
#include "fastcal/model/settle.hpp"

namespace fastcal {
namespace {

template <typename T>
T or_empty(const std::optional<T>& value) {
  return value ? *value : T();
}

/// What `of` names; empty: the tool.
View view_of(const ErrorModel& model, const std::string& of) {
  return of.empty() ? model.robot().view() : model.robot().tree().view(of);
}

using JointPositions = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// The array itself, which is not copied: nobody may write to it as long as the samples live.
JointRows lent(const JointPositions& q) {
  FASTCAL_CHECK(q.ndim() == 2) << "q must have shape (N, n), got " << q.ndim() << " dimensions";
  const std::shared_ptr<const void> owner(new py::object(q), [](py::object* array) {
    const py::gil_scoped_acquire hold;
    delete array;
  });
  return {q.data(), q.shape(0), q.shape(1), owner};
}

}  // namespace

void bind_model(py::module_& m) {
  py::class_<Samples>(m, "Samples",
                      "N rows of conditions, SI; what is None was not measured. Of a tree of a arms payload, "
                      "temperature, station and mount are (N, a), wrench (N, 6 a).")
      .def(py::init([](const JointPositions& q, const std::optional<RowMatrixXd>& payload,
                       const std::optional<RowMatrixXd>& wrench, const std::optional<RowMatrixXd>& temperature,
                       const std::optional<Eigen::VectorXd>& time, const std::optional<RowMatrixXi>& station,
                       const std::optional<RowMatrixXi>& mount, const std::optional<RowMatrixXd>& approach,
                       const std::optional<RowMatrixXd>& current, const std::optional<RowMatrixXd>& extra,
                       const std::optional<RowMatrixXd>& table) {
             Samples out;
             out.q = lent(q);
             out.payload = or_empty(payload);
             out.wrench = or_empty(wrench);
             out.temperature = or_empty(temperature);
             out.time = or_empty(time);
             out.station = or_empty(station);
             out.mount = or_empty(mount);
             out.approach = or_empty(approach);
             out.current = or_empty(current);
             out.extra = or_empty(extra);
             out.table = or_empty(table);
             return out;
           }),
           py::arg("q"), py::kw_only(), py::arg("payload") = py::none(), py::arg("wrench") = py::none(),
           py::arg("temperature") = py::none(), py::arg("time") = py::none(), py::arg("station") = py::none(),
           py::arg("mount") = py::none(), py::arg("approach") = py::none(), py::arg("current") = py::none(),
           py::arg("extra") = py::none(), py::arg("table") = py::none())
      .def(
          "slice",
          [](const Samples& self, Eigen::Index begin, Eigen::Index end) {
            FASTCAL_CHECK(0 <= begin && begin <= end && end <= self.count())
                << "rows " << begin << " to " << end << " are not among the " << self.count();
            return self.slice(begin, end);
          },
          py::arg("begin"), py::arg("end"), "Rows begin ... end - 1.")
      .def_static("side_by_side", &side_by_side, py::arg("arms"),
                  "Postures of the arms of a tree, in its order, as the tree's; what an arm does not know is 0 of "
                  "payloads, wrenches and approaches.")
      .def("__len__", &Samples::count);

  py::class_<ErrorModel>(m, "ErrorModel", "A robot with its effects.")
      .def(py::init([](const RobotModel& robot, const std::vector<std::shared_ptr<Effect>>& effects,
                       const Eigen::VectorXd& effect_values) {
             return ErrorModel(robot, {effects.begin(), effects.end()}, effect_values);
           }),
           py::arg("robot"), py::arg("effects") = std::vector<std::shared_ptr<Effect>>(),
           py::arg("effect_values") = Eigen::VectorXd())
      .def_property_readonly("robot", &ErrorModel::robot, py::return_value_policy::reference_internal)
      .def_property_readonly("parameters", &ErrorModel::parameters)
      .def_property_readonly("start", &ErrorModel::start, "Values of the parameters (P,), SI.")
      .def_property_readonly("at_equilibrium", &ErrorModel::at_equilibrium, "Are loads taken in the deflected posture?")
      .def("with_equilibrium", &ErrorModel::with_equilibrium, py::arg("at_equilibrium"),
           "The same model, loads in the deflected or the undeflected posture.")
      .def("with_robot", &ErrorModel::with_robot, py::arg("robot"),
           "The same effects on another robot of the same parameters.")
      .def(
          "predict",
          [](const ErrorModel& self, const Samples& samples, const Eigen::VectorXd& theta, int threads,
             const py::object& out, const std::string& of) {
            double* data = nullptr;
            const View view = view_of(self, of);
            py::array poses = output_or_new(out, {samples.count(), 4, 4}, data);
            {
              const py::gil_scoped_release release;
              predict(self, samples, theta, view, threads, data);
            }
            return poses;
          },
          py::arg("samples"), py::arg("theta"), py::arg("threads") = 1, py::arg("out") = py::none(), py::arg("of") = "",
          "Poses (N, 4, 4) of the tool in the measuring frame, or of what `of` names: 'TARGET', 'TARGET:SENSOR'.")
      .def(
          "loads",
          [](const ErrorModel& self, const Samples& samples, const Eigen::VectorXd& theta, bool payload_alone,
             int threads) {
            samples.check(self.robot().tree());
            Samples settled = samples;
            {
              const py::gil_scoped_release release;
              settle(self, theta, threads, settled, {.needs = kLoads});
            }
            const RowMatrixXd& loads = payload_alone ? settled.payload_load : settled.load;
            return py::array_t<double>({settled.count(), loads.cols() / 6, Eigen::Index{6}}, loads.data());
          },
          py::arg("samples"), py::arg("theta"), py::arg("payload_alone") = false, py::arg("threads") = 1,
          "Force and moment (N, frames + loops, 6) that all beyond a frame puts on it, in its axes, about its origin "
          "[N, N m]; joint i has frame 2 i - 1, z its axis. Behind the frames stand the loops, part 2 a rod's pull "
          "[N].")
      .def(
          "parameter_jacobian",
          [](const ErrorModel& self, const Samples& samples, const Eigen::VectorXd& theta, int rows, int threads,
             const py::object& out, const std::string& of) {
            double* data = nullptr;
            const View view = view_of(self, of);
            py::array J = output_or_new(out, {samples.count(), rows, self.parameter_count()}, data);
            {
              const py::gil_scoped_release release;
              parameter_jacobian(self, samples, theta, view, rows, threads, data);
            }
            return J;
          },
          py::arg("samples"), py::arg("theta"), py::arg("rows") = 3, py::arg("threads") = 1,
          py::arg("out") = py::none(), py::arg("of") = "",
          "(N, rows, P): motion of the tool by every parameter, in the axes of the measuring frame; 3 rows: position, "
          "6: [v; w]. `of`: as predict; motion as it is seen from the sensor, in its axes.");

  m.def(
      "surrogate_inputs",
      [](const ErrorModel& model, const Samples& given, const Eigen::VectorXd& theta, const std::string& names,
         int threads) {
        const std::vector<SurrogateInput> inputs = surrogate_inputs(names, model.robot());
        Samples samples = given;
        settle(model, theta, threads, samples, {.needs = kFrames | kLoads});
        RowMatrixXd out(samples.count(), static_cast<Eigen::Index>(inputs.size()));
        parallel_chunks(out.rows(), threads, [&](Eigen::Index, Eigen::Index begin, Eigen::Index end) {
          for (Eigen::Index i = begin; i < end; ++i)
            for (Eigen::Index k = 0; k < out.cols(); ++k)
              out(i, k) = inputs[static_cast<std::size_t>(k)].value(samples.row(i));
        });
        return out;
      },
      py::arg("model"), py::arg("samples"), py::arg("theta"), py::arg("names"), py::arg("threads") = 1,
      py::call_guard<py::gil_scoped_release>(),
      "(N, inputs) what surrogates may depend on, such as \"q2 load3\", in the rows of the samples, SI.");
}

}  // namespace fastcal
