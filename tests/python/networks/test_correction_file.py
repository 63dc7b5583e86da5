# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The network's file: the same bit for bit when read back; refused, and no code run, when cut off or foreign."""

import json
import pickle
import shutil
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import load, save

import fastcal
from fastcal.correction.serialize import from_plain, to_plain
from fastcal.errors import InvalidInput, ParseError
from fastcal.io.correction_file import read_correction, write_correction
from fastcal.measurements.dataset import Dataset

pytest.importorskip("torch")
from fastcal.networks import TrainingResult


class Bomb:
    def __reduce__(self) -> tuple[object, tuple[str]]:
        return (Path.touch, (Path("exploded"),))


def test_a_loaded_model_predicts_the_same_bit_for_bit(saved: Path, trained: TrainingResult, unseen: Dataset) -> None:
    loaded = fastcal.load_robot(saved)
    for said, meant in zip(
        loaded.correct(unseen.q, unseen.payload), trained.model.correct(unseen.q, unseen.payload), strict=True
    ):
        assert np.array_equal(said, meant, equal_nan=True)
    assert loaded.correction is not None
    assert loaded.correction.record["held_out_mm"] == trained.scores["mlp"]


@pytest.fixture
def copied(saved: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for path in saved.parent.iterdir():
        shutil.copy(path, tmp_path)
    return tmp_path


def network_of(folder: Path) -> Path:
    """The one network file in a folder."""
    (path,) = folder.glob("model-*.safetensors")
    return path


def refused(path: Path) -> str:
    with pytest.raises(ParseError) as caught:
        read_correction(path)
    assert not Path("exploded").exists()
    message = str(caught.value)
    assert "\n" not in message
    assert str(path) in message
    return message


def test_a_pickle_is_not_unpickled(copied: Path) -> None:
    path = network_of(copied)
    path.write_bytes(pickle.dumps(Bomb()))
    assert "expected a correction as safetensors" in refused(path)
    with pytest.raises(ParseError, match="its sha256"):
        fastcal.load_robot(copied / "model.yaml")
    assert not Path("exploded").exists()


def test_a_torch_file_is_not_loaded(copied: Path) -> None:
    import torch

    path = network_of(copied)
    torch.save({"weights": torch.zeros(3), "bomb": Bomb()}, path)
    assert "expected a correction as safetensors" in refused(path)


@pytest.mark.parametrize("share", [0.0, 0.00001, 0.001, 0.5, 0.999])
def test_a_file_that_is_cut_off_is_refused(copied: Path, share: float) -> None:
    path = network_of(copied)
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    refused(path)


def test_a_changed_file_is_recognized_by_its_sum(copied: Path) -> None:
    path = network_of(copied)
    content = bytearray(path.read_bytes())
    content[-3] ^= 1
    path.write_bytes(content)
    with pytest.raises(ParseError, match="its sha256"):
        fastcal.load_robot(copied / "model.yaml")


def test_a_missing_file_is_named(copied: Path) -> None:
    network_of(copied).unlink()
    with pytest.raises(ParseError, match=r"model-[0-9a-f]{16}\.safetensors: there is no such file"):
        fastcal.load_robot(copied / "model.yaml")


@pytest.mark.parametrize("name", ["../model.safetensors", "/elsewhere/model.safetensors", "..", "a\\b"])
def test_a_file_elsewhere_is_refused(copied: Path, name: str) -> None:
    path = copied / "model.yaml"
    path.write_text(path.read_text().replace(network_of(copied).name, json.dumps(name)))
    with pytest.raises(ParseError, match="the name of a file in the same folder"):
        fastcal.load_robot(path)


def test_foreign_arrays_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "foreign.safetensors"
    path.write_bytes(save({"layer.weight": np.ones((3, 3), dtype=np.float32)}))
    assert "expected a correction as safetensors" in refused(path)
    path.write_bytes(save({"a": np.ones(3)}, metadata={"fastcal": "{}"}))
    assert "no correction that fastcal has trained" in refused(path)
    path.write_bytes(struct.pack("<Q", 2**40) + b"{}")
    refused(path)


def test_another_arms_network_is_refused(saved: Path) -> None:
    correction = fastcal.load_robot(saved).correction
    spec = fastcal.load_robot("lbr_iiwa14").spec
    with pytest.raises(InvalidInput, match="trained for 6 joints, and lbr_iiwa14 has 7"):
        fastcal.Robot(spec | {"correction": correction})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda s, t: s.update(version=9), "expected version 2"),
        (lambda s, t: s.update(members=[]), "has no members"),
        (lambda s, t: s["members"][0].update(kind="exec"), "expected a member of kind"),
        (lambda s, t: s["members"][0].update(unit="1"), "expected the setting unit"),
        (lambda s, t: s["members"][0].update(corner=-1.0), "a corner above 0"),
        (lambda s, t: s["members"][0]["net"].update(activations=["os.system"]), "expected activations of"),
        (lambda s, t: t.pop("member0.curves"), "expected the array member0.curves"),
        (lambda s, t: t.update({"member0.curves": t["member0.curves"][:3]}), "must have shape"),
        (lambda s, t: t.update({"member0.curves": t["member0.curves"] * np.nan}), "must hold finite numbers"),
        (lambda s, t: t.update({"guard.margin": -t["guard.margin"]}), "not in order"),
        (lambda s, t: t.update(more=np.ones(2)), "the array more belongs to no part"),
    ],
)
def test_invalid_content_is_refused(trained: TrainingResult, change: object, message: str) -> None:
    assert trained.model.correction is not None
    settings, tensors = to_plain(trained.model.correction)
    settings, tensors = json.loads(json.dumps(settings)), dict(tensors)
    change(settings, tensors)  # type: ignore[operator]
    with pytest.raises(InvalidInput, match=message):
        from_plain(settings, tensors)


