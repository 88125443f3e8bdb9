"""The wheel and the source archive: what is in them. That a second build is the same checks `make dist`."""

from __future__ import annotations

import email
import json
import re
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

from smachpy_viz.live import assets
from tests.places import ROOT

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]

PACKAGES = ("actionlib_core", "smachpy", "viz/smachpy_viz", "missions/smachpy_missions")
NOT_SHIPPED = {
    "smachpy/places/maps/make_office.py",
}


@pytest.fixture(scope="module")
def archives(tmp_path_factory):
    """The source archive and the wheel."""
    folder = tmp_path_factory.mktemp("dist")
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-d", folder],
        cwd=ROOT, check=True, capture_output=True, text=True,
    )  # fmt: skip
    wheel, source = sorted(folder.iterdir())
    assert (wheel.suffix, source.suffix) == (".whl", ".gz")
    return source, wheel


@pytest.fixture(scope="module")
def in_git():
    """The files of the repository."""
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True)
    if listed.returncode:
        pytest.skip("not a clone")
    return {name for name in listed.stdout.splitlines() if (ROOT / name).exists()}


def test_the_wheel_has_the_packages_their_stubs_and_no_tools(archives, in_git):
    with zipfile.ZipFile(archives[1]) as wheel:
        names = {name for name in wheel.namelist() if ".dist-info/" not in name}
    expected = {"smachpy_programs.py"}
    for name in in_git - NOT_SHIPPED:
        package = next((one for one in PACKAGES if name.startswith(f"{one}/")), None)
        if package:
            expected.add(name.removeprefix(f"{package.rpartition('/')[0]}/"))
    stubs = {name for name in names if name.endswith(".pyi")}
    assert "actionlib_core/interfaces/geometry_msgs/msg.pyi" in stubs
    assert "smachpy_missions/interfaces/__init__.pyi" in stubs
    # Modules that are made when they are imported have a file for editors; see .ci/stubs.
    made = {name.removesuffix("i") for name in stubs} - expected
    assert all(name.startswith("actionlib_core/interfaces/") for name in made)
    assert names - stubs == expected | made
    assert {f"smachpy_viz/web/{name}" for name in assets.FILES} <= names


def test_the_source_archive_has_docs_tests_and_changelog(archives, in_git):
    with tarfile.open(archives[0]) as source:
        names = {name.partition("/")[2] for name in source.getnames()}
    assert names == in_git | {"PKG-INFO"}
    assert {"CHANGELOG.md", "docs/tutorial.md", "tests/conftest.py", ".ci/stubs"} <= names


def test_what_a_package_index_shows_leads_there(archives):
    with zipfile.ZipFile(archives[1]) as wheel:
        (name,) = [one for one in wheel.namelist() if one.endswith(".dist-info/METADATA")]
        metadata = email.message_from_bytes(wheel.read(name))
    text = metadata.get_payload()
    assert metadata["Description-Content-Type"] == "text/markdown"
    assert re.search(r"!\[[^\]]*\]\(https://", text)
    assert not re.findall(r"\]\((?!https?:|#)[^)]*\)", text)
    assert {one.partition(",")[0] for one in metadata.get_all("Project-URL")} == {
        "Changelog", "Documentation", "Issues", "Source",
    }  # fmt: skip


def test_the_licence_of_everything_that_is_shipped_is_in_the_wheel(archives):
    with zipfile.ZipFile(archives[1]) as wheel:
        names = wheel.namelist()
        built = json.loads(wheel.read("smachpy_viz/web/built.json"))
        assert any(name.endswith(".dist-info/sboms/sbom.cdx.json") for name in names)
    licences = {Path(name).name for name in names if "/licenses/" in name}
    assert {"LICENSE", "LICENSE-ROS.txt", "LICENSE-Liberation.txt"} <= licences
    for package in built["packages"]:
        short = package["name"].rpartition("/")[2]
        assert f"{short}.LICENSE.txt" in licences, package


def test_the_list_of_what_others_wrote_is_current():
    subprocess.run([sys.executable, ROOT / ".ci" / "sbom", "--check"], check=True)
