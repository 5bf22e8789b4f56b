"""The Debian package: ``python3 packaging/deb.py [--out DIR] [--work DIR]`` (make deb), with the Debian that it is for.

An environment of its own under /opt/companion for this release's Python, with what requirements.lock names and the
compiled kernels; commands, units, udev rule, manual pages and completion. Needs python3-venv, python3-dev, g++,
dpkg-deb and the network (or pip's own settings: PIP_FIND_LINKS, PIP_NO_INDEX). With --work what is made is kept there:
interrupted, it goes on where it was.
"""

import argparse
import contextlib
import gzip
import hashlib
import os
import re
import shutil
import subprocess
import sys
import tempfile
from datetime import UTC, datetime
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
NAME = "sailboat-companion"
HOME = "/opt/companion"
PYTHON = f"python{sys.version_info.major}.{sys.version_info.minor}"
# What nobody runs on a boat: 100 MB.
LEFT_OUT = (
    "numba/tests",
    "numpy/*/tests",
    "numpy/tests",
    "shapely/tests",
    "lxml/includes",
    "pymavlink/generator",
    "pymavlink/tools",
    "pymavlink/dialects/v*/*",
    "numba/cuda/tests",
    "llvmlite/tests",
)
KEPT = re.compile(r"pymavlink/dialects/v[12]0/(__init__|ardupilotmega|common|minimal|standard)\.py")


def run(*command: object, cwd: Path = ROOT) -> str:
    """Run a program; return what it prints."""
    return subprocess.run(
        [str(part) for part in command], cwd=cwd, check=True, text=True, stdout=subprocess.PIPE
    ).stdout.strip()


def version() -> str:
    """Return the version, from its one place."""
    return re.search(r'__version__ = "(.+)"', (ROOT / "companion/__init__.py").read_text())[1]


def release() -> str:
    """Return Debian's release, as part of a version: deb12."""
    fields = dict(line.split("=", 1) for line in Path("/etc/os-release").read_text().splitlines() if "=" in line)
    return f"deb{fields.get('VERSION_ID', '0').strip(chr(34))}"


def environment(stage: Path, work: Path) -> None:
    """Fill /opt/companion."""
    home = stage / HOME.lstrip("/")
    done = work / "installed"  # the libraries
    if not done.exists():
        run(f"/usr/bin/{PYTHON}", "-m", "venv", "--clear", work / "pip")
        run(f"/usr/bin/{PYTHON}", "-m", "venv", "--clear", "--without-pip", "--symlinks", home)
    pip = (
        work / "pip/bin/python",
        "-m",
        "pip",
        "--python",
        home / "bin/python",
        "install",
        "--quiet",
        "--no-compile",
        "--disable-pip-version-check",
    )
    if not done.exists():
        print("deb: installing libraries", flush=True)
        run(
            work / "pip/bin/python",
            "-m",
            "pip",
            "install",
            "--quiet",
            "--disable-pip-version-check",
            "hatchling",
            "setuptools",
            "shtab",
        )
        run(*pip, "--require-hashes", "-r", ROOT / "requirements.lock")
        done.touch()
    shutil.rmtree(work / "wheel", ignore_errors=True)
    run(work / "pip/bin/python", "-m", "hatchling", "build", "-t", "wheel", "-d", work / "wheel")
    run(*pip, "--no-deps", "--force-reinstall", *(work / "wheel").glob("*.whl"))
    libraries = next(home.glob("lib/python3.*/site-packages"))
    for name in ("companion", "sitl"):  # of what was there before
        for path in (libraries / name).rglob("__pycache__"):
            shutil.rmtree(path)
    for pattern in LEFT_OUT:
        for path in libraries.glob(pattern):
            if path.is_dir():
                shutil.rmtree(path)
            elif not KEPT.search(path.as_posix()):
                path.unlink()
    print("deb: compiling kernels", flush=True)
    tools = next((work / "pip").glob("lib/python3.*/site-packages"))  # setuptools, for the compiler; shtab
    python = ("/usr/bin/env", f"PYTHONPATH={tools}", home / "bin/python", "-B")
    run(*python, "-m", "companion.kernels.carry", cwd=work)
    run(*python, ROOT / "packaging/pages.py", work / "pages", cwd=work)
    for path in (home / "bin").iterdir():  # of the place where they will be
        if path.is_file() and not path.is_symlink():
            if path.name not in {"companion", "sitl"}:
                path.unlink()
            else:
                path.write_text(path.read_text().replace(str(home), HOME))
    (home / ".gitignore").unlink(missing_ok=True)  # of venv, from Python 3.13 on
    config = home / "pyvenv.cfg"
    config.write_text(config.read_text().replace(str(home), HOME))
    for name in ("python", "python3"):
        link(home / "bin" / name, f"/usr/bin/{PYTHON}")
    # by content, not by time: packed files keep neither this folder's name nor its clock
    run(
        f"/usr/bin/{PYTHON}",
        "-m",
        "compileall",
        "-q",
        "-s",
        stage,
        "-p",
        "/",
        "--invalidation-mode",
        "unchecked-hash",
        libraries,
    )


