from __future__ import annotations

import io
import json
import shutil
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

torch = pytest.importorskip("torch")

from cbagan_ompl import ModelError
from cbagan_ompl.inference import bundled_models, model_files
from cbagan_ompl.inference.predictor import load_model
from cbagan_ompl.training.torchscript import save_script


@pytest.fixture
def model(exported: Path, tmp_path: Path) -> Path:
    """A copy without manifest, to damage."""
    return Path(shutil.copy(exported, tmp_path / "model.pt"))


def rewrite_record(path: Path, change: Callable[[dict[str, Any]], object]) -> None:
    source = io.BytesIO(path.read_bytes())
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            content = old.read(name)
            if name.endswith(model_files.RECORD_NAME):
                record = json.loads(content)
                change(record)
                content = json.dumps(record).encode()
            new.writestr(name, content)


def foreign_script(path: Path) -> None:
    save_script(torch.nn.Identity().eval(), path, {})
    source = io.BytesIO(path.read_bytes())
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            if not name.endswith(model_files.RECORD_NAME):
                new.writestr(name, old.read(name))


def plain_zip(path: Path) -> None:
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("a/b.txt", "text")


def broken_record(path: Path) -> None:
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(f"model/extra/{model_files.RECORD_NAME}", "{")


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda path: path.unlink(), "no such file"),
        (lambda path: (path.unlink(), path.mkdir()), "is a folder"),
        (lambda path: path.write_bytes(b""), "is empty"),
        (lambda path: path.write_text("weights: none\n"), "a text file"),
        (lambda path: path.write_bytes(bytes(range(256)) * 8), "not an exported model"),
        (lambda path: path.write_bytes(path.read_bytes()[:-4000]), "cut short"),
        (plain_zip, "a zip archive, but not"),
        (broken_record, "is damaged"),
        (lambda path: torch.save({"w": torch.ones(1)}, path), "run: cbagan-ompl export"),
        (foreign_script, "not one that `cbagan-ompl export` wrote"),
        (
            lambda path: rewrite_record(path, lambda record: record.update(schema=99)),
            "version 99.*install a newer",
        ),
        (
            lambda path: rewrite_record(path, lambda record: record.pop("working_size")),
            "lacks working_size",
        ),
        (
            lambda path: rewrite_record(path, lambda record: record.update(working_size=0)),
            "lacks working_size",
        ),
        (lambda path: rewrite_record(path, lambda record: record.pop("schema")), "lacks schema"),
        (lambda path: rewrite_record(path, lambda record: record.pop("name")), "lacks name"),
        (
            lambda path: rewrite_record(path, lambda record: record.update(parameters="many")),
            "lacks parameters",
        ),
        (
            lambda path: rewrite_record(path, lambda record: record.clear()),
            "lacks schema, working_size, name, parameters",
        ),
    ],
)
def test_bad_files_are_told_apart(
    model: Path, spoil: Callable[[Path], object], message: str
) -> None:
    spoil(model)
    with pytest.raises(ModelError, match=message) as caught:
        load_model(model)
    assert str(model) in str(caught.value)


def test_a_checkpoint_is_no_model(checkpoint: Path) -> None:
    with pytest.raises(ModelError, match="run: cbagan-ompl export"):
        load_model(checkpoint)


def test_damage_that_only_torch_sees(model: Path) -> None:
    source = io.BytesIO(model.read_bytes())
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(model, "w") as new:
        for name in old.namelist():
            if not name.endswith("data.pkl"):
                new.writestr(name, old.read(name))
    with pytest.raises(ModelError, match="torch cannot load the model"):
        load_model(model)


def test_a_model_that_differs_from_the_manifest(exported: Path, tmp_path: Path) -> None:
    for name in ("tiny.pt", "manifest.json"):
        shutil.copy(exported.parent / name, tmp_path)
    load_model(tmp_path / "tiny.pt")
    rewrite_record(tmp_path / "tiny.pt", lambda record: record.update(name="other"))
    with pytest.raises(ModelError, match="SHA-256 differs"):
        load_model(tmp_path / "tiny.pt")


@pytest.mark.parametrize("text", ["{", "[]", '{"default": "a.pt"}'])
def test_bad_manifest(tmp_path: Path, text: str) -> None:
    (tmp_path / "manifest.json").write_text(text)
    with pytest.raises(ModelError, match="list of models"):
        model_files.read_manifest(tmp_path / "manifest.json")


def test_bundled_model_of_a_wheel_and_of_a_checkout(
    exported: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "cbagan_ompl"
    monkeypatch.setattr(bundled_models, "__file__", str(package / "inference" / "x.py"))
    with pytest.raises(ModelError, match=r"no bundled model"):
        load_model()
    for folder in (tmp_path / "models", package / "models"):
        shutil.copytree(exported.parent, folder)
        assert bundled_models.bundled_model() == folder / "tiny.pt"
    assert load_model().record["name"] == "tiny"
    assert bundled_models.find_model("tiny") == package / "models" / "tiny.pt"


def test_names_of_bundled_models(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert load_model("cbagan").record["name"] == "cbagan"
    assert bundled_models.find_model("cbagan-worlds") == bundled_models.bundled_model()
    with pytest.raises(ModelError, match=r"no bundled model 'cbagen': give one of .*cbagan, cb"):
        load_model("cbagen")
    for path in ("cbagan.pt", "./cbagan", Path("cbagan")):
        assert bundled_models.find_model(path) == Path(path)
    monkeypatch.chdir(tmp_path)
    Path("cbagan").touch()
    assert bundled_models.find_model("cbagan") == Path("cbagan"), "a file of the user's comes first"
