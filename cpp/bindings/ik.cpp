// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "convert.hpp"
#include "fastcal/ik/inverse_kinematics.hpp"
#include "fastcal/ik/pose_solver.hpp"
#include "fastcal/robot/mass_matrix.hpp"

namespace fastcal {

namespace {

using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// The first of the numbers of an array of this many.
const double* first_of(const Numbers& array, py::ssize_t count, const char* name) {
  FASTCAL_CHECK(array.size() == count) << name << " must hold " << count << " numbers, got " << array.size();
  return array.data();
}

}  // namespace

void bind_ik(py::module_& m) {
  py::class_<PoseSolver>(m, "PoseSolver", "One pose at a time, made ready once; not for several threads at a time.")
      .def(py::init([](const ErrorModel& model, const Samples& conditions, const RowMatrixXd& limits, double reach,
                       double tolerance_position, double tolerance_rotation, int restarts,
                       const std::vector<bool>& held, std::uint64_t random_seed) {
             return std::make_unique<PoseSolver>(
                 model, conditions,
                 IkOptions{limits, reach, tolerance_position, tolerance_rotation, restarts, held, false, random_seed});
           }),
           py::arg("model"), py::arg("conditions"), py::kw_only(), py::arg("limits"), py::arg("reach"),
           py::arg("tolerance_position"), py::arg("tolerance_rotation"), py::arg("restarts"), py::arg("held"),
           py::arg("random_seed"))
      .def(
          "inverse",
          [](PoseSolver& self, const Numbers& target, const Numbers& seed) {
            SearchPoint found;
            const double* T = first_of(target, 16, "target");
            const IkStatus status = self.solve(T, first_of(seed, self.joint_count(), "seed"), found);
            return py::make_tuple(py::array_t<double>(found.q.size(), found.q.data()), static_cast<int>(status),
                                  found.position_error, found.rotation_error);
          },
          py::arg("target"), py::arg("seed"), "q (n,), status, distance left [m], angle left [rad] for one (4, 4).")
      .def(
          "forward",
          [](PoseSolver& self, const Numbers& q) {
            const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> T =
                from_pose(self.forward(first_of(q, self.joint_count(), "q")));
            return py::array_t<double>({4, 4}, T.data());
          },
          py::arg("q"), "(4, 4) pose of the tool in the measuring frame at joint positions (n,).");
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
