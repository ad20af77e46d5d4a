"""What is handed out: a wheel and a source archive that work in a clean environment, and recipes that agree with them."""

import re
import shutil
import subprocess
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest
from real_records import RIGS

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def test_the_conda_recipe_asks_for_what_the_package_does():
    recipe = (ROOT / "packaging/conda/recipe.yaml").read_text(encoding="utf-8")
    run = recipe.partition("  run:\n")[2].partition("\ntests:")[0]
    asked = dict(line.removeprefix("    - ").split(" ") for line in run.splitlines())
    wanted = dict(re.fullmatch(r"([\w-]+)(>=.*)", item).groups() for item in PROJECT["dependencies"])
    wanted["matplotlib-base"] = wanted.pop("matplotlib")
    assert asked == wanted | {"python": PROJECT["requires-python"]}
    version = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))["workspace"]["package"]["version"]
    assert f'version: "{version}"' in recipe


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("make") is None, reason="the wheel is made by make")
def test_the_wheel_runs_in_a_clean_environment():
    subprocess.run(["make", "--directory", ROOT, "wheel"], check=True)
    (wheel,), (source,) = (ROOT / "dist").glob("*.whl"), (ROOT / "dist").glob("*.tar.gz")
    inside = set(zipfile.ZipFile(wheel).namelist())
    assert {"stickslip/examples/block.csv", "stickslip/examples/block.toml", "stickslip/py.typed"} <= inside
    assert {f"stickslip/examples/rigs/{path.name}" for path in RIGS.glob("*.toml")} <= inside
    assert "abi3" in wheel.name
    with tarfile.open(source) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    assert {"Cargo.lock", "LICENSE", "README.md", "crates/stickslip/src/lib.rs"} <= names


def test_the_core_can_be_published():
    # What is published may only need what is published too.
    manifests = {path.parent.name: tomllib.loads(path.read_text("utf-8")) for path in ROOT.glob("crates/*/Cargo.toml")}
    public = {found["package"]["name"] for found in manifests.values() if "publish" not in found["package"]}
    needed = {name for name in manifests["stickslip"]["dependencies"] if name.startswith("stickslip")}
    assert "stickslip" in public
    assert needed <= public
