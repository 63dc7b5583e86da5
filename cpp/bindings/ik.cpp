// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "convert.hpp"
#include "fastcal/ik/inverse_kinematics.hpp"

namespace fastcal {

void bind_ik(py::module_& m) {
  m.def(
      "inverse_kinematics",
      [](const ErrorModel& model, const Samples& samples, const Eigen::Ref<const RowMatrixXd>& targets,
         const RowMatrixXd& limits, double reach, double tolerance_position, double tolerance_rotation, int restarts,
         bool along_path, std::uint64_t random_seed, int threads) {
        IkResult out;
        {
          const py::gil_scoped_release release;
          const IkOptions options{limits,   reach,      tolerance_position, tolerance_rotation,
                                  restarts, along_path, random_seed,        threads};
          out = inverse_kinematics(model, model.start(), samples, targets, options);
        }
        return py::make_tuple(std::move(out.q),
                              py::array_t<int>(static_cast<py::ssize_t>(out.status.size()), out.status.data()),
                              std::move(out.iterations), std::move(out.position_error), std::move(out.rotation_error));
      },
      py::arg("model"), py::arg("samples"), py::arg("targets").noconvert(), py::kw_only(), py::arg("limits"),
      py::arg("reach"), py::arg("tolerance_position"), py::arg("tolerance_rotation"), py::arg("restarts"),
      py::arg("along_path"), py::arg("random_seed"), py::arg("threads"),
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
}

}  // namespace fastcal
