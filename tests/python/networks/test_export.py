# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Graphs for other programs say what the correction says before its guard."""

import io
from dataclasses import replace

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from fastcal.correction.correction import limited_twist  # noqa: E402 - torch first, or the file is skipped
from fastcal.errors import InvalidInput  # noqa: E402
from fastcal.measurements.dataset import Dataset  # noqa: E402
from fastcal.networks import TrainingResult, train  # noqa: E402
from fastcal.networks.device import one_thread  # noqa: E402
from fastcal.networks.export import export  # noqa: E402
from fastcal.networks.fitting import Schedule  # noqa: E402
from fastcal.networks.options import Options  # noqa: E402
from fastcal.networks.population import Architecture  # noqa: E402
from fastcal.networks.problem import problem_of  # noqa: E402
from fastcal.robot.robot import Robot  # noqa: E402
from fastcal_studies.networks.plain import fit_plain  # noqa: E402


def meant(model: Robot, unseen: Dataset) -> tuple[list[np.ndarray], np.ndarray]:
    correction = model.correction
    assert correction is not None
    inputs = model.inputs(unseen.q, unseen.payload)
    said = np.mean([member.twist(inputs) for member in correction.members], axis=0)
    return [inputs.q, inputs.payload, inputs.J_tool_q], limited_twist(said, correction.limit, correction.turn_limit)


@pytest.mark.filterwarnings("ignore:.*torch.jit:DeprecationWarning")
@pytest.mark.parametrize("kind", ["joints", "axes"])
def test_torchscript_and_onnx_agree_with_the_correction(
    kind: str, trained: TrainingResult, unseen: Dataset, data: Dataset
) -> None:
    correction = trained.model.correction
    assert correction is not None
    correction = replace(correction, members=correction.members[:2])
    if kind == "axes":
        problem = problem_of(trained.model, data, folds=2)
        with one_thread():
            architecture = Architecture((5, 4, 3), ("prelu", "relu", "sigmoid"))
            member = fit_plain(
                problem, [np.arange(200)], Options(), architecture=architecture, schedule=Schedule(epochs=3)
            )[0]
        correction = replace(correction, members=(member,))
    model = Robot(trained.model.spec | {"correction": correction})
    inputs, said = meant(model, unseen)
    script = torch.jit.load(io.BytesIO(export(correction, "torchscript")))
    with torch.no_grad():
        found = script(*(torch.tensor(part) for part in inputs)).numpy()
    np.testing.assert_allclose(found, said, rtol=0, atol=1e-12)

    pytest.importorskip("onnx")
    runtime = pytest.importorskip("onnxruntime")
    session = runtime.InferenceSession(export(correction, "onnx"), providers=["CPUExecutionProvider"])
    known = dict(zip(("q", "payload", "J_tool_q"), inputs, strict=True))
    (found,) = session.run(None, {entry.name: known[entry.name] for entry in session.get_inputs()})
    np.testing.assert_allclose(found, said, rtol=0, atol=1e-12)


def test_anything_but_a_network_is_refused(arm: Robot, data: Dataset) -> None:
    # Four regions: in two folds one of the three ways to deal them leaves half of a joint's range unseen.
    found = train(arm, data.select(slice(90)), network="gp", rivals=[], folds=4)
    assert found.model.correction is not None
    with pytest.raises(InvalidInput, match="kind gp is no network"):
        export(found.model.correction)
    with pytest.raises(InvalidInput, match="onnx or torchscript"):
        export(found.model.correction, "pickle")