def test_the_file_holds_arrays_and_one_line_of_json(saved: Path) -> None:
    content = network_of(saved.parent).read_bytes()
    assert all(array.dtype == np.float64 for array in load(content).values())
    assert b"pickle" not in content


def test_other_forms_refuse_to_lose_the_correction(trained: TrainingResult, tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="the trained correction"):
        fastcal.convert(trained.model, "poe")
    assert "correction" not in fastcal.convert(trained.model, "poe", drop_effects=True).spec
    assert trained.model.correction is not None
    path, sha = write_correction(trained.model.correction, tmp_path / "alone.yaml")
    assert path.name == f"alone-{sha[:16]}.safetensors"
    assert read_correction(path, sha).network == "mlp"


def test_a_foreign_file_of_the_network_s_name_is_not_written_over(trained: TrainingResult, tmp_path: Path) -> None:
    correction = trained.model.correction
    assert correction is not None
    path, _ = write_correction(correction, tmp_path / "model.yaml")
    assert write_correction(correction, tmp_path / "model.yaml")[0] == path
    path.write_text("mine")
    with pytest.raises(InvalidInput, match="another file has this name"):
        trained.model.save(tmp_path / "model.yaml")
    assert [(each.name, each.read_text()) for each in tmp_path.iterdir()] == [(path.name, "mine")]


def test_a_network_that_another_model_names_stays(trained: TrainingResult, tmp_path: Path) -> None:
    trained.model.save(tmp_path / "model.yaml")
    network = network_of(tmp_path)
    shutil.copy(tmp_path / "model.yaml", tmp_path / "copy.yaml")
    changed = fastcal.Robot(
        trained.model.spec | {"correction": replace(trained.model.correction, record={"held_out_mm": {}})}
    )
    changed.save(tmp_path / "model.yaml")
    assert network.exists()
    (tmp_path / "copy.yaml").unlink()
    trained.model.save(tmp_path / "model.yaml")
    assert network_of(tmp_path) == network