def put(source: Path, target: Path, mode: int = 0o644) -> None:
    """Copy a file."""
    target.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(source, target)
    target.chmod(mode)


def link(path: Path, target: str) -> None:
    """Make a symbolic link, in place of another."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.unlink(missing_ok=True)
    path.symlink_to(target)


def zipped(target: Path, text: bytes) -> None:
    """Write a compressed file that is the same for the same text."""
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_bytes(gzip.compress(text, mtime=0))


def around(stage: Path, work: Path) -> None:
    """Put everything else in its place."""
    put(ROOT / "deploy/companion@.service", stage / "lib/systemd/system/companion@.service")
    put(ROOT / "deploy/60-companion.rules", stage / "lib/udev/rules.d/60-companion.rules")
    put(ROOT / "deploy/service.env", stage / "etc/companion/service.env")
    put(ROOT / "packaging/debian/lintian-overrides", stage / f"usr/share/lintian/overrides/{NAME}")
    for name in ("companion", "sitl"):
        link(stage / "usr/bin" / name, f"{HOME}/bin/{name}")
        put(work / "pages/bash" / name, stage / "usr/share/bash-completion/completions" / name)
        put(work / "pages/zsh" / name, stage / f"usr/share/zsh/vendor-completions/_{name}")
    for page in (work / "pages/man1").iterdir():
        zipped(stage / f"usr/share/man/man1/{page.name}.gz", page.read_bytes())
    documents = stage / "usr/share/doc" / NAME
    put(ROOT / "packaging/debian/copyright", documents / "copyright")
    zipped(documents / "changelog.gz", changelog().encode())
    for page in ("guides/on-the-boat.md", "reference/service.md", "reference/formats.md", "reference/watchdogs.md"):
        put(ROOT / "docs" / page, documents / Path(page).name)


def changelog() -> str:
    """Return Debian's changelog: it refers to the project's own."""
    date = datetime.fromtimestamp(
        int(os.environ.get("SOURCE_DATE_EPOCH") or run("git", "log", "-1", "--format=%ct")), UTC
    ).strftime("%a, %d %b %Y %H:%M:%S +0000")
    return (
        f"{NAME} ({version()}~{release()}) unstable; urgency=medium\n\n  * Version {version()}: see the project's "
        f"CHANGELOG.md.\n\n -- {NAME} <maintainers@{NAME}.example>  {date}\n"
    )


def control(stage: Path) -> None:
    """Write what dpkg is told."""
    folder = stage / "DEBIAN"
    folder.mkdir(exist_ok=True)
    architecture = run("dpkg", "--print-architecture")
    size = sum(p.lstat().st_size for p in stage.rglob("*") if p.is_file() and not p.is_symlink())
    text = (ROOT / "packaging/debian/control.in").read_text()
    for name, value in {
        "VERSION": f"{version()}~{release()}",
        "ARCHITECTURE": architecture,
        "PYTHON": PYTHON,
        "SIZE": str(size // 1024),
    }.items():
        text = text.replace(f"@{name}@", value)
    (folder / "control").write_text(text)
    (folder / "conffiles").write_text("/etc/companion/service.env\n")
    for name in ("postinst", "prerm", "postrm"):
        put(ROOT / "packaging/debian" / name, folder / name, 0o755)
    sums = [
        f"{digest(path)}  {path.relative_to(stage)}"
        for path in sorted(stage.rglob("*"))
        if path.is_file() and not path.is_symlink() and folder not in path.parents
    ]
    (folder / "md5sums").write_text("\n".join(sums) + "\n")


def digest(path: Path) -> str:
    """Return what dpkg compares an installed file with."""
    return hashlib.md5(path.read_bytes(), usedforsecurity=False).hexdigest()


def main() -> None:
    """Build it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=ROOT / "dist")
    parser.add_argument("--work", type=Path, help="a folder to work in, and to go on in (default: a temporary one)")
    parser.add_argument(
        "--tree",
        action="store_true",
        help="stop when the package's tree is whole (--work DIR/stage), and write its name to DIR/name",
    )
    args = parser.parse_args()
    if args.tree and args.work is None:
        parser.error("--tree needs --work")
    out = args.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    with contextlib.ExitStack() as stack:
        work = (args.work or Path(stack.enter_context(tempfile.TemporaryDirectory()))).resolve()
        stage = work / "stage"
        stage.mkdir(mode=0o755, parents=True, exist_ok=True)
        environment(stage, work)
        around(stage, work)
        for path in stage.rglob("*"):
            if not path.is_symlink():
                path.chmod(0o755 if path.is_dir() or path.parent.name == "bin" else 0o644)
        control(stage)
        name = f"{NAME}_{version()}~{release()}_{run('dpkg', '--print-architecture')}.deb"
        if args.tree:
            (work / "name").write_text(f"{name}\n")
            return
        target = out / name
        run("dpkg-deb", "--build", "--root-owner-group", "-Zxz", stage, target)
    print(f"{target}: {target.stat().st_size / 1e6:.1f} MB")


if __name__ == "__main__":
    main()
