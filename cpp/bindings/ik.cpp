// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "convert.hpp"
#include "fastcal/ik/inverse_kinematics.hpp"
#include "fastcal/robot/mass_matrix.hpp"

namespace fastcal {

void bind_ik(py::module_& m) {
  m.def(
      "inverse_kinematics",
      [](const ErrorModel& model, const Samples& samples, const Eigen::Ref<const RowMatrixXd>& targets,
         const RowMatrixXd& limits, double reach, double tolerance_position, double tolerance_rotation, int restarts,
         const std::vector<bool>& held, bool along_path, std::uint64_t random_seed, int threads) {
        IkResult out;
        {
          const py::gil_scoped_release release;
          const IkOptions options{
              limits, reach, tolerance_position, tolerance_rotation, restarts, held, along_path, random_seed, threads};
          out = inverse_kinematics(model, model.start(), samples, targets, options);
        }
        return py::make_tuple(std::move(out.q),
                              py::array_t<int>(static_cast<py::ssize_t>(out.status.size()), out.status.data()),
                              std::move(out.iterations), std::move(out.position_error), std::move(out.rotation_error));
      },
      py::arg("model"), py::arg("samples"), py::arg("targets").noconvert(), py::kw_only(), py::arg("limits"),
      py::arg("reach"), py::arg("tolerance_position"), py::arg("tolerance_rotation"), py::arg("restarts"),
      py::arg("held"), py::arg("along_path"), py::arg("random_seed"), py::arg("threads"),
      "q (N, n), status (N), evaluations (N), distance left (N) [m], angle left (N) [rad] for targets (N, 16); the q "
      "of "
      "samples is where the search begins.");
  m.def(
      "joint_jacobian",
      [](const ErrorModel& model, const Samples& samples, int threads) {
        double* data = nullptr;
        py::array J = output_or_new(py::none(), {samples.count(), 6, model.robot().joint_count()}, data);
        {
          const py::gil_scoped_release release;
          joint_jacobian(model, model.start(), samples, threads, data);
        }
        return J;
      },
      py::arg("model"), py::arg("samples"), py::arg("threads") = 1,
      "(N, 6, n): motion of the tool [v; w] by every joint, in the axes of the measuring frame.");
  m.def(
      "mass_matrix",
      [](const RobotModel& robot, const Eigen::Ref<const RowMatrixXd>& q) {
        const int n = robot.joint_count();
        double* data = nullptr;
        py::array out = output_or_new(py::none(), {q.rows(), n, n}, data);
        const py::gil_scoped_release release;
        mass_matrices(robot, q, data);
        return out;
      },
      py::arg("robot"), py::arg("q").noconvert(),
      "(N, n, n) of the links, at joint positions (N, n) [kg m^2, kg m, kg].");
}

}  // namespace fastcal
