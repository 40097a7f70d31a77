"""What `pip install` installs: the wheel's content, its metadata, the command and its help."""

from __future__ import annotations

import importlib.metadata
import importlib.resources
import json
import os
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import palette4d

VERBS = (
    "analyze",
    "info",
    "slice",
    "edit",
    "render",
    "bake",
    "export",
    "config",
    "plot",
    "studio",
    "install-plugin",
    "sample-clip",
)
BUNDLE = "_ofx/Palette4D.ofx.bundle/Contents"


def run_command(*arguments: str) -> subprocess.CompletedProcess[str]:
    """`python -m palette4d ARGUMENTS`, from wherever the tests run."""
    return subprocess.run(
        [sys.executable, "-m", "palette4d", *arguments],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


@pytest.fixture(scope="session")
def wheel() -> Path:
    """The wheel that `make test` built and installed here (PALETTE4D_WHEEL)."""
    path = os.environ.get("PALETTE4D_WHEEL")
    if not path:
        pytest.skip("PALETTE4D_WHEEL names no wheel; `make test-py` builds one and sets it")
    assert Path(path).is_file(), f"PALETTE4D_WHEEL names no file: {path}"
    return Path(path)


@pytest.fixture(scope="session")
def wheel_names(wheel: Path) -> list[str]:
    """The names of the files in the wheel."""
    with zipfile.ZipFile(wheel) as archive:
        return [name for name in archive.namelist() if not name.endswith("/")]


@pytest.fixture(scope="session")
def project_version(repo_root: Path) -> str:
    """The version in CMake's project(), where it stands once."""
    text = (repo_root / "ofx_plugin" / "CMakeLists.txt").read_text(encoding="utf-8")
    match = re.search(r"project\(palette4d\s+VERSION\s+([0-9.]+)", text)
    assert match, "ofx_plugin/CMakeLists.txt has no project(palette4d VERSION …)"
    return match[1]


def test_package_comes_from_the_wheel(wheel: Path) -> None:
    package = Path(palette4d.__file__).resolve()
    assert Path(sys.prefix).resolve() in package.parents, (
        f"palette4d is imported from {package}, not from the environment {sys.prefix} that holds "
        f"{wheel.name}"
    )


@pytest.mark.parametrize(
    "name",
    [
        "palette4d/__init__.py",
        "palette4d/__main__.py",
        "palette4d/_core.pyi",
        "palette4d/py.typed",
        "palette4d/analysis/__init__.py",
        "palette4d/lut_export/__init__.py",
        "palette4d/sidecar_v2.schema.json",
        "palette4d/shots_v1.schema.json",
    ],
)
def test_wheel_holds(name: str, wheel_names: list[str]) -> None:
    assert name in wheel_names


def test_wheel_holds_the_compiled_core_once(wheel_names: list[str]) -> None:
    cores = [
        name for name in wheel_names if re.fullmatch(r"palette4d/_core\.[^/]*(so|pyd|dylib)", name)
    ]
    assert len(cores) == 1, cores


def test_wheel_holds_the_bundle(wheel_names: list[str]) -> None:
    binaries = [name for name in wheel_names if name.endswith(".ofx")]
    assert len(binaries) == 1, binaries
    assert re.fullmatch(rf"palette4d/{BUNDLE}/[^/]+/Palette4D\.ofx", binaries[0]), binaries
    if sys.platform == "linux":
        assert f"palette4d/{BUNDLE}/Linux-" in binaries[0]


def test_wheel_lays_down_nothing_else(wheel_names: list[str]) -> None:
    tops = {name.partition("/")[0] for name in wheel_names}
    info = {top for top in tops if re.fullmatch(r"palette4d-[^/]+\.dist-info", top)}
    assert len(info) == 1
    assert tops - info == {"palette4d"}

    expected = re.compile(
        r".*\.py|.*\.schema\.json|_core\.pyi|py\.typed|_core\.[^/]+\.(so|pyd|dylib)|"
        rf"{re.escape(BUNDLE)}/[^/]+/Palette4D\.ofx|{re.escape(BUNDLE)}/(Info\.plist|Resources/.*)"
    )
    package = [
        name.removeprefix("palette4d/") for name in wheel_names if name.startswith("palette4d/")
    ]
    stray = [name for name in package if not expected.fullmatch(name)]
    assert not stray, f"not meant to be in the wheel: {stray}"


def test_wheel_lists_what_is_compiled_into_it(wheel: Path, project_version: str) -> None:
    """A CycloneDX list where PEP 770 has its place."""
    with zipfile.ZipFile(wheel) as archive:
        lists = [name for name in archive.namelist() if "/sboms/" in name]
        assert lists == [f"palette4d-{project_version}.dist-info/sboms/palette4d.cdx.json"]
        bill = json.loads(archive.read(lists[0]))
    assert (bill["bomFormat"], bill["specVersion"]) == ("CycloneDX", "1.6")
    assert bill["metadata"]["component"]["version"] == project_version
    assert "@_" not in json.dumps(bill)
    found = {part["name"]: part["version"] for part in bill["components"]}
    assert {"nlohmann-json", "pybind11"} < set(found)
    assert all(re.fullmatch(r"\d+(\.\d+)+", version) for version in found.values()), found


LOCKED = {
    "run": [],
    "studio": ["studio"],
    "test": ["test"],
    "build": ["native"],
    "tools": ["native", "lint"],
    "supply": ["supply"],
}


@pytest.mark.parametrize("name", LOCKED)
def test_what_make_downloads_is_pinned_with_hashes(name: str, repo_root: Path) -> None:
    """Each requirement has one version that fits, and hashes; `make lock` mends it."""
    text = (repo_root / "locks" / f"{name}.txt").read_text(encoding="utf-8")
    assert "://" not in text, "the name of an index"
    pinned: dict[str, list[Requirement]] = {}
    for entry in re.sub(r"\\\n|^#.*\n", "", text, flags=re.MULTILINE).splitlines():
        assert " --hash=sha256:" in entry, entry
        one = Requirement(entry.partition(" --hash")[0])
        pinned.setdefault(canonicalize_name(one.name), []).append(one)
    project = tomllib.loads((repo_root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    asked = [] if name in ("build", "tools", "supply") else list(project["dependencies"])
    for extra in LOCKED[name]:
        for requirement in map(Requirement, extras[extra]):
            if requirement.name == "palette4d":
                asked += [line for more in requirement.extras for line in extras[more]]
            else:
                asked.append(str(requirement))
    for requirement in map(Requirement, asked):
        for one in pinned[canonicalize_name(requirement.name)]:
            (exact,) = one.specifier
            assert exact.operator == "=="
            assert requirement.specifier.contains(exact.version), (requirement, one)


def test_every_source_is_in_the_wheel(wheel_names: list[str], repo_root: Path) -> None:
    """A module that the tree has and the wheel lacks would only fail at some user's."""
    mapping = tomllib.loads((repo_root / "pyproject.toml").read_text(encoding="utf-8"))["tool"][
        "scikit-build"
    ]["wheel"]["packages"]
    sources = {
        f"{target}/{path.relative_to(repo_root / folder).as_posix()}"
        for target, folder in mapping.items()
        for path in (repo_root / folder).rglob("*.py")
    }
    assert sources
    assert not sources - set(wheel_names)


def test_node_is_found_through_importlib_resources() -> None:
    contents = importlib.resources.files("palette4d").joinpath(*BUNDLE.split("/"))
    binaries = [
        entry
        for folder in contents.iterdir()
        if folder.is_dir()
        for entry in folder.iterdir()
        if entry.name == "Palette4D.ofx"
    ]
    assert len(binaries) == 1
    assert binaries[0].read_bytes()[:4] in (b"\x7fELF", b"\xcf\xfa\xed\xfe", b"MZ\x90\x00")


def test_metadata() -> None:
    metadata = importlib.metadata.metadata("palette4d")
    assert metadata["Name"] == "palette4d"
    assert metadata["License-Expression"] == "BSD-3-Clause"
    assert metadata["Requires-Python"] == "<3.14,>=3.11"
    assert metadata["Summary"]
    assert "make demo" in (metadata.get_payload() or metadata["Description"])
    (command,) = importlib.metadata.entry_points(group="console_scripts", name="palette4d")
    assert command.value == "palette4d.cli.main:main"


def test_version_is_everywhere_the_same(project_version: str) -> None:
    assert importlib.metadata.version("palette4d") == project_version
    assert palette4d.__version__ == project_version
    done = run_command("--version")
    assert (done.returncode, done.stdout.strip()) == (0, f"palette4d {project_version}")


def test_command_is_installed(project_version: str) -> None:
    script = Path(sys.executable).parent / "palette4d"
    done = subprocess.run(
        [script, "--version"], capture_output=True, text=True, timeout=120, check=False
    )
    assert done.stdout.strip() == f"palette4d {project_version}"


@pytest.mark.parametrize("verb", VERBS)
def test_help_of_each_verb_has_an_example(verb: str) -> None:
    done = run_command(verb, "--help")
    assert done.returncode == 0, done.stderr
    assert not done.stderr
    assert "example" in done.stdout.lower()
    assert f"palette4d {verb}" in done.stdout.partition("xample")[2], "the example shows the verb"


def test_help_lists_every_verb() -> None:
    done = run_command("--help")
    assert done.returncode == 0
    listed = re.findall(r"^ {4}([a-z-]+)(?: |$)", done.stdout, flags=re.MULTILINE)
    assert sorted(set(listed)) == sorted(VERBS)


def test_help_is_quick_to_load() -> None:
    """The heavy libraries load only in the verbs that need them."""
    program = (
        "import sys, palette4d.cli.main as m; m.build_parser(); "
        "print(*sorted({'matplotlib', 'OpenImageIO', 'PyOpenColorIO', 'nlopt', 'av', 'scipy', "
        "'distributed', 'opentimelineio'} "
        "& {name.partition('.')[0] for name in sys.modules}))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=120, check=True
    )
    assert done.stdout.split() == []


@pytest.mark.parametrize("arguments", [(), ("no-such-verb",), ("info",)])
def test_wrong_usage_is_2_and_says_so_on_stderr(arguments: tuple[str, ...]) -> None:
    done = run_command(*arguments)
    assert done.returncode == 2
    assert done.stdout == ""
    assert "usage: palette4d" in done.stderr
