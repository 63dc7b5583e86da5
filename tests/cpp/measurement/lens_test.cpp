// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Numbers of OpenCV 5.0 (projectPoints, fisheye::projectPoints); derivatives against differences.
#include "fastcal/measurement/lens.hpp"

#include <gtest/gtest.h>

#include "fastcal/math/check.hpp"

namespace fastcal {
namespace {

struct Case {
  LensModel model;
  Intrinsics intrinsics;
  Eigen::Matrix<double, 5, 2> uv;  // of points()
};

Eigen::Matrix<double, 5, 3> points() {
  Eigen::Matrix<double, 5, 3> out;
  out << 0.1, -0.2, 1.3, -0.45, 0.31, 0.9, 0.02, 0.6, 1.1, 0.0, 0.05, 2.0, -0.7, -0.5, 1.6;
  return out;
}

std::vector<Case> cases() {
  Case pinhole{LensModel::kPinhole, Intrinsics::Zero(), {}}, fisheye{LensModel::kFisheye, Intrinsics::Zero(), {}};
  pinhole.intrinsics << 1400, 1402, 640, 512, -0.11, 0.09, 2e-4, -3e-4, 0.01, 0.02, -0.01, 0.005;
  fisheye.intrinsics.head<8>() << 700, 702, 640, 512, 0.02, -0.01, 0.003, -0.001;
  pinhole.uv << 747.2637591777006, 297.14942204525744, -36.751504760188936, 978.8691560118507, 664.5822057016682,
      1254.3614985812958, 639.9997375, 547.0476793422524, 45.029280222580496, 86.5816972242643;
  fisheye.uv << 693.3548577284288, 404.98539964183715, 323.8307261327146, 730.4278012031704, 651.7017953556406,
      864.0568716996997, 640.0, 529.546564289982, 357.79253126138224, 309.8473030056023;
  return {pinhole, fisheye};
}

TEST(Lens, DrawsAsOpenCVDoes) {
  for (const Case& of : cases()) {
    for (int k = 0; k < 5; ++k) {
      const Eigen::Vector2d uv = draw(of.model, of.intrinsics, points().row(k).transpose()).uv;
      EXPECT_LT((uv - of.uv.row(k).transpose()).norm(), 1e-12 * 1400) << k;
    }
  }
}

TEST(Lens, DerivativesAreThoseOfTheDrawing) {
  constexpr double h = 1e-5;
  for (const Case& of : cases()) {
    for (int k = 0; k < 5; ++k) {
      const Eigen::Vector3d P = points().row(k).transpose();
      const Drawn here = draw(of.model, of.intrinsics, P);
      for (int c = 0; c < 3; ++c) {
        const Eigen::Vector3d step = h * Eigen::Vector3d::Unit(c);
        const Eigen::Vector2d wanted =
            (draw(of.model, of.intrinsics, P + step).uv - draw(of.model, of.intrinsics, P - step).uv) / (2 * h);
        EXPECT_LT((here.by_point.col(c) - wanted).norm(), 1e-4) << k;  // of 1e3
      }
      for (int c = 0; c < kMostIntrinsics; ++c) {
        const Intrinsics step = h * Intrinsics::Unit(c);
        const Eigen::Vector2d wanted =
            (draw(of.model, of.intrinsics + step, P).uv - draw(of.model, of.intrinsics - step, P).uv) / (2 * h);
        EXPECT_LT((here.by_intrinsic.col(c) - wanted).norm(), 1e-4) << c;
      }
    }
  }
}

TEST(Lens, ALineOfSightIsDrawnWhereItWasSeen) {
  for (const Case& of : cases()) {
    for (int k = 0; k < 5; ++k) {
      const Eigen::Vector3d P = points().row(k).transpose();
      const Eigen::Vector3d line = line_of_sight(of.model, of.intrinsics, of.uv.row(k).transpose());
      EXPECT_LT((line - P / P.z()).norm(), 1e-9) << k;
    }
  }
}

TEST(Lens, AFisheyeDrawsWhatIsOnItsAxisAsAPinhole) {
  const Case of = cases()[1];
  const Drawn here = draw(of.model, of.intrinsics, {0, 0, 2});
  EXPECT_EQ(here.uv, Eigen::Vector2d(640, 512));
  EXPECT_EQ(here.by_point(0, 0), 350);
}

TEST(Lens, NamesAreReadAndOthersRefused) {
  EXPECT_EQ(intrinsic_names(lens_model("fisheye")).size(), 8U);
  EXPECT_EQ(intrinsic_names(lens_model("pinhole"))[6], "p1");
  EXPECT_THROW(lens_model("mirror"), InvalidInput);
}

}  // namespace
}  // namespace fastcal
